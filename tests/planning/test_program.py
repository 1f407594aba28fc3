"""The nonlinear program against the same quantities computed from states with NumPy."""

import casadi as ca
import numpy as np
import pytest

from coverdrive.planning.constants import constants_of
from coverdrive.planning.evaluate import Motion, evaluated
from coverdrive.planning.obstacles import Obstacles, clearance, own_half_sizes, smallest_slack, way_to_brake
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.program import (
    Program,
    build_program,
    pack,
    parameter_values,
    variable_bounds,
)

PROBLEM = ProblemSettings()
TARGET = 5.4


@pytest.fixture
def situation() -> Situation:
    rng = np.random.default_rng(3)
    centres = rng.uniform([100, 0], [180, 11], size=(13, 8, 2))
    half_sizes = rng.uniform([2, 1], [4, 2], size=(13, 8, 2))
    state = np.array([100.0, 2.0, 22.0, 0.04])
    speed, deceleration = rng.uniform(5, 40, size=(13, 8)), rng.uniform(0, 6, size=(13, 8))
    obstacles = Obstacles(centres, half_sizes, speed, deceleration, np.ones((13, 8)))
    return Situation(state, np.array([-0.5, 0.02]), (0.0, 10.8), obstacles)


@pytest.fixture
def motion(situation: Situation) -> Motion:
    wishes = np.random.default_rng(5).normal(scale=[2.0, 0.1], size=(12, 2))
    return evaluated(wishes[None], np.array([TARGET]), situation, constants_of(PROBLEM))[0]


def lagging_clearances(states: np.ndarray, obstacles: Obstacles) -> np.ndarray:
    """Of a body that reaches from the states to where the car gets exactly, to second order."""
    _, _, speed, heading = states.T
    velocity = speed[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    lag = (PROBLEM.dt / 2 * (velocity - velocity[0]))[1:]
    longer = np.hypot(lag, 0.05) - 0.05
    own = np.stack(own_half_sizes(np.abs(heading[1:]), PROBLEM.vehicle), axis=-1) + longer / 2
    offset = (states[1:, :2] + lag / 2)[:, None] - obstacles.centres[1:]
    other, hardest = np.minimum(speed[1:, None], obstacles.speed[1:]), PROBLEM.vehicle.max_deceleration
    way = way_to_brake(speed[1:, None], other, obstacles.deceleration[1:], hardest)
    boxes = np.moveaxis(obstacles.half_sizes[1:], -1, 0)
    return clearance(tuple(np.moveaxis(offset, -1, 0)), tuple(boxes), tuple(own.T[..., None]), way, PROBLEM.obstacles)


def evaluate(program: Program, situation: Situation, motion: Motion) -> tuple[float, np.ndarray]:
    values = pack(program, motion.states, motion.inputs, motion.slack, motion.off_road)
    nlp = program.nlp
    both = ca.Function("both", [nlp["x"], nlp["p"]], [nlp["f"], nlp["g"]])
    objective, constraints = both(values, parameter_values(situation, TARGET))
    return float(objective), np.asarray(constraints).ravel()


def test_objective_is_the_cost_of_the_plan(situation: Situation, motion: Motion) -> None:
    assert motion.slack.max() > 0 and motion.off_road.max() >= 0
    objective, _ = evaluate(build_program(PROBLEM, 8), situation, motion)
    assert objective == pytest.approx(float(motion.cost), rel=1e-12)


def test_a_driven_motion_meets_the_constraints(situation: Situation, motion: Motion) -> None:
    program = build_program(PROBLEM, 8)
    slack = smallest_slack(lagging_clearances(motion.states, situation.obstacles), PROBLEM.obstacles.margin)
    _, constraints = evaluate(program, situation, motion._replace(slack=slack))
    equality = np.array(program.equality)
    np.testing.assert_allclose(constraints[equality], 0.0, atol=1e-9)
    assert constraints[~equality].min() > -1e-9


def test_obstacle_rows_are_the_clearances(situation: Situation, motion: Motion) -> None:
    free = motion._replace(slack=np.zeros(12), off_road=np.zeros(12))
    program = build_program(PROBLEM, 8)
    _, constraints = evaluate(program, situation, free)
    expected = lagging_clearances(motion.states, situation.obstacles) - 1 - PROBLEM.obstacles.margin
    last_stage = constraints[-8:]
    np.testing.assert_allclose(last_stage, expected[-1], rtol=1e-9)


def test_stages_add_up() -> None:
    program = build_program(PROBLEM, 8)
    states, inputs, paths = np.array(program.stages).T
    assert states.sum() + inputs.sum() == program.nlp["x"].numel()
    assert states.sum() + paths.sum() == program.nlp["g"].numel() == len(program.equality)
    places = np.concatenate([program.state_index.ravel(), program.input_index.ravel(), program.slack_index.ravel()])
    np.testing.assert_array_equal(np.sort(places), np.arange(program.nlp["x"].numel()))


def test_bounds_give_way_to_the_current_state() -> None:
    program = build_program(PROBLEM, 8)
    low, high = variable_bounds(program, np.array([0.0, 2.0, 50.0, -0.6]), PROBLEM.vehicle)
    np.testing.assert_array_equal(high[program.state_index[:, 2]], 50.0)
    np.testing.assert_array_equal(low[program.state_index[:, 3]], -0.6)
    np.testing.assert_array_equal(high[program.state_index[:, 3]], PROBLEM.vehicle.max_heading)
    np.testing.assert_array_equal(low[program.input_index], np.tile([-8.0, -0.5], (12, 1)))
