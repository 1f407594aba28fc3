"""The two solvers agree, and a failure is a None."""

import numpy as np
import pytest

from coverdrive.planning.evaluate import Motion
from coverdrive.planning.obstacles import obstacles_of
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.reference import packed, simple_motions
from coverdrive.planning.solvers import SolverSettings, compiled_solver, solve

PROBLEM = ProblemSettings()
EXACT = SolverSettings(tolerance=1e-7)


def made(paths) -> Situation:
    state = np.array([50.0, 1.8, 20.0, 0.0])
    return Situation(state, np.zeros(2), (0.0, 10.8), packed(state, obstacles_of(paths, PROBLEM.obstacles), PROBLEM))


def start_for(situation: Situation, target: float) -> Motion:
    return min(simple_motions(situation, target, [], PROBLEM), key=lambda each: each.lasting_cost)


@pytest.mark.parametrize("target", [1.8, 5.4])
@pytest.mark.parametrize("ahead", [14.0, 40.0])
def test_fatrop_and_ipopt_agree(straight_paths, target: float, ahead: float) -> None:
    situation = made(straight_paths((50 + ahead, 1.8, 15), (35, 5.4, 19), (80, 9, 18)))
    start = start_for(situation, target)
    fatrop = solve(situation, target, start, "fatrop", PROBLEM, EXACT)
    ipopt = solve(situation, target, start, "ipopt", PROBLEM, EXACT)
    assert fatrop is not None
    assert ipopt is not None
    np.testing.assert_allclose(fatrop, ipopt, atol=2e-3)


@pytest.mark.parametrize("solver", ["fatrop", "ipopt"])
def test_failure_is_none(straight_paths, solver) -> None:
    situation = made(straight_paths((64, 1.8, 15)))
    gives_up = SolverSettings(max_iterations=1)
    assert solve(situation, 1.8, start_for(situation, 1.8), solver, PROBLEM, gives_up) is None


def test_compiled_once() -> None:
    first = compiled_solver(ProblemSettings(), 8, "fatrop", SolverSettings(), 0.1)
    assert compiled_solver(ProblemSettings(), 8, "fatrop", SolverSettings(), 0.1) is first
    assert compiled_solver(ProblemSettings(), 16, "fatrop", SolverSettings(), 0.1) is not first


def test_solution_does_not_depend_on_where_the_road_starts(straight_paths) -> None:
    situation = made(straight_paths((64, 1.8, 15)))
    moved_boxes = situation.obstacles._replace(centres=situation.obstacles.centres + np.array([1000.0, 0.0]))
    moved = situation._replace(
        state=situation.state + np.array([1000.0, 0, 0, 0]),
        obstacles=moved_boxes,
    )
    here = solve(situation, 5.4, start_for(situation, 5.4), "fatrop", PROBLEM, EXACT)
    there = solve(moved, 5.4, start_for(moved, 5.4), "fatrop", PROBLEM, EXACT)
    assert here is not None
    assert there is not None
    np.testing.assert_allclose(there, here + np.array([1000.0, 0, 0, 0, 0, 0]), atol=1e-5)
