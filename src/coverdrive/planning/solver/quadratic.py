"""A step of the descent: the motion's merit, made quadratic in pieces, is minimised within the bounds of the inputs.

States and constraints are linear in the step, a violated constraint costs its square, and a damping keeps the step
small: a convex problem, quadratic where the same constraints are violated. It is solved by Newton steps in which the
active constraints and bounds are those of the step before (semi-smooth Newton; bounds as in Bertsekas, SIAM J. Control
Optim. 20, 1982), each shortened where the whole does not gain. C constraints in view, N nodes.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.compiled import compiled
from coverdrive.planning.check.merit import Constraints, Model, penalty, within
from coverdrive.planning.problem.constants import Constants
from coverdrive.planning.problem.rollout import add_pulled_back, changes_of, curvature_of
from coverdrive.planning.solver.riccati import Stages, minimiser

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

    step: Float[np.ndarray, "N 2"]
    """changes of the inputs"""
    states: Float[np.ndarray, "N 4"]
    """changes of the states"""
    excess: Float[np.ndarray, " C"]
    """the linear constraints"""
    value: float
    """of the damped quadratic problem"""


@compiled
def best_step(
    model: Model, damping: float, low: Float[np.ndarray, "N 2"], high: Float[np.ndarray, "N 2"], constants: Constants
) -> tuple[Float[np.ndarray, "N 2"], float]:
    """The step within bounds that minimises the damped quadratic problem, and what it gains without the damping."""
    damped = damping * curvature_of(model.rollout, constants.tree, constants.dt)
    nowhere = np.zeros_like(low)
    at = _at(_within(nowhere, 0.0, nowhere, low, high), model, damped, constants)
    start = at.value
    for _ in range(_INNER):
        enough = _INNER_TOLERANCE * at.value
        direction, possible = _newton(at, model, damped, low, high, enough * constants.tree.least_curvature, constants)
        if possible < enough:
            break
        ahead = _at(_within(at.step, 1.0, direction, low, high), model, damped, constants)
        if ahead.value > at.value:
            share = _share(at, direction, model, damped, _room(at.step, direction, low, high), constants)
            ahead = _at(_within(at.step, share, direction, low, high), model, damped, constants)
        if ahead.value > at.value:
            break
        at = ahead
    return at.step, start - at.value + (damped * at.step**2).sum()


@compiled
def _within(
    step: Float[np.ndarray, "N 2"], share: float, direction: Float[np.ndarray, "N 2"], low: Float[np.ndarray, "N 2"],
    high: Float[np.ndarray, "N 2"],
) -> Float[np.ndarray, "N 2"]:  # fmt: skip
    """A step and a share of a direction, within bounds."""
    result = np.empty_like(step)
    for n in range(len(step)):
        for i in range(2):
            result[n, i] = within(step[n, i] + share * direction[n, i], low[n, i], high[n, i])
    return result


@compiled
def _at(step: Float[np.ndarray, "N 2"], model: Model, damped: Float[np.ndarray, "N 2"], constants: Constants) -> _At:
    """What follows from a step."""
    states, seen = changes_of(model.rollout, step, constants.tree, constants.dt), model.constraints
    value = model.cost + 2 * _linear(step, states, model) + _product(step, states, step, states, damped, constants)
    excess = seen.excess.copy()
    for c in range(len(excess)):
        excess[c] += _along(seen, c, states)
        value += penalty(excess[c], seen.weight[c])
    return _At(step, states, excess, value)


@compiled
def _along(constraints: Constraints, c: int, states: Float[np.ndarray, "N 4"]) -> float:
    """Change of a constraint where the states change."""
    by, n = constraints.normal, constraints.node[c]
    position = by[c, 0] * states[n, 0] + by[c, 1] * states[n, 1]
    return position + (by[c, 2] * states[n, 2] + by[c, 3] * states[n, 3])


@compiled
def _linear(step: Float[np.ndarray, "N 2"], states: Float[np.ndarray, "N 4"], model: Model) -> float:
    """Half the change of the cost to first order."""
    of_inputs = of_states = 0.0
    for n in range(len(step)):
        for i in range(2):
            of_inputs += model.by_input[n, i] * step[n, i]
        for i in range(1, 4):
            of_states += model.by_state[n, i] * states[n, i]
    return of_inputs + of_states


@compiled
def _product(
    first: Float[np.ndarray, "N 2"],
    first_states: Float[np.ndarray, "N 4"],
    second: Float[np.ndarray, "N 2"],
    second_states: Float[np.ndarray, "N 4"],
    damped: Float[np.ndarray, "N 2"],
    constants: Constants,
) -> float:
    """Product of two steps with half the second derivatives of the cost and the damping."""
    tree, result = constants.tree, 0.0
    for n in range(len(first)):
        p = tree.parent[n]
        for i in range(3):
            result += tree.errors[n, i] * first_states[n, 1 + i] * second_states[n, 1 + i]
        for i in range(2):
            before, other_before = (first[p, i], second[p, i]) if p >= 0 else (0.0, 0.0)
            changes = (first[n, i] - before) * (second[n, i] - other_before)
            result += (tree.inputs[n, i] + damped[n, i]) * first[n, i] * second[n, i] + tree.changes[n, i] * changes
    return result


@compiled
def _share(
    at: _At,
    direction: Float[np.ndarray, "N 2"],
    model: Model,
    damped: Float[np.ndarray, "N 2"],
    most: float,
    constants: Constants,
) -> float:
    """The share of a direction, up to a largest one, that lowers the damped quadratic problem most.

    Its slope along the direction is linear in pieces and rises: Newton's method, kept within bounds by bisection.
    """
    states, excess = changes_of(model.rollout, direction, constants.tree, constants.dt), at.excess
    steady = _linear(direction, states, model) + _product(direction, states, at.step, at.states, damped, constants)
    rising = _product(direction, states, direction, states, damped, constants)
    seen, count = model.constraints, 0
    start, towards, weight = np.empty(len(excess)), np.empty(len(excess)), np.empty(len(excess))
    for c in range(len(excess)):
        start[count], towards[count], weight[count] = excess[c], _along(seen, c, states), seen.weight[c]
        if start[count] > 0 or start[count] + most * towards[count] > 0:
            count += 1
    low, high, share = 0.0, most, most
    for _ in range(_SHARES):
        slope, curvature = steady + share * rising, rising
        for c in range(count):
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
    step: Float[np.ndarray, "N 2"],
    direction: Float[np.ndarray, "N 2"],
    low: Float[np.ndarray, "N 2"],
    high: Float[np.ndarray, "N 2"],
) -> float:
    """The largest share of a direction, up to 1, that keeps all bounds."""
    room = 1.0
    for n in range(len(step)):
        for i in range(2):
            if step[n, i] + room * direction[n, i] < low[n, i]:
                room = (low[n, i] - step[n, i]) / direction[n, i]
            elif step[n, i] + room * direction[n, i] > high[n, i]:
                room = (high[n, i] - step[n, i]) / direction[n, i]
    return room


@compiled
def _newton(
    at: _At,
    model: Model,
    damped: Float[np.ndarray, "N 2"],
    low: Float[np.ndarray, "N 2"],
    high: Float[np.ndarray, "N 2"],
    flat: float,
    constants: Constants,
) -> tuple[Float[np.ndarray, "N 2"], float]:
    """The Newton direction of the damped quadratic problem at a step, and its gain if nothing came in its way.

    Constraints count that are violated at the step; inputs stay that a bound holds. Where the square of the gradient
    is below ``flat``, the gain is called zero and no direction is computed.
    """
    stages, tree = _stages(at, model, damped, constants), constants.tree
    downhill = stages.by_input.copy()
    add_pulled_back(model.rollout, stages.by_state, tree, constants.dt, downhill)
    downhill *= -1.0
    held = np.zeros(downhill.shape, np.bool_)
    _hold(held, at.step, low, high, downhill)
    square = 0.0
    for n in range(len(held)):
        for i in range(2):
            square += 0.0 if held[n, i] else downhill[n, i] ** 2
    if square < flat:
        return downhill, 0.0
    while True:
        direction = minimiser(stages, held, model.rollout, tree, constants.dt)
        if not _hold(held, at.step, low, high, direction):
            return direction, (downhill * direction).sum()


@compiled
def _hold(
    held: Bool[np.ndarray, "N 2"], step: Float[np.ndarray, "N 2"], low: Float[np.ndarray, "N 2"],
    high: Float[np.ndarray, "N 2"], direction: Float[np.ndarray, "N 2"],
) -> bool:  # fmt: skip
    """Hold the inputs that are where a direction leads out of their bounds, rounding apart; returns if any is new."""
    more = False
    for n in range(len(held)):
        for i in range(2):
            below = step[n, i] <= low[n, i] + _ROUNDING and direction[n, i] < 0
            beyond = step[n, i] >= high[n, i] - _ROUNDING and direction[n, i] > 0
            if (below or beyond) and not held[n, i]:
                held[n, i] = more = True
    return more


@compiled
def _stages(at: _At, model: Model, damped: Float[np.ndarray, "N 2"], constants: Constants) -> Stages:
    """The damped quadratic problem around a step, with the constraints that are violated there."""
    tree, nodes = constants.tree, len(at.step)
    by_state, by_states = model.by_state.copy(), np.zeros((nodes, 4, 4))
    by_input, by_inputs, seen = model.by_input.copy(), damped.copy(), model.constraints
    for n in range(nodes):
        p = tree.parent[n]
        for i in range(3):
            by_states[n, 1 + i, 1 + i] = tree.errors[n, i]
            by_state[n, 1 + i] += tree.errors[n, i] * at.states[n, 1 + i]
        for i in range(2):
            change = tree.changes[n, i] * (at.step[n, i] - (at.step[p, i] if p >= 0 else 0.0))
            by_inputs[n, i] += tree.inputs[n, i] + tree.changes[n, i]
            by_input[n, i] += (tree.inputs[n, i] + damped[n, i]) * at.step[n, i] + change
            if p >= 0:
                by_input[p, i] -= change
    for c in range(len(at.excess)):
        if at.excess[c] > 0:
            n, by, weight = seen.node[c], seen.normal, seen.weight[c]
            for i in range(4):
                by_state[n, i] += weight * at.excess[c] * by[c, i]
                for j in range(4):
                    by_states[n, i, j] += weight * by[c, i] * by[c, j]
    return Stages(by_state, by_states, by_input, by_inputs)
