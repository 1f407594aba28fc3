"""Motions within the limits."""

import numpy as np
import pytest

from coverdrive.planning.motion import drive, lane_seeking_inputs
from coverdrive.planning.vehicle import VehicleSettings, rollout

CAR = VehicleSettings()


def test_driven_states_are_the_rollout_of_the_inputs() -> None:
    state = np.array([0.0, 1.8, 20.0, 0.05])
    rng = np.random.default_rng(0)
    wishes = rng.normal(scale=5, size=(12, 4, 2))
    states, inputs = drive(state, lambda k, _: wishes[k], 4, 12, 0.25, CAR)
    np.testing.assert_array_equal(states, rollout(np.tile(state, (4, 1)), inputs, 0.25))


@pytest.mark.parametrize("speed", [3.0, 20.0, 40.0])
@pytest.mark.parametrize("target", [1.8, 5.4])
def test_lane_seeking_reaches_the_lane(speed: float, target: float) -> None:
    state, steps = np.array([0.0, 1.8, speed, 0.0]), 40
    states, _ = drive(
        state,
        lambda _, x: lane_seeking_inputs(x, np.array([target]), np.zeros(1)),
        1,
        steps,
        0.25,
        CAR,
    )
    assert states[0, -1, 1] == pytest.approx(target, abs=0.1)
    assert states[0, :, 1].max() < target + 0.3
