"""Sequential quadratic programming on the penalised problem: damped Gauss–Newton steps that see constraints coming.

A step minimises the merit with states and constraints made linear, bounds of the inputs and a damping included: a
convex, piecewise quadratic problem, solved by Newton steps in which the active constraints and bounds are those of the
step before (semi-smooth Newton; bounds as in Bertsekas, SIAM J. Control Optim. 20, 1982; damping as in Marquardt,
J. SIAM 11, 1963). All B motions descend at once, each with a damping of its own.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int

from coverdrive.planning.merit import (
    Model,
    Surroundings,
    constraint_weights,
    input_bounds,
    input_form,
    merit,
    state_weights,
)
from coverdrive.planning.problem import ProblemSettings

_FIRST_DAMPING = 0.1
_LEAST_DAMPING = 1e-4
_MOST_DAMPING = 1e3
_CREEP = 3.0
"""[m/s] below this speed, yaw rates are kept instead"""
_PATIENCE = 3
"""iterations for which motions that are not the cheapest are followed at least"""
_INNER = 5
"""Newton steps of a quadratic problem at the most"""
_IN_VIEW = 1.0
"""constraints that are further from being active than this are not seen by a step"""


class Descent(NamedTuple):
    """Where the motions are on their way down."""

    inputs: Float[Array, "B U"]
    model: Model
    """of the merit at the inputs"""
    damping: Float[Array, " B"]
    """of the next step"""
    gained: Bool[Array, " B"]
    """whether the last step was taken"""
    done: Bool[Array, " B"]
    """whether the last step gained next to nothing, or none gains anything"""
    iterations: Int[Array, ""]


def descend(
    inputs: Float[Array, "B U"],
    target: Float[Array, " B"],
    extra: Float[Array, " B"],
    around: Surroundings,
    problem: ProblemSettings,
    iterations: Int[Array | np.ndarray, ""],
    tolerance: float,
) -> Descent:
    """Descend until all motions are done, the cheapest is and the others had a fair chance, or iterations are used up.

    Args:
        inputs: to start from.
        target: [m] lat of the centre of each motion's target lane.
        extra: cost of choosing each motion, on top of its merit.
        around: what the plan is made for.
        problem: horizon, car and weights.
        iterations: number of steps at the most.
        tolerance: a step that lowers the merit by a smaller share is the last.
    """

    def project(wanted: Array) -> Array:
        return jnp.clip(wanted, *input_bounds(wanted, around, problem))

    def step(at: Descent) -> Descent:
        trial = project(_moved(at.inputs, _step(at, around, problem), around, problem))
        model = merit(trial, target, around, problem)
        gain = at.model.value - model.value
        better = (gain > 0) & ~at.done
        less = jnp.where(at.gained, jnp.maximum(at.damping / 10, _LEAST_DAMPING), at.damping)
        damping = jnp.where(better, less, at.damping * 10)
        small = jnp.abs(gain) < tolerance * at.model.value
        kept = jax.tree.map(lambda new, old: _choose(better, new, old), model, at.model)
        done = at.done | small | (damping > _MOST_DAMPING)
        return Descent(_choose(better, trial, at.inputs), kept, damping, better, done, at.iterations + 1)

    def unfinished(at: Descent) -> Array:
        best = jnp.argmin(at.model.value + extra)
        others = (at.iterations < iterations) & ~at.done.all()
        return others & ((at.iterations < _PATIENCE) | ~at.done[best])

    start = project(inputs)
    damping, no = jnp.full(len(inputs), _FIRST_DAMPING), jnp.zeros(len(inputs), bool)
    first = Descent(start, merit(start, target, around, problem), damping, ~no, no, jnp.array(0))
    return jax.lax.while_loop(unfinished, step, first)


def _choose(condition: Bool[Array, " B"], new: Array, old: Array) -> Array:
    return jnp.where(condition.reshape(-1, *(1,) * (new.ndim - 1)), new, old)


def _moved(
    inputs: Float[Array, "B U"], change: Float[Array, "B U"], around: Surroundings, problem: ProblemSettings
) -> Float[Array, "B U"]:
    """Inputs after a step. Where the step changes the speed, the lateral acceleration keeps to the linear model.

    To first order this is the sum; a motion across the road then does not grow with its speed.
    """
    steps = problem.steps
    acceleration = inputs[:, :steps] + change[:, :steps]

    def speed_before(each: Array) -> Array:
        return jnp.maximum(around.state[2] + problem.dt * (jnp.cumsum(each, -1) - each), _CREEP)

    ratio = speed_before(inputs[:, :steps]) / speed_before(acceleration)
    return jnp.concatenate([acceleration, inputs[:, steps:] + ratio * change[:, steps:]], -1)


class _Newton(NamedTuple):
    """Where the solution of the quadratic problem is."""

    step: Float[Array, "B U"]
    active: Bool[Array, "B K C"]
    """constraints that are violated at the step"""
    held: Bool[Array, "B U"]
    """inputs that a bound holds"""
    changed: Bool[Array, ""]
    steps: Int[Array, ""]


def _step(at: Descent, around: Surroundings, problem: ProblemSettings) -> Float[Array, "B U"]:
    """The step that minimises the damped quadratic problem."""
    motions, size = at.inputs.shape
    model, (excess, normal) = at.model, at.model.constraints
    form, pull = input_form(problem)
    low, high = (bound - at.inputs for bound in input_bounds(at.inputs, around, problem))
    weights = jnp.where(excess > -_IN_VIEW, constraint_weights(problem, around.boxes.shape[2]), 0.0)
    curvature = np.eye(4) * state_weights(problem)[:, None]
    slope = state_weights(problem) * model.error
    flat = model.rows.reshape(motions, -1, size)
    input_slope = at.inputs @ form - around.previous_input @ pull
    scale = jnp.diagonal(form) + (curvature.diagonal(axis1=1, axis2=2)[..., None] * model.rows**2).sum((1, 2))
    damping = at.damping[:, None] * scale

    def newton(now: _Newton) -> _Newton:
        used = jnp.where(now.active, weights, 0.0)[:, :, None] * normal
        bent = curvature + used @ jnp.swapaxes(normal, 2, 3)
        pushed = slope + (used @ excess[..., None])[..., 0]
        hessian = jnp.swapaxes(flat, 1, 2) @ (bent @ model.rows).reshape(flat.shape) + form
        gradient = jnp.einsum("bm,bmi->bi", pushed.reshape(motions, -1), flat) + input_slope
        free = jnp.where(now.held, 0.0, 1.0)
        moved = jnp.where(now.held, now.step, 0.0)
        right = -(gradient + (hessian @ moved[..., None])[..., 0]) * free + moved
        system = hessian * (free[:, :, None] * free[:, None, :])
        system += jnp.where(now.held, 1.0, damping)[:, None, :] * jnp.eye(size)
        solved = _solve(system, right)
        clipped = jnp.clip(solved, low, high)
        pull_back = gradient + (hessian @ clipped[..., None])[..., 0] + damping * clipped
        held = ((clipped <= low) & (pull_back > 0)) | ((clipped >= high) & (pull_back < 0))
        shift = (flat @ clipped[..., None]).reshape(motions, -1, 4)
        active = excess + (shift[:, :, None] @ normal)[:, :, 0] > 0
        relevant = (active != now.active) & (weights > 0)
        changed = relevant.any() | (held != now.held).any()
        return _Newton(clipped, active, held, changed, now.steps + 1)

    nothing = jnp.zeros_like(at.inputs)
    start = _Newton(nothing, excess > 0, jnp.zeros(nothing.shape, bool), jnp.array(True), jnp.array(0))
    return jax.lax.while_loop(lambda now: now.changed & (now.steps < _INNER), newton, start).step


def _solve(system: Float[Array, "B U U"], right: Float[Array, "B U"]) -> Float[Array, "B U"]:
    """Solution of symmetric positive definite systems."""
    factor = jax.lax.linalg.cholesky(system)
    half = jax.lax.linalg.triangular_solve(factor, right[..., None], left_side=True, lower=True)
    return jax.lax.linalg.triangular_solve(factor, half, left_side=True, lower=True, transpose_a=True)[..., 0]
