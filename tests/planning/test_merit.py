"""Derivatives of the merit against finite differences, and the merit against the cost of the plan."""

import numpy as np
import pytest

from coverdrive.planning.constants import constants_of
from coverdrive.planning.course import add_pulled_back
from coverdrive.planning.evaluate import evaluate
from coverdrive.planning.merit import Model, Surroundings, input_bounds, merit
from coverdrive.planning.obstacles import ObstacleSettings
from coverdrive.planning.problem import ProblemSettings

STATE = np.array([0.0, 2.0, 22.0, 0.04])
CONSTANTS = constants_of(ProblemSettings())
INPUTS = np.random.default_rng(1).normal(0, np.repeat([3.0, 0.1], 12), (3, 24))


@pytest.fixture
def around() -> Surroundings:
    rng = np.random.default_rng(3)
    boxes = np.zeros((7, 13, 6))
    boxes[0], boxes[1] = rng.uniform(0, 70, (13, 6)), rng.uniform(0, 11, (13, 6))
    boxes[2], boxes[3], boxes[4] = rng.uniform(2, 4, (13, 6)), rng.uniform(1, 2, (13, 6)), 15.0
    return Surroundings(STATE, np.array([-0.5, 0.02]), np.array([0.0, 10.8]), boxes)


def gradient(model: Model) -> np.ndarray:
    by_state, by_input = model.by_state.copy(), model.by_input.copy()
    np.add.at(by_state, model.step, (model.weight * np.maximum(0, model.excess))[:, None] * model.normal)
    add_pulled_back(model.course, by_state, CONSTANTS.dt, by_input)
    return 2 * by_input


@pytest.mark.parametrize("order", [2, 4, 8, 16, 32])
@pytest.mark.parametrize("inputs", INPUTS)
def test_gradient_of_the_merit(inputs: np.ndarray, order: int, around: Surroundings) -> None:
    constants = constants_of(ProblemSettings(obstacles=ObstacleSettings(order=order)))
    model = merit(inputs, 5.4, around, constants)
    assert (model.excess > 0).any()
    small, expected = 1e-6, np.empty(24)
    for i, nudge in enumerate(small * np.eye(24)):
        values = [merit(inputs + sign * nudge, 5.4, around, constants).value for sign in (1, -1)]
        expected[i] = (values[0] - values[1]) / (2 * small)
    np.testing.assert_allclose(gradient(model), expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())


def test_curvature_without_constraints_is_that_of_the_squares(around: Surroundings) -> None:
    around.boxes[0] = 1e5
    straight = np.zeros(24)
    state = np.array([0.0, 5.4, 20.0, 0.0])
    model = merit(straight, 5.4, around._replace(state=state), CONSTANTS)
    small = 1e-3
    for i, nudge in enumerate(small * np.eye(24)):
        two = [merit(straight + sign * nudge, 5.4, around._replace(state=state), CONSTANTS) for sign in (1, -1)]
        column = (gradient(two[0]) - gradient(two[1])) / (4 * small)
        assert model.curvature[i] == pytest.approx(column[i], rel=1e-3)


def test_merit_is_the_cost_where_nothing_is_near(around: Surroundings) -> None:
    around.boxes[0] = 1e5
    gentle = np.concatenate([np.full(12, 0.5), np.tile([0.02, -0.02], 6)])
    value = merit(gentle, 1.8, around, CONSTANTS).value
    np.testing.assert_allclose(value, evaluate(gentle[None], np.array([1.8]), around, CONSTANTS).cost[0], rtol=1e-12)


@pytest.mark.parametrize("inputs", INPUTS)
def test_merit_has_a_penalty_for_every_path(inputs: np.ndarray, around: Surroundings) -> None:
    low, high = input_bounds(inputs, STATE, CONSTANTS)
    within = np.clip(inputs, low, high)
    within[:] = 0.0  # no lag
    judged = evaluate(within[None], np.array([1.8]), around, CONSTANTS)
    excess = merit(within, 1.8, around, CONSTANTS).excess
    assert judged.slack.max() > 0
    assert np.isclose(excess, judged.slack.max(), atol=1e-9).any()
    twice = around._replace(boxes=np.repeat(around.boxes, 2, axis=2))
    more = merit(within, 1.8, twice, CONSTANTS).value - merit(within, 1.8, around, CONSTANTS).value
    assert more >= (CONSTANTS.slack * judged.slack[0] ** 2).sum() * (1 - 1e-9)


def test_bounds_of_the_yaw_rate_follow_the_speed() -> None:
    inputs = np.concatenate([np.full(12, -100.0), np.zeros(12)])
    low, high = input_bounds(inputs, STATE, CONSTANTS)
    np.testing.assert_array_equal(low[:12], -8.0)
    np.testing.assert_array_equal(high[:12], 3.0)
    speed = np.maximum(22 - 2.0 * np.arange(12), 1.0)
    np.testing.assert_allclose(high[12:], np.minimum(0.5, 4 / speed))
    np.testing.assert_array_equal(low[12:], -high[12:])
