"""A step of the descent: the motion's merit, made quadratic in pieces, is minimised within the bounds of the inputs.

States and constraints are linear in the step, a violated constraint costs its square, and a damping keeps the step
small: a convex problem, quadratic where the same constraints are violated. It is solved by Newton steps in which the
active constraints and bounds are those of the step before (semi-smooth Newton; bounds as in Bertsekas, SIAM J. Control
Optim. 20, 1982), each shortened where the whole does not gain. C constraints in view, U inputs.
"""

import numpy as np
from jaxtyping import Float

from coverdrive.planning.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.merit import Model, Surroundings, add_square, input_bounds, penalty
from coverdrive.planning.symmetric import inner, solved, times

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


@compiled
def best_step(
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
        excess[c] += inner(model.normal[c], step)
    return excess


@compiled
def _value(
    step: Float[np.ndarray, " U"], excess: Float[np.ndarray, " C"], model: Model, damped: Float[np.ndarray, " U"]
) -> float:
    """The damped quadratic problem at a step."""
    result = model.cost + penalty(excess, model.weight)
    for i in range(len(step)):
        row = 2 * inner(model.smooth[i, :i], step[:i]) + (model.smooth[i, i] + damped[i]) * step[i]
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
    bent = times(model.smooth, direction) + damped * direction
    for i in range(len(step)):
        steady += bent[i] * step[i] + direction[i] * model.slope[i]
        rising += bent[i] * direction[i]
    seen, start, towards, weight = 0, np.empty(len(excess)), np.empty(len(excess)), np.empty(len(excess))
    for c in range(len(excess)):
        start[seen], towards[seen], weight[seen] = excess[c], inner(model.normal[c], direction), model.weight[c]
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
    gradient, held = model.slope + damped * step + times(model.smooth, step), np.zeros(size, np.bool_)
    for c in range(len(excess)):
        if excess[c] > 0:
            gradient += (model.weight[c] * excess[c]) * model.normal[c]
    for i in range(size):
        held[i] = _at_bound(step[i], low[i], high[i], -gradient[i])
        if held[i]:
            gradient[i] = 0.0
    if inner(gradient, gradient) < flat:
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
        direction, stays = solved(hessian.copy(), -gradient), True
        for i in range(size):
            if _at_bound(step[i], low[i], high[i], direction[i]):
                _hold(hessian, gradient, i)
                stays = False
        if stays:
            return direction, -inner(gradient, direction)


@compiled
def _at_bound(value: float, low: float, high: float, direction: float) -> bool:
    """Whether an input is where a direction leads out of its bounds, rounding apart."""
    return (value <= low + _ROUNDING and direction < 0) or (value >= high - _ROUNDING and direction > 0)


@compiled
def _hold(hessian: Float[np.ndarray, "U U"], gradient: Float[np.ndarray, " U"], i: int) -> None:
    """Take an input out of the system."""
    hessian[i, :i], hessian[i + 1 :, i], hessian[i, i], gradient[i] = 0.0, 0.0, 1.0, 0.0
