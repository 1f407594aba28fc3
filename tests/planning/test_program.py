"""The nonlinear program against the merit and the rollout that the search computes."""

from typing import Any

import numpy as np
import pytest
from planning_scenes import WANTED, between

from coverdrive.planning.check.merit import merit
from coverdrive.planning.problem.constants import constants_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.tree import BranchSettings
from coverdrive.planning.surroundings import Surroundings
from oracle.program import Program, bounds, build_program, padded, parameters, start_values

ca: Any = pytest.importorskip("casadi")
TWO, ONE = ProblemSettings(), ProblemSettings(branches=BranchSettings(fail_safe=False))
PERIOD, TARGETS = 0.1, np.array([5.4, 1.8])


def boxes_of(rng: np.random.Generator, count: int) -> np.ndarray:
    """Boxes about as fast as the ego, so that no step passes one in parts."""
    boxes = np.ones((7, 13, count))
    boxes[0] = rng.uniform(5, 30, count) + 0.25 * rng.uniform(17, 23, count) * np.arange(13)[:, None]
    boxes[1], boxes[2], boxes[3] = rng.uniform(0, 11, count), rng.uniform(2, 4, count), rng.uniform(1, 2, count)
    boxes[4] = 1e5
    boxes[4, -1], boxes[5, -1] = rng.uniform(5, 30, count), rng.uniform(0, 9, count)
    return boxes


def scene(seed: int) -> tuple[Surroundings, np.ndarray]:
    """Surroundings with slots of 8 and 4, and inputs of the longer tree."""
    rng = np.random.default_rng(seed)
    state, before = np.array([0.0, rng.uniform(0.9, 9.9), 22.0, 0.04]), np.array([-0.5, 0.02])
    around = Surroundings(state, before, between(0.0, 10.8), WANTED, boxes_of(rng, 8), boxes_of(rng, 4))
    inputs = rng.normal(scale=[1.5, 0.02], size=(len(constants_of(TWO, PERIOD).tree.parent), 2))
    return around, inputs


def program_of(problem: ProblemSettings) -> Program:
    return build_program(problem, constants_of(problem, PERIOD), 8, 4)


@pytest.mark.parametrize("problem", [TWO, ONE], ids=["two branches", "one plan"])
def test_objective_with_the_smallest_slacks_is_the_merit(problem: ProblemSettings) -> None:
    program, constants = program_of(problem), constants_of(problem, PERIOD)
    both = ca.Function("both", [program.nlp["x"], program.nlp["p"]], [program.nlp["f"], program.nlp["g"]])
    penalised = 0
    for seed in range(20):
        around, inputs = scene(seed)
        inputs, given = inputs[: len(constants.tree.parent)], parameters(TARGETS, around)
        values = start_values(program, inputs, given, around, constants)
        objective, constraints = both(values, given)
        expected = merit(inputs, TARGETS, around, constants)
        assert float(objective) == pytest.approx(expected.value, rel=1e-9)
        rows = np.asarray(constraints).ravel()
        np.testing.assert_allclose(rows[: program.equalities], 0.0, atol=1e-9)
        assert rows[program.equalities :].max() < 1e-9
        penalised += expected.value > 2 * expected.cost
    assert penalised >= 10


def test_constraints_follow_lateral_acceleration_and_power() -> None:
    program, constants = program_of(TWO), constants_of(TWO, PERIOD)
    around, inputs = scene(1)
    inputs[3, 1] = 0.4
    values = start_values(program, inputs, given := parameters(TARGETS, around), around, constants)
    rows = np.asarray(ca.Function("g", [program.nlp["x"], program.nlp["p"]], [program.nlp["g"]])(values, given)).ravel()
    limits = rows[program.equalities : program.equalities + 3 * len(inputs)].reshape(-1, 3)
    speed = 22 + 0.25 * inputs[:3, 0].sum()
    expected = [0.4 * speed - 4, -0.4 * speed - 4, inputs[3, 0] * speed - 84.1]
    np.testing.assert_allclose(limits[3], expected, rtol=1e-12)


def test_boxes_that_fill_up_ask_for_no_slack() -> None:
    constants = constants_of(TWO, PERIOD)
    around, inputs = scene(2)
    fewer = around._replace(boxes=around.boxes[:, :, :5].copy(), likely=around.likely[:, :, :0].copy())
    filled = fewer._replace(boxes=padded(fewer.boxes), likely=padded(fewer.likely))
    assert (filled.boxes.shape[2], filled.likely.shape[2]) == (8, 4)
    assert padded(around.boxes).shape == around.boxes.shape
    expected = merit(inputs, TARGETS, fewer, constants).value
    assert merit(inputs, TARGETS, filled, constants).value == pytest.approx(expected, rel=1e-12)


def test_bounds_give_way_to_the_current_state() -> None:
    program, constants = program_of(TWO), constants_of(TWO, PERIOD)
    nodes = len(constants.tree.parent)
    around = scene(0)[0]._replace(state=np.array([0.0, 2.0, 50.0, -0.6]), previous_input=np.array([1.0, 0.0]))
    low, high = (each[: 6 * nodes] for each in bounds(program, around, constants))
    (low_inputs, low_states), (high_inputs, high_states) = (np.split(each, [2 * nodes]) for each in (low, high))
    np.testing.assert_array_equal(high_states.reshape(-1, 4)[:, 2], 50.0)
    np.testing.assert_array_equal(low_states.reshape(-1, 4)[:, 3], -0.6)
    np.testing.assert_array_equal(high_states.reshape(-1, 4)[:, 3], 0.6)
    turn = np.sqrt(4.0 * np.tan(1.066) / 2.579)  # where steering and lateral acceleration bind
    np.testing.assert_array_equal(low_inputs.reshape(-1, 2)[1:], np.tile([-8.0, -turn], (nodes - 1, 1)))
    np.testing.assert_array_equal(high_inputs.reshape(-1, 2)[1:], np.tile([3.0, turn], (nodes - 1, 1)))
    most = 20.0 * PERIOD  # the first input keeps to the jerk
    np.testing.assert_allclose(low_inputs[:2], [1 - most, -most / 50])
    np.testing.assert_allclose(high_inputs[:2], [84.1 / 50, most / 50])  # and to the power
    slacks = bounds(program, around, constants)
    np.testing.assert_array_equal(slacks[0][6 * nodes :], 0.0)
    assert np.isinf(slacks[1][6 * nodes :]).all()
