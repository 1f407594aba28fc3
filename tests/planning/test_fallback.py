"""The braking manoeuvre brakes and stays in its lane; what cannot be true is told."""

import numpy as np
import pytest

from coverdrive.planning.fallback import assumed_state, braking_inputs, continued, plausible
from coverdrive.planning.problem import ProblemSettings
from coverdrive.planning.vehicle import VehicleSettings, feasible_inputs, rollout, step
from coverdrive.road import Road

PROBLEM = ProblemSettings()


def test_stops_and_stays_stopped() -> None:
    state = np.array([0.0, 5.0, 10.0, 0.1])
    states = rollout(state, braking_inputs(state, 5.4, PROBLEM), PROBLEM.dt)
    np.testing.assert_allclose(states[:6, 2], [10, 8, 6, 4, 2, 0], atol=1e-12)
    np.testing.assert_allclose(states[6:, 2], 0.0, atol=1e-12)


def test_returns_to_the_lane_and_the_direction_of_the_road() -> None:
    state = np.array([0.0, 5.0, 40.0, -0.1])
    inputs = braking_inputs(state, 5.4, PROBLEM)
    states = rollout(state, inputs, PROBLEM.dt)
    assert abs(states[-1, 3]) < 0.05
    assert abs(states[-1, 1] - 5.4) < abs(states[:, 1].min() - 5.4)
    np.testing.assert_array_equal(inputs, feasible_inputs(states[:-1], inputs, PROBLEM.dt, VehicleSettings()))


@pytest.mark.parametrize(
    "state",
    [
        [np.nan, 5.0, 20.0, 0.0],
        [0.0, np.inf, 20.0, 0.0],
        [0.0, 5.0, 400.0, 0.0],
        [0.0, 5.0, 20.0, 3.0],
        [1e12, 5.0, 20.0, 0.0],
        [0.0, 5.0, -80.0, 0.0],
        [0.0, 1e6, 20.0, 0.0],
        [0.0, -6.0, 20.0, 0.0],
    ],
)
def test_impossible_states_are_told(state: list[float]) -> None:
    assert not plausible(np.array(state), PROBLEM.vehicle, Road.straight()).all()
    assert plausible(np.array([0.0, -1.0, 50.0, -0.5]), PROBLEM.vehicle, Road.straight()).all()


def test_what_cannot_be_true_is_assumed_to_need_braking() -> None:
    measured, road = np.array([3.0, np.nan, np.inf, 0.1]), Road.straight()
    assumed = assumed_state(measured, plausible(measured, PROBLEM.vehicle, road), PROBLEM.vehicle, road)
    np.testing.assert_array_equal(assumed, [3.0, 5.4, 45.0, 0.1])


@pytest.mark.parametrize("index", range(4))
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(("period", "factor"), [(0.05, 1), (0.25, 1), (0.5, 2)])
def test_jumps_are_told(index: int, side: int, period: float, factor: float) -> None:
    expected = np.array([100.0, 5.0, 20.0, 0.1])
    jump = side * factor * np.array([5.0, 1.5, 5.0, 0.3]) * (np.arange(4) == index)
    assert continued(expected + 0.99 * jump, expected, period)
    assert not continued(expected + 1.01 * jump, expected, period)


@pytest.mark.parametrize("period", [0.02, 0.1, 0.25, 0.5, 1.0])
@pytest.mark.parametrize("speed", [1.0, 8.0, 20.0, 45.0])
def test_nothing_that_a_car_can_do_is_a_jump(period: float, speed: float) -> None:
    """Whatever it does within a period, where any other thing was planned."""
    state = np.array([0.0, 5.4, speed, 0.0])
    wishes = [(acceleration, yaw_rate) for acceleration in (-8.0, 3.0) for yaw_rate in (-0.5, 0.5)]
    ends = []
    for wish in wishes:
        driven = state
        for _ in range(10):
            driven = step(driven, feasible_inputs(driven, np.array(wish), period / 10, VehicleSettings()), period / 10)
        ends.append(driven)
    assert all(continued(first, second, period) for first in ends for second in ends)


def test_a_call_that_is_a_tenth_of_a_second_late_is_no_jump() -> None:
    assert continued(np.array([9.0, 5.4, 45.0, 0.0]), np.array([4.5, 5.4, 45.0, 0.0]), 0.1)
