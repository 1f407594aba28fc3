"""No motion within the limits leaves the reachable boxes."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from coverdrive.planning.motion import drive
from coverdrive.planning.reach import reachable_boxes
from coverdrive.planning.vehicle import VehicleSettings

CAR = VehicleSettings()


@given(st.integers(0, 2**32 - 1), st.floats(0, 45), st.floats(-0.6, 0.6))
def test_every_motion_stays_inside(seed: int, speed: float, heading: float) -> None:
    rng = np.random.default_rng(seed)
    state = np.array([7.0, 2.0, speed, heading])
    wishes = rng.choice([-10.0, -1.0, 0.0, 1.0, 10.0], size=(12, 20, 2))
    states, _ = drive(state, lambda k, _: wishes[k], 20, 12, 0.25, CAR)
    centres, half_sizes = reachable_boxes(state, 12, 0.25, CAR)
    assert (np.abs(states[:, 1:, :2] - centres) <= half_sizes + 1e-9).all()


def test_first_position_is_certain() -> None:
    centres, half_sizes = reachable_boxes(np.array([0.0, 2.0, 20.0, 0.0]), 12, 0.25, CAR)
    np.testing.assert_allclose(centres[0], [5.0, 2.0])
    np.testing.assert_allclose(half_sizes[0], 0.0, atol=1e-12)


def test_distance_range_by_hand() -> None:
    centres, half_sizes = reachable_boxes(np.array([0.0, 2.0, 40.0, 0.0]), 2, 0.5, CAR)
    low = centres[1, 0] - half_sizes[1, 0]
    high = centres[1, 0] + half_sizes[1, 0]
    assert high == 0.5 * 40 + 0.5 * 41.5
    assert low == 0.5 * 40 + 0.5 * 36 * np.cos(0.25)
