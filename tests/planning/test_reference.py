"""The reference planner drives, and says when it does not find a plan."""

import numpy as np
import pytest

from coverdrive.planning import reference
from coverdrive.planning.plan import Status
from coverdrive.planning.reference import ReferencePlanner, ReferenceSettings
from coverdrive.planning.vehicle import step
from coverdrive.road import Road


@pytest.mark.parametrize("solver", ["ipopt", "fatrop"])
def test_overtakes_a_slower_car(straight_paths, solver) -> None:
    planner = ReferencePlanner(ReferenceSettings(solver=solver))
    planner.reset(0.25)
    state, other = np.array([0.0, 1.8, 25.0, 0.0]), 30.0
    for _ in range(24):
        plan = planner.plan(state, straight_paths((other, 1.8, 12)), Road.straight())
        assert plan.status is Status.SOLVED
        state, other = step(state, plan.inputs[0], 0.25), other + 3
    assert state[0] > other + 5


def test_brakes_where_no_solver_converges(straight_paths, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference, "solve", lambda *_: None)
    plan = ReferencePlanner().plan(np.array([0, 1.8, 20, 0.0]), straight_paths((12, 1.8, 0)), Road.straight())
    assert plan.status is Status.UNSAFE
    np.testing.assert_allclose(plan.inputs[:10, 0], -8.0)
    free = ReferencePlanner().plan(np.array([0, 1.8, 20, 0.0]), straight_paths(), Road.straight())
    assert free.status is Status.FALLBACK
