"""Constraints are active where the plan could not come any closer to a path."""

import dataclasses

import numpy as np
import pytest

from coverdrive.paths import PredictedPaths
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.reporting.drives.active_constraints import active_constraints


@pytest.mark.parametrize(("more", "binds"), [(-0.5, True), (0.001, True), (0.5, False)])
def test_distance_decides(trace, more: float, binds: bool) -> None:
    car, obstacles = ProblemSettings().vehicle, ProblemSettings().obstacles
    plan = trace.plans[0]
    heading = 0.01  # the smooth bound of a heading of zero
    reach = obstacles.inflation * (1.0 + car.width / 2 + heading * car.length / 2)
    points = plan.states[None, :, :2] + [0.0, reach + more]
    paths = PredictedPaths(points, np.array([1]), np.broadcast_to([2.5, 1.0], points.shape), plan.dt)
    changed = dataclasses.replace(trace, paths=(paths, *trace.paths[1:]))
    found = active_constraints(changed, 0, ProblemSettings())
    assert found.shape == (1, len(plan.states))
    assert not found[0, 0]
    assert (found[0, 1:] == binds).all()


def test_paths_constrain_the_fail_safe_branch_where_there_is_one(trace) -> None:
    """A path far from the drive branch, through the other one."""
    plan = trace.plans[0]
    plan = dataclasses.replace(plan, fail_safe=plan.states + np.array([0.0, 30.0, 0.0, 0.0]))
    points = plan.fail_safe[None, :, :2]
    paths = PredictedPaths(points, np.array([1]), np.broadcast_to([2.5, 1.0], points.shape), plan.dt)
    changed = dataclasses.replace(trace, plans=(plan, *trace.plans[1:]), paths=(paths, *trace.paths[1:]))
    assert active_constraints(changed, 0, ProblemSettings())[0, 1:].all()
