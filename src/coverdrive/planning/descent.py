"""Sequential quadratic programming on the penalised problem: damped Gauss–Newton steps that see constraints coming.

A step minimises the merit with states and constraints made linear, bounds of the inputs and a damping included: a
convex, piecewise quadratic problem, solved by Newton steps in which the active constraints and bounds are those of the
step before (semi-smooth Newton; bounds as in Bertsekas, SIAM J. Control Optim. 20, 1982; damping as in Marquardt,
J. SIAM 11, 1963). B motions descend together, each with a damping of its own.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.planning.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.merit import Model, Surroundings, add_square, input_bounds, merit

_FIRST_DAMPING = 0.1
_LEAST_DAMPING = 1e-4
_MOST_DAMPING = 1e3
_CREEP = 3.0
"""[m/s] below this speed, yaw rates are kept instead"""
_PATIENCE = 3
"""iterations for which motions that are not the cheapest are followed at least"""
_INNER = 5
"""Newton steps of a quadratic problem at the most"""


class Descent(NamedTuple):
    """Where the motions are on their way down."""

    inputs: Float[np.ndarray, "B U"]
    value: Float[np.ndarray, " B"]
    """of the merit"""
    done: Bool[np.ndarray, " B"]
    """whether the last step gained next to nothing, or none gains anything"""


@compiled
def _projected(wanted: Float[np.ndarray, " U"], around: Surroundings, constants: Constants) -> Float[np.ndarray, " U"]:
    """The wanted inputs within their bounds."""
    low, high = input_bounds(wanted, around.state, constants)
    return np.minimum(np.maximum(wanted, low), high)


@compiled
def _moved(
    inputs: Float[np.ndarray, " U"], change: Float[np.ndarray, " U"], around: Surroundings, constants: Constants
) -> Float[np.ndarray, " U"]:
    """Inputs after a step. Where the step changes the speed, the lateral acceleration keeps to the linear model.

    To first order this is the sum; a motion across the road then does not grow with its speed.
    """
    steps, dt = constants.steps, constants.dt
    moved = inputs + change
    before = after = around.state[2]
    for k in range(steps):
        moved[steps + k] = inputs[steps + k] + max(before, _CREEP) / max(after, _CREEP) * change[steps + k]
        before += dt * inputs[k]
        after += dt * moved[k]
    return moved


@compiled
def _step(
    inputs: Float[np.ndarray, " U"], model: Model, damping: float, around: Surroundings, constants: Constants
) -> Float[np.ndarray, " U"]:
    """The step that minimises the damped quadratic problem."""
    size = len(inputs)
    low, high = input_bounds(inputs, around.state, constants)
    low -= inputs
    high -= inputs
    damped = np.empty(size)
    for i in range(size):
        damped[i] = damping * model.smooth[i, i]
    step, held, active = np.zeros(size), np.zeros(size, np.bool_), model.excess > 0
    for _ in range(_INNER):
        hessian, gradient = model.smooth.copy(), model.slope.copy()
        for c in range(len(active)):
            if active[c]:
                add_square(hessian, model.normal[c], model.weight[c])
                gradient += (model.weight[c] * model.excess[c]) * model.normal[c]
        newton = _solved(hessian, gradient, damped, np.where(held, step, 0.0), held)
        step = np.minimum(np.maximum(newton, low), high)
        changed = False
        for i in range(size):
            holds = False
            if step[i] <= low[i] or step[i] >= high[i]:
                uphill = gradient[i] + damped[i] * step[i] + _row_times(hessian, i, step)
                holds = uphill > 0 if step[i] <= low[i] else uphill < 0
            changed |= holds != held[i]
            held[i] = holds
        for c in range(len(active)):
            violated = model.excess[c] + _dot(model.normal[c], step) > 0
            changed |= violated != active[c]
            active[c] = violated
        if not changed:
            break
    return step


@compiled
def _solved(
    hessian: Float[np.ndarray, "U U"],
    gradient: Float[np.ndarray, " U"],
    damped: Float[np.ndarray, " U"],
    held: Float[np.ndarray, " U"],
    is_held: Bool[np.ndarray, " U"],
) -> Float[np.ndarray, " U"]:
    """The Newton step in which some inputs are held where they are, by Cholesky's decomposition.

    Args:
        hessian: on and below the diagonal.
        gradient: of the quadratic problem at a step of 0.
        damped: added to the diagonal.
        held: the step of the inputs that are held, 0 for the others.
        is_held: which ones.
    """
    size = len(gradient)
    factor, right = np.empty((size, size)), np.empty(size)
    for i in range(size):
        right[i] = held[i] if is_held[i] else -gradient[i] - _row_times(hessian, i, held)
        for j in range(i):
            factor[i, j] = 0.0 if is_held[i] or is_held[j] else hessian[i, j]
        factor[i, i] = 1.0 if is_held[i] else hessian[i, i] + damped[i]
    for i in range(size):
        for j in range(i + 1):
            rest = factor[i, j] - _dot(factor[i, :j], factor[j, :j])
            factor[i, j] = rest / factor[j, j] if j < i else np.sqrt(rest)
        right[i] = (right[i] - _dot(factor[i, :i], right[:i])) / factor[i, i]
    for i in range(size - 1, -1, -1):
        right[i] /= factor[i, i]
        right[:i] -= right[i] * factor[i, :i]
    return right


@compiled
def _row_times(lower: Float[np.ndarray, "U U"], row: int, values: Float[np.ndarray, " U"]) -> float:
    """A row of a symmetric matrix of which only the part on and below the diagonal counts, times a vector."""
    result = _dot(lower[row, : row + 1], values[: row + 1])
    for j in range(row + 1, len(values)):
        result += lower[j, row] * values[j]
    return result


@compiled
def _dot(first: Float[np.ndarray, " n"], second: Float[np.ndarray, " n"]) -> float:
    result = 0.0
    for i in range(len(first)):
        result += first[i] * second[i]
    return result


@compiled
def descend(
    inputs: Float[np.ndarray, "B U"],
    target: Float[np.ndarray, " B"],
    extra: Float[np.ndarray, " B"],
    around: Surroundings,
    constants: Constants,
    iterations: int,
    tolerance: float,
) -> Descent:
    """Improve motions step by step.

    Args:
        inputs: of the motions to start from.
        target: [m] lat of the centre of each motion's target lane.
        extra: cost of choosing each motion, on top of its merit.
        around: what the plan is made for.
        constants: of the problem.
        iterations: number of steps at the most.
        tolerance: a step that lowers the merit by a smaller share is the last.
    """
    motions = len(inputs)
    at = np.empty_like(inputs)
    for b in range(motions):
        at[b] = _projected(inputs[b], around, constants)
    models = [merit(at[b], target[b], around, constants) for b in range(motions)]
    value = np.array([model.value for model in models])
    damping, done = np.full(motions, _FIRST_DAMPING), np.zeros(motions, np.bool_)
    gained, iteration = np.ones(motions, np.bool_), 0
    while iteration < iterations and not done.all() and (iteration < _PATIENCE or not done[np.argmin(value + extra)]):
        for b in range(motions):
            if done[b]:
                continue
            change = _step(at[b], models[b], damping[b], around, constants)
            trial = _projected(_moved(at[b], change, around, constants), around, constants)
            model = merit(trial, target[b], around, constants)
            gain = value[b] - model.value
            done[b] = abs(gain) < tolerance * value[b]
            if gain > 0:
                if gained[b]:
                    damping[b] = max(damping[b] / 10, _LEAST_DAMPING)
                at[b], models[b], value[b] = trial, model, model.value
            else:
                damping[b] *= 10
                done[b] |= damping[b] > _MOST_DAMPING
            gained[b] = gain > 0
        iteration += 1
    return Descent(at, value, done)
