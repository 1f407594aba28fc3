"""The search finds what IPOPT finds."""

import numpy as np
import pytest

from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.reference import ReferencePlanner
from coverdrive.planning.search import SearchSettings
from coverdrive.road import Road


@pytest.mark.parametrize(
    "rows",
    [
        [],
        [(30, 1.8, 15)],
        [(25, 1.8, 15), (10, 5.4, 18)],
        [(22, 1.8, 14), (25, 5.4, 14), (28, 9.0, 14)],
        [(40, 1.8, 15), (35, 5.4, 19), (80, 9, 18)],
    ],
)
def test_costs_no_more_than_the_reference(straight_paths, rows) -> None:
    state, paths = np.array([0.0, 1.8, 20.0, 0.0]), straight_paths(*rows)
    reference = ReferencePlanner().plan(state, paths, Road.straight())
    patient = PlannerSettings(search=SearchSettings(tolerance=1e-6), iterations=400, budget=10)
    plan = MpcPlanner(patient).plan(state, paths, Road.straight())
    assert plan.cost <= 1.01 * reference.cost
