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
from coverdrive.planning.merit import Model, Surroundings, add_square, input_bounds, merit, penalty

_FIRST_DAMPING = 0.1
_LEAST_DAMPING = 1e-4
_MOST_DAMPING = 1e3
_CREEP = 3.0
"""[m/s] below this speed, yaw rates are kept instead"""
_PATIENCE = 2
"""iterations for which motions that are not the cheapest are followed at least"""
_INNER = 20
"""Newton steps of a quadratic problem at the most"""
_INNER_TOLERANCE = 1e-3
"""a Newton step that promises to lower the quadratic problem by a smaller share is the last"""
_SHARES = 30
"""shares of a Newton step that are tried at the most where the whole does not gain"""
_SHARE_TOLERANCE = 1e-9
"""two shares that are nearer to each other are the same"""
_ROUNDING = 1e-12
"""[m/s²] or [rad/s] of an input"""
_GOOD = 0.75
"""share of the promised gain from which on the damping falls"""
_POOR = 0.25
"""share of the promised gain below which the damping rises"""


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
) -> tuple[Float[np.ndarray, " U"], float]:
    """The step that minimises the damped quadratic problem, and what it gains without the damping."""
    low, high = input_bounds(inputs, around.state, constants)
    low -= inputs
    high -= inputs
    damped = damping * np.diag(model.smooth)
    step = np.minimum(np.maximum(np.zeros(len(inputs)), low), high)
    excess = _excess(step, model)
    value = start = _value(step, excess, model, damped)
    for _ in range(_INNER):
        enough = _INNER_TOLERANCE * value
        direction, possible = _newton(step, excess, model, damped, low, high, enough * constants.least_curvature)
        if possible < enough:
            break
        trial = np.minimum(np.maximum(step + direction, low), high)
        ahead = _excess(trial, model)
        found = _value(trial, ahead, model, damped)
        if found > value:
            share = _share(step, excess, direction, model, damped, _room(step, direction, low, high))
            trial = np.minimum(np.maximum(step + share * direction, low), high)
            ahead = _excess(trial, model)
            found = _value(trial, ahead, model, damped)
        if found > value:
            break
        step, excess, value = trial, ahead, found
    return step, start - value + (damped * step**2).sum()


@compiled
def _excess(step: Float[np.ndarray, " U"], model: Model) -> Float[np.ndarray, " C"]:
    """The linear constraints at a step."""
    excess = model.excess.copy()
    for c in range(len(excess)):
        excess[c] += _dot(model.normal[c], step)
    return excess


@compiled
def _value(
    step: Float[np.ndarray, " U"], excess: Float[np.ndarray, " C"], model: Model, damped: Float[np.ndarray, " U"]
) -> float:
    """The damped quadratic problem at a step."""
    result = model.cost + penalty(excess, model.weight)
    for i in range(len(step)):
        row = 2 * _dot(model.smooth[i, :i], step[:i]) + (model.smooth[i, i] + damped[i]) * step[i]
        result += step[i] * (2 * model.slope[i] + row)
    return result


@compiled
def _share(
    step: Float[np.ndarray, " U"],
    excess: Float[np.ndarray, " C"],
    direction: Float[np.ndarray, " U"],
    model: Model,
    damped: Float[np.ndarray, " U"],
    most: float,
) -> float:
    """The share of a direction, up to a largest one, that lowers the damped quadratic problem most.

    Its slope along the direction is linear in pieces and rises: Newton's method, kept within bounds by bisection.
    """
    steady = rising = 0.0
    bent = _times(model.smooth, direction) + damped * direction
    for i in range(len(step)):
        steady += bent[i] * step[i] + direction[i] * model.slope[i]
        rising += bent[i] * direction[i]
    seen, start, towards, weight = 0, np.empty(len(excess)), np.empty(len(excess)), np.empty(len(excess))
    for c in range(len(excess)):
        start[seen], towards[seen], weight[seen] = excess[c], _dot(model.normal[c], direction), model.weight[c]
        if start[seen] > 0 or start[seen] + most * towards[seen] > 0:
            seen += 1
    low, high, share = 0.0, most, most
    for _ in range(_SHARES):
        slope, curvature = steady + share * rising, rising
        for c in range(seen):
            beyond = start[c] + share * towards[c]
            if beyond > 0:
                slope += weight[c] * beyond * towards[c]
                curvature += weight[c] * towards[c] ** 2
        if slope > 0:
            high = share
        else:
            low = share
        before, share = share, share - slope / curvature
        if not low < share < high:
            share = (low + high) / 2
        if abs(share - before) < _SHARE_TOLERANCE:
            break
    return share


