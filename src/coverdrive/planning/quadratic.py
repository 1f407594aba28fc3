"""A step of the descent: the motion's merit, made quadratic in pieces, is minimised within the bounds of the inputs.

States and constraints are linear in the step, a violated constraint costs its square, and a damping keeps the step
small: a convex problem, quadratic where the same constraints are violated. It is solved by Newton steps in which the
active constraints and bounds are those of the step before (semi-smooth Newton; bounds as in Bertsekas, SIAM J. Control
Optim. 20, 1982), each shortened where the whole does not gain. C constraints in view, K steps, U = 2K inputs.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.course import add_pulled_back, changes_of
from coverdrive.planning.merit import Model, Surroundings, input_bounds, penalty
from coverdrive.planning.riccati import Stages, minimiser

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


class _At(NamedTuple):
    """A step, and what follows from it."""

    step: Float[np.ndarray, " U"]
    """changes of the inputs"""
    states: Float[np.ndarray, "K 4"]
    """changes of the states"""
    excess: Float[np.ndarray, " C"]
    """the linear constraints"""
    value: float
    """of the damped quadratic problem"""


@compiled
def best_step(
    inputs: Float[np.ndarray, " U"], model: Model, damping: float, around: Surroundings, constants: Constants
) -> tuple[Float[np.ndarray, " U"], float]:
    """The step that minimises the damped quadratic problem, and what it gains without the damping."""
    low, high = input_bounds(inputs, around.state, constants)
    low -= inputs
    high -= inputs
    damped = damping * model.curvature
    at = _at(np.minimum(np.maximum(np.zeros(len(inputs)), low), high), model, damped, constants)
    start = at.value
    for _ in range(_INNER):
        enough = _INNER_TOLERANCE * at.value
        direction, possible = _newton(at, model, damped, low, high, enough * constants.least_curvature, constants)
        if possible < enough:
            break
        ahead = _at(np.minimum(np.maximum(at.step + direction, low), high), model, damped, constants)
        if ahead.value > at.value:
            share = _share(at, direction, model, damped, _room(at.step, direction, low, high), constants)
            ahead = _at(np.minimum(np.maximum(at.step + share * direction, low), high), model, damped, constants)
        if ahead.value > at.value:
            break
        at = ahead
    return at.step, start - at.value + (damped * at.step**2).sum()


@compiled
def _at(step: Float[np.ndarray, " U"], model: Model, damped: Float[np.ndarray, " U"], constants: Constants) -> _At:
    """What follows from a step."""
    states, excess = changes_of(model.course, step, constants.dt), model.excess.copy()
    for c in range(len(excess)):
        excess[c] += _along(model, c, states)
    linear, square = _linear(step, states, model), _product(step, states, step, states, damped, constants)
    return _At(step, states, excess, model.cost + penalty(excess, model.weight) + 2 * linear + square)


@compiled
def _along(model: Model, c: int, states: Float[np.ndarray, "K 4"]) -> float:
    """Change of a constraint where the states change."""
    by, change = model.normal[c], states[model.step[c]]
    return (by[0] * change[0] + by[1] * change[1]) + (by[2] * change[2] + by[3] * change[3])


@compiled
def _linear(step: Float[np.ndarray, " U"], states: Float[np.ndarray, "K 4"], model: Model) -> float:
    """Half the change of the cost to first order."""
    steps, result = len(states), 0.0
    for k in range(steps):
        by = model.by_state[k]
        of_inputs = model.by_input[k] * step[k] + model.by_input[steps + k] * step[steps + k]
        result += of_inputs + (by[1] * states[k, 1] + by[2] * states[k, 2] + by[3] * states[k, 3])
    return result


@compiled
def _product(
    first: Float[np.ndarray, " U"],
    first_states: Float[np.ndarray, "K 4"],
    second: Float[np.ndarray, " U"],
    second_states: Float[np.ndarray, "K 4"],
    damped: Float[np.ndarray, " U"],
    constants: Constants,
) -> float:
    """Product of two steps with half the second derivatives of the cost and the damping."""
    cost, steps, result = constants.cost, constants.steps, 0.0
    for k in range(steps):
        one, other = first_states[k], second_states[k]
        of_states = cost.lane * one[1] * other[1] + cost.speed * one[2] * other[2] + cost.heading * one[3] * other[3]
        result += constants.weight[k] * of_states
        for i, own, of_change in (
            (k, cost.acceleration, cost.acceleration_change),
            (steps + k, cost.yaw_rate, cost.yaw_rate_change),
        ):
            before, other_before = (first[i - 1], second[i - 1]) if k > 0 else (0.0, 0.0)
            changes = (first[i] - before) * (second[i] - other_before)
            result += (own + damped[i]) * first[i] * second[i] + of_change * changes
    return result


@compiled
def _share(
    at: _At,
    direction: Float[np.ndarray, " U"],
    model: Model,
    damped: Float[np.ndarray, " U"],
    most: float,
    constants: Constants,
) -> float:
    """The share of a direction, up to a largest one, that lowers the damped quadratic problem most.

    Its slope along the direction is linear in pieces and rises: Newton's method, kept within bounds by bisection.
    """
    states, excess = changes_of(model.course, direction, constants.dt), at.excess
    steady = _linear(direction, states, model) + _product(direction, states, at.step, at.states, damped, constants)
    rising = _product(direction, states, direction, states, damped, constants)
    seen, start, towards, weight = 0, np.empty(len(excess)), np.empty(len(excess)), np.empty(len(excess))
    for c in range(len(excess)):
        start[seen], towards[seen], weight[seen] = excess[c], _along(model, c, states), model.weight[c]
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
    at: _At,
    model: Model,
    damped: Float[np.ndarray, " U"],
    low: Float[np.ndarray, " U"],
    high: Float[np.ndarray, " U"],
    flat: float,
    constants: Constants,
) -> tuple[Float[np.ndarray, " U"], float]:
    """The Newton direction of the damped quadratic problem at a step, and its gain if nothing came in its way.

    Constraints count that are violated at the step; inputs stay that a bound holds. Where the square of the gradient
    is below ``flat``, the gain is called zero and no direction is computed.
    """
    size, course = len(at.step), model.course
    stages = _stages(at, model, damped, constants)
    gradient, held = stages.by_input.copy(), np.zeros(size, np.bool_)
    add_pulled_back(course, stages.by_state, constants.dt, gradient)
    square = 0.0
    for i in range(size):
        held[i] = _at_bound(at.step[i], low[i], high[i], -gradient[i])
        square += 0.0 if held[i] else gradient[i] ** 2
    if square < flat:
        return np.zeros(size), 0.0
    while True:
        direction, stays = minimiser(stages, held, course, constants.dt), True
        for i in range(size):
            if not held[i] and _at_bound(at.step[i], low[i], high[i], direction[i]):
                held[i], stays = True, False
        if stays:
            return direction, -(gradient * direction).sum()


@compiled
def _stages(at: _At, model: Model, damped: Float[np.ndarray, " U"], constants: Constants) -> Stages:
    """The damped quadratic problem around a step, with the constraints that are violated there."""
    cost, steps = constants.cost, constants.steps
    by_state, by_states = model.by_state.copy(), np.zeros((steps, 4, 4))
    by_input, by_inputs = model.by_input.copy(), damped.copy()
    for k in range(steps):
        for i, weight in ((1, cost.lane), (2, cost.speed), (3, cost.heading)):
            by_states[k, i, i] = constants.weight[k] * weight
            by_state[k, i] += by_states[k, i, i] * at.states[k, i]
        for i, own, of_change in (
            (k, cost.acceleration, cost.acceleration_change),
            (steps + k, cost.yaw_rate, cost.yaw_rate_change),
        ):
            change = at.step[i] - (at.step[i - 1] if k > 0 else 0.0)
            by_inputs[i] += own + of_change
            by_input[i] += (own + damped[i]) * at.step[i] + of_change * change
            if k > 0:
                by_input[i - 1] -= of_change * change
    for c in range(len(at.excess)):
        if at.excess[c] > 0:
            k, by = model.step[c], model.normal[c]
            for i in range(4):
                by_state[k, i] += model.weight[c] * at.excess[c] * by[i]
                for j in range(4):
                    by_states[k, i, j] += model.weight[c] * by[i] * by[j]
    return Stages(by_state, by_states, by_input, by_inputs, (cost.acceleration_change, cost.yaw_rate_change))


@compiled
def _at_bound(value: float, low: float, high: float, direction: float) -> bool:
    """Whether an input is where a direction leads out of its bounds, rounding apart."""
    return (value <= low + _ROUNDING and direction < 0) or (value >= high - _ROUNDING and direction > 0)
