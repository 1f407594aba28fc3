"""No motion within the limits leaves the reachable range."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from planning_scenes import CAR, drive

from coverdrive.planning.reach import reachable_range


@given(st.integers(0, 2**32 - 1), st.floats(-1, 60), st.floats(-0.6, 0.6))
def test_every_motion_stays_inside(seed: int, speed: float, heading: float) -> None:
    state = np.array([7.0, 2.0, speed, heading])
    wishes = np.random.default_rng(seed).choice([-10.0, -1.0, 0.0, 1.0, 10.0], size=(20, 12, 2))
    states, _ = drive(state, wishes)
    low, high = reachable_range(state, 12, 0.25, CAR)
    assert (states[..., 0] >= low - 1e-9).all()
    assert (states[..., 0] <= high + 1e-9).all()


def test_range_by_hand() -> None:
    low, high = reachable_range(np.array([0.0, 2.0, 40.0, 0.0]), 2, 0.5, CAR)
    cosine = np.cos(0.35)
    lag = 0.25 * np.array([[0.0, 0.0], [41.5 - 40 * cosine, 36 * cosine - 40], [43 - 40 * cosine, 32 * cosine - 40]])
    np.testing.assert_allclose(high, [0, 20, 20 + 0.5 * 41.5] + lag[:, 0])
    np.testing.assert_allclose(low, np.array([0, 20 * cosine, 38 * cosine]) + lag[:, 1])