@compiled
def _room(
    step: Float[np.ndarray, " U"],
    direction: Float[np.ndarray, " U"],
    low: Float[np.ndarray, " U"],
    high: Float[np.ndarray, " U"],
) -> float:
    """The largest share of a direction, up to 1, that keeps all bounds."""
    room = 1.0
    for i in range(len(step)):
        if step[i] + room * direction[i] < low[i]:
            room = (low[i] - step[i]) / direction[i]
        elif step[i] + room * direction[i] > high[i]:
            room = (high[i] - step[i]) / direction[i]
    return room


@compiled
def _newton(
    step: Float[np.ndarray, " U"],
    excess: Float[np.ndarray, " C"],
    model: Model,
    damped: Float[np.ndarray, " U"],
    low: Float[np.ndarray, " U"],
    high: Float[np.ndarray, " U"],
    flat: float,
) -> tuple[Float[np.ndarray, " U"], float]:
    """The Newton direction of the damped quadratic problem at a step, and its gain if nothing came in its way.

    Constraints count that are violated at the step; inputs stay that a bound holds. Where the square of the gradient
    is below ``flat``, the gain is called zero and no direction is computed.
    """
    size = len(step)
    gradient, held = model.slope + damped * step + _times(model.smooth, step), np.zeros(size, np.bool_)
    for c in range(len(excess)):
        if excess[c] > 0:
            gradient += (model.weight[c] * excess[c]) * model.normal[c]
    for i in range(size):
        held[i] = _at_bound(step[i], low[i], high[i], -gradient[i])
        if held[i]:
            gradient[i] = 0.0
    if _dot(gradient, gradient) < flat:
        return np.zeros(size), 0.0
    hessian = model.smooth.copy()
    for c in range(len(excess)):
        if excess[c] > 0:
            add_square(hessian, model.normal[c], model.weight[c])
    for i in range(size):
        hessian[i, i] += damped[i]
        if held[i]:
            _hold(hessian, gradient, i)
    while True:
        direction, stays = _solved(hessian.copy(), -gradient), True
        for i in range(size):
            if _at_bound(step[i], low[i], high[i], direction[i]):
                _hold(hessian, gradient, i)
                stays = False
        if stays:
            return direction, -_dot(gradient, direction)


@compiled
def _at_bound(value: float, low: float, high: float, direction: float) -> bool:
    """Whether an input is where a direction leads out of its bounds, rounding apart."""
    return (value <= low + _ROUNDING and direction < 0) or (value >= high - _ROUNDING and direction > 0)


@compiled
def _hold(hessian: Float[np.ndarray, "U U"], gradient: Float[np.ndarray, " U"], i: int) -> None:
    """Take an input out of the system."""
    hessian[i, :i], hessian[i + 1 :, i], hessian[i, i], gradient[i] = 0.0, 0.0, 1.0, 0.0


@compiled
def _solved(system: Float[np.ndarray, "U U"], right: Float[np.ndarray, " U"]) -> Float[np.ndarray, " U"]:
    """Solution of a symmetric positive definite system by Cholesky's decomposition; both arguments are overwritten.

    The system is made LᵀL, from the last row to the first, so that all inner loops run along rows.

    Args:
        system: on and below the diagonal.
        right: right-hand side.
    """
    size = len(right)
    for j in range(size - 1, -1, -1):
        inverse = 1 / np.sqrt(system[j, j])
        for i in range(j):
            system[j, i] *= inverse
        for i in range(j):
            factor = system[j, i]
            for k in range(i + 1):
                system[i, k] -= factor * system[j, k]
        right[j] *= inverse
        for i in range(j):
            right[i] -= right[j] * system[j, i]
        system[j, j] = inverse
    for i in range(size):
        right[i] = (right[i] - _dot(system[i, :i], right[:i])) * system[i, i]
    return right


@compiled
def _times(lower: Float[np.ndarray, "U U"], values: Float[np.ndarray, " U"]) -> Float[np.ndarray, " U"]:
    """A symmetric matrix, of which only the part on and below the diagonal counts, times a vector."""
    result = np.empty(len(values))
    for i in range(len(values)):
        result[i] = _dot(lower[i, : i + 1], values[: i + 1])
        for j in range(i):
            result[j] += lower[i, j] * values[i]
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
    iteration = 0
    while iteration < iterations and not done.all() and (iteration < _PATIENCE or not done[np.argmin(value + extra)]):
        for b in range(motions):
            if done[b]:
                continue
            change, promised = _step(at[b], models[b], damping[b], around, constants)
            trial = _projected(_moved(at[b], change, around, constants), around, constants)
            model = merit(trial, target[b], around, constants)
            gain = value[b] - model.value
            done[b] = abs(gain) < tolerance * value[b]
            if gain > 0:
                at[b], models[b], value[b] = trial, model, model.value
            if gain > _GOOD * promised:
                damping[b] = max(damping[b] / 10, _LEAST_DAMPING)
            elif not gain > _POOR * promised:
                damping[b] *= 5
                done[b] |= damping[b] > _MOST_DAMPING
        iteration += 1
    return Descent(at, value, done)
