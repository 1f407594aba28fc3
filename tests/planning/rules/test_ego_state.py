"""What cannot be true is told."""

import itertools

import numpy as np
import pytest
from planning_scenes import CONSTANTS, PROBLEM, STRAIGHT

from coverdrive.planning.problem.vehicle import step, within_limits
from coverdrive.planning.rules.ego_state import assumed_state, continued, plausible
from coverdrive.road import Road


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
    part, ends = period / 10, []
    for wish in itertools.product((-8.0, 3.0), (-5.0, 5.0)):
        driven, before = np.array([0.0, 5.4, speed, 0.0]), (0.0, 0.0)
        for _ in range(10):
            before = within_limits(tuple(driven), wish, before, part, part, STRAIGHT, CONSTANTS.vehicle)
            driven = step(driven, np.array(before), part)
        ends.append(driven)
    assert all(continued(first, second, period) for first in ends for second in ends)


def test_a_call_that_is_a_tenth_of_a_second_late_is_no_jump() -> None:
    assert continued(np.array([9.0, 5.4, 45.0, 0.0]), np.array([4.5, 5.4, 45.0, 0.0]), 0.1)
