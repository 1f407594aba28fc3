"""IPOPT finds minima of the problem, whichever way round the scene is, and a failure is a None."""

import numpy as np
import pytest

from coverdrive.planning.check.evaluate import drive_step
from coverdrive.planning.check.merit import input_at, merit
from coverdrive.planning.problem.constants import constants_of
from coverdrive.planning.problem.road_table import table_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.surroundings import Surroundings, surroundings_of
from coverdrive.road import Road
from coverdrive.road_ahead import STRAIGHT
from oracle.solvers import SolverSettings, compiled_program, compiled_solver, solve

PROBLEM, PERIOD = ProblemSettings(), 0.1
CONSTANTS = constants_of(PROBLEM, PERIOD)
NOTHING = np.zeros((len(CONSTANTS.tree.parent), 2))
EXACT = SolverSettings(tolerance=1e-7, max_iterations=500)


def made(paths) -> Surroundings:
    table = table_of(Road.straight(), PROBLEM)
    return surroundings_of(np.array([50.0, 1.8, 20.0, 0.0]), np.zeros(2), paths, table, PROBLEM)


@pytest.mark.parametrize("targets", [(1.8, 1.8), (5.4, 1.8)])
@pytest.mark.parametrize("ahead", [14.0, 40.0])
def test_no_small_change_makes_a_solution_cheaper(straight_paths, targets, ahead: float) -> None:
    around, aims = made(straight_paths((50 + ahead, 1.8, 15), (35, 5.4, 19), (80, 9, 18))), np.array(targets)
    found = solve(NOTHING, aims, around, PROBLEM, PERIOD, EXACT)
    assert found is not None
    least, random = merit(found, aims, around, CONSTANTS).value, np.random.default_rng(0)
    assert least < 0.9 * merit(NOTHING, aims, around, CONSTANTS).value
    for _ in range(100):
        changed = feasible(found + random.normal(0, [0.05, 0.002], found.shape), around)
        assert merit(changed, aims, around, CONSTANTS).value > least * (1 - 1e-6)


def feasible(inputs: np.ndarray, around: Surroundings) -> np.ndarray:
    """The nearest inputs within the limits, the jerk of the first one among them."""
    first = 20.0 * PERIOD * np.array([1, 1 / around.state[2]])
    result, states = inputs.copy(), {-1: tuple(around.state)}
    result[0] = np.clip(result[0], around.previous_input - first, around.previous_input + first)
    for n, parent in enumerate(CONSTANTS.tree.parent):
        before, wish = input_at(result, parent, around.previous_input), (result[n, 0], result[n, 1])
        elapsed = CONSTANTS.dt if parent >= 0 else PERIOD
        result[n], states[n] = drive_step(
            states[int(parent)], wish, before, elapsed, CONSTANTS.dt, STRAIGHT, CONSTANTS.vehicle
        )
    return result


def test_a_mirrored_scene_has_the_mirrored_solution(straight_paths) -> None:
    around, targets = made(straight_paths((90, 1.8, 15), (35, 5.4, 19))), np.array([5.4, 1.8])
    boxes, likely = around.boxes.copy(), around.likely.copy()
    boxes[1], likely[1] = 10.8 - boxes[1], 10.8 - likely[1]
    state = around.state * [1, -1, 1, -1] + [0, 10.8, 0, 0]
    mirrored = around._replace(state=state, boxes=boxes, likely=likely)
    here = solve(NOTHING, targets, around, PROBLEM, PERIOD, EXACT)
    there = solve(NOTHING, 10.8 - targets, mirrored, PROBLEM, PERIOD, EXACT)
    assert here is not None and there is not None
    assert np.abs(here[:, 1]).max() > 0.01
    np.testing.assert_allclose(there, here * [1, -1], atol=1e-4)


def test_failure_is_none(straight_paths) -> None:
    around = made(straight_paths((64, 1.8, 15)))
    gives_up = SolverSettings(max_iterations=1)
    assert solve(NOTHING, np.array([1.8, 1.8]), around, PROBLEM, PERIOD, gives_up) is None


def test_compiled_once() -> None:
    solver = compiled_solver(ProblemSettings(), PERIOD, 4, 4, SolverSettings(), 0.1)
    assert compiled_solver(ProblemSettings(), PERIOD, 4, 4, SolverSettings(), 0.1) is solver
    assert compiled_solver(ProblemSettings(), PERIOD, 4, 4, SolverSettings(), 1.0) is not solver
    assert compiled_program(ProblemSettings(), PERIOD, 4, 4) is not compiled_program(ProblemSettings(), PERIOD, 8, 4)
