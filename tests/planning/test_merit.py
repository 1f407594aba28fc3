"""Derivatives of the merit against automatic differentiation, and the merit against the cost of the plan."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from coverdrive.planning.condensed import course_of, derivatives
from coverdrive.planning.merit import (
    Surroundings,
    constraint_weights,
    input_bounds,
    input_form,
    merit,
    state_weights,
)
from coverdrive.planning.obstacles import ObstacleSettings
from coverdrive.planning.problem import ProblemSettings
from coverdrive.planning.search import judge
from coverdrive.planning.vehicle import rollout

STATE = np.array([0.0, 2.0, 22.0, 0.04])


def surroundings(speed: float = 15.0) -> Surroundings:
    rng = np.random.default_rng(3)
    boxes = np.empty((5, 12, 6))
    boxes[0], boxes[1] = rng.uniform(0, 70, (12, 6)), rng.uniform(0, 11, (12, 6))
    boxes[2], boxes[3], boxes[4] = rng.uniform(2, 4, (12, 6)), rng.uniform(1, 2, (12, 6)), speed
    return Surroundings(STATE, np.array([-0.5, 0.02]), np.array([0.0, 10.8]), boxes)


@pytest.fixture
def inputs() -> np.ndarray:
    rng = np.random.default_rng(1)
    return np.concatenate([rng.normal(0, 3, (3, 12)), rng.normal(0, 0.1, (3, 12))], axis=1)


def test_course_is_the_rollout(inputs: np.ndarray) -> None:
    with jax.enable_x64(True):
        course = course_of(jnp.asarray(STATE), jnp.asarray(inputs), 0.25)
        states = rollout(np.tile(STATE, (3, 1)), np.swapaxes(inputs.reshape(3, 2, 12), 1, 2), 0.25)[:, 1:]
        got = np.stack([course.lon, course.lat, course.speed, course.heading], axis=-1)
        np.testing.assert_allclose(got, states, atol=1e-12)


def test_derivatives_of_the_states(inputs: np.ndarray) -> None:
    def states(flat: jax.Array) -> jax.Array:
        course = course_of(jnp.asarray(STATE), flat[None], 0.25)
        return jnp.stack([course.lon, course.lat, course.speed, course.heading], -1)[0]

    with jax.enable_x64(True):
        got = derivatives(course_of(jnp.asarray(STATE), jnp.asarray(inputs), 0.25), 0.25)
        for i in range(3):
            np.testing.assert_allclose(got[i], jax.jacobian(states)(jnp.asarray(inputs[i])), atol=1e-10)


@pytest.mark.parametrize("order", [2, 4, 8])
def test_gradient_of_the_merit(inputs: np.ndarray, order) -> None:
    problem, around = ProblemSettings(obstacles=ObstacleSettings(order=order)), surroundings()
    target = np.array([1.8, 5.4, 9.0])
    with jax.enable_x64(True):
        expected = jax.grad(lambda each: merit(each, jnp.asarray(target), around, problem).value.sum())(
            jnp.asarray(inputs)
        )
        model = merit(jnp.asarray(inputs), jnp.asarray(target), around, problem)
        form, pull = input_form(problem)
        excess, normal = model.constraints
        pushed = constraint_weights(problem, 6) * jnp.maximum(0, excess)
        slope = state_weights(problem) * model.error + (normal * pushed[:, :, None]).sum(-1)
        got = 2 * (jnp.einsum("bks,bksu->bu", slope, model.rows) + inputs @ form - around.previous_input @ pull)
        assert (pushed > 0).any()
        np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-6)


def test_merit_is_the_cost_where_nothing_is_near() -> None:
    problem, around = ProblemSettings(), surroundings()
    around.boxes[0] = 1e5
    gentle = np.concatenate([np.full((1, 12), 0.5), np.tile([0.02, -0.02], (1, 6))], axis=1)
    with jax.enable_x64(True):
        target = jnp.array([1.8])
        value = merit(jnp.asarray(gentle), target, around, problem).value
        cost = judge(jnp.asarray(gentle), target, around, problem).cost
        np.testing.assert_allclose(value, cost, rtol=1e-12)


def test_worst_constraint_of_the_merit_is_the_slack(inputs: np.ndarray) -> None:
    problem, around = ProblemSettings(), surroundings()
    with jax.enable_x64(True):
        low, high = input_bounds(jnp.asarray(inputs), around, problem)
        within = jnp.clip(inputs, low, high)
        excess = merit(within, jnp.full(3, 1.8), around, problem).constraints.excess[..., :6].max(-1)
        judged = judge(within, jnp.full(3, 1.8), around, problem)
        inside = judged.slack > 0
        assert inside.any()
        np.testing.assert_allclose(np.asarray(excess)[inside], np.asarray(judged.slack)[inside], atol=1e-9)
