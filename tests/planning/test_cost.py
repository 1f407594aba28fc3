"""The cost of a plan against a hand computation."""

import numpy as np
import pytest

from coverdrive.planning.cost import CostSettings, plan_cost

WEIGHTS = CostSettings(
    reference_speed=10,
    lane=2,
    speed=3,
    heading=5,
    acceleration=7,
    yaw_rate=11,
    acceleration_change=13,
    yaw_rate_change=17,
    terminal=19,
    slack=23,
    slack_schedule=(4, 1),
    off_road=29,
)


def test_two_steps_by_hand() -> None:
    states = np.array([[0.0, 9.0, 99.0, 9.0], [1.0, 3.0, 11.0, 0.5], [2.0, 1.0, 8.0, -1.0]])
    inputs = np.array([[1.0, 0.5], [-1.0, 0.0]])
    got = plan_cost(states, inputs, np.array([0.1, 0.2]), np.array([0.0, 0.3]), np.array([2.0, 1.0]), 2.0, WEIGHTS)
    first = 2 * 1 + 3 * 1 + 5 * 0.25
    last = 19 * (2 * 1 + 3 * 4 + 5 * 1)
    inputs_cost = 7 * (1 + 1) + 11 * 0.25
    changes = 13 * (1 + 4) + 17 * (0.25 + 0.25)
    slack = 23 * (4 * 0.01 + 1 * 0.04) + 29 * 0.09
    assert got == pytest.approx(first + last + inputs_cost + changes + slack)


def test_slack_schedule_is_spread_over_the_horizon() -> None:
    weights = CostSettings(slack=1.0).slack_weights(12)
    np.testing.assert_array_equal(weights, [400] * 3 + [200] * 2 + [100] * 3 + [50] * 2 + [10] * 2)
