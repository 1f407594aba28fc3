"""The reference planner drives, finds what the planner finds, and is left with manoeuvres where IPOPT fails."""

import numpy as np
import pytest

from coverdrive.plan import Planner, Status
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.problem.vehicle import step
from coverdrive.planning.rules.manners import NONE
from coverdrive.road import Road
from oracle import reference
from oracle.reference import ReferencePlanner
from oracle.solvers import SolverSettings


def test_overtakes_a_slower_car_as_the_planner_does(straight_paths) -> None:
    settings = PlannerSettings(manners=NONE)
    planner, compiled = ReferencePlanner(settings, SolverSettings(tolerance=1e-5)), MpcPlanner(settings)
    assert isinstance(planner, Planner)
    state, other = np.array([0.0, 1.8, 25.0, 0.0]), 25.0
    for each in (planner, compiled):
        each.reset(0.25)
    for k in range(18):
        paths = straight_paths((other, 1.8, 12))
        plan, cost = planner.plan(state, paths, Road.straight()), compiled.plan(state, paths, Road.straight()).cost
        assert plan.status is Status.SOLVED
        assert plan.cost <= 1.01 * cost, k
        assert cost <= 1.01 * plan.cost, k
        state, other = step(state, plan.inputs[0], 0.25), other + 3
    assert state[0] > other + 5


def test_is_left_with_manoeuvres_where_no_solver_converges(straight_paths, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference, "solve", lambda *_: None)
    planner, state = ReferencePlanner(), np.array([0.0, 1.8, 20.0, 0.0])
    blocked = planner.plan(state, straight_paths((12, 1.8, 0), (12, 5.4, 0), (12, 9.0, 0)), Road.straight())
    assert blocked.status is Status.UNSAFE
    assert blocked.inputs[0, 0] == -8.0
    free = ReferencePlanner().plan(state, straight_paths(), Road.straight())
    assert free.status is not Status.UNSAFE
    assert free.cost > 1.001 * MpcPlanner().plan(state, straight_paths(), Road.straight()).cost
