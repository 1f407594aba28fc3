"""The weights of a plan's cost; what steps cost is in `test_tree.py`, what plans cost in `test_merit.py`."""

import numpy as np

from coverdrive.planning.problem.cost import CostSettings


def test_slack_schedule_is_spread_over_the_horizon() -> None:
    weights = CostSettings(slack=1.0).slack_weights(12)
    np.testing.assert_array_equal(weights, [400] * 3 + [200] * 2 + [100] * 3 + [50] * 2 + [10] * 2)
