"""The weights of a plan's cost; what steps cost is in `test_tree.py`, what plans cost in `test_merit.py`."""

import numpy as np

from coverdrive.planning.problem.cost import CostSettings


def test_slack_schedule_is_spread_over_the_horizon() -> None:
    weights = CostSettings(slack=1.0).slack_weights(12)
    np.testing.assert_array_equal(weights, [400] * 3 + [200] * 2 + [100] * 3 + [50] * 2 + [10] * 2)


def test_at_walking_pace_place_and_speed_count_as_if_urgent_and_turning_a_tenth() -> None:
    cost = CostSettings()
    slow = cost.slow()
    for name in ("heading", "yaw_rate", "yaw_rate_change"):
        assert np.isclose(getattr(slow, name), getattr(cost, name) / 10)
    urgent = {"lane", "speed"}
    assert all(getattr(slow, name) == getattr(cost.hurried(), name) > getattr(cost, name) for name in urgent)
    changed = urgent | {"heading", "yaw_rate", "yaw_rate_change"}
    assert slow.model_dump(exclude=changed) == cost.model_dump(exclude=changed)
