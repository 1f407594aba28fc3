"""What the search makes small: the cost of a plan with every constraint as a penalty, as a sum of squares.

The slack γ_k of the paper's problem is penalised by c_k·γ_k² and appears nowhere else, so it can be put in: what is
left is a least-squares problem in the inputs. Differences from the paper's cost: every path has a slack of its own (the
paper takes the largest of each step), at every part of a step in which it is passed; and the limits of speed and
heading, which whoever drives the inputs keeps exactly, are penalties. N nodes, n boxes, C constraints in view.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from coverdrive.compiled import compiled
from coverdrive.planning.check.contact import MOST_PARTS, box_between, box_excess, box_of, parts_of, smooth_half_sizes
from coverdrive.planning.problem.constants import Constants
from coverdrive.planning.problem.cost import OFF_ROAD
from coverdrive.planning.problem.obstacles import LIKELIHOOD
from coverdrive.planning.problem.rollout import Rollout, after_step, rolled, state_at, write
from coverdrive.planning.problem.vehicle import accelerations, yaw_rates
from coverdrive.planning.surroundings import Surroundings
from coverdrive.road_ahead import FASTEST, LEFT, RIGHT, STRAIGHT, State, bend_at, value_at

_SPEED = 1e4
"""[s²/m²] penalty beyond the limits"""
_HEADING = 1e6
"""[1/rad²] penalty beyond the limits"""
_SIDEWAYS = 1e3
"""[s²/m²] penalty beyond the speed across the road that is wished for: as much as of being in a wished box"""
_IN_VIEW = 1.0
"""constraints that are further from being active than this are not seen by a step"""
_HEADING_IN_VIEW = 0.2
"""[rad] the same of the limits of the heading"""
_LIMITS = 9
"""constraints of every node besides the boxes"""


class Constraints(NamedTuple):
    """C constraints, linear in the changes of the states."""

    excess: Float[np.ndarray, " C"]
    """what must not be positive: boxes, road edges, limits of speed and heading"""
    normal: Float[np.ndarray, "C 4"]
    """derivatives of the excesses with respect to the state of their node"""
    node: Int[np.ndarray, " C"]
    weight: Float[np.ndarray, " C"]
    """of the squares of positive excesses"""


class Model(NamedTuple):
    """Merit of a plan, and what it is made of, linear in the changes of states and inputs."""

    value: float
    shares: Float[np.ndarray, " N"]
    """of every node in it"""
    cost: float
    """the merit without the constraints"""
    rollout: Rollout
    """the states, and how they change with the inputs"""
    by_state: Float[np.ndarray, "N 4"]
    """half the first derivatives of the cost with respect to the states"""
    by_input: Float[np.ndarray, "N 2"]
    """half the first derivatives of the cost with respect to the inputs, the states apart"""
    constraints: Constraints
    """those in view"""


@compiled
def merit(
    inputs: Float[np.ndarray, "N 2"], targets: Float[np.ndarray, " 2"], around: Surroundings, constants: Constants
) -> Model:
    """The merit of a plan.

    Args:
        inputs: of its nodes.
        targets: [m] lat of the centre of the target lane of the drive branch (0) and of the fail-safe branch (1).
        around: what the plan is made for.
        constants: of the problem.
    """
    return merit_of(rolled(around.state, inputs, constants.tree, constants.dt), inputs, targets, around, constants)


@compiled
def merit_of(
    rollout: Rollout, inputs: Float[np.ndarray, "N 2"], targets: Float[np.ndarray, " 2"], around: Surroundings,
    constants: Constants,
) -> Model:  # fmt: skip
    """The merit of a plan whose states are known."""
    shares, by_state, by_input = _smooth(inputs, rollout, targets, around, constants)
    seen, cost = _constraints(rollout, around, constants), shares.sum()
    for c in range(len(seen.excess)):
        shares[seen.node[c]] += penalty(seen.excess[c], seen.weight[c])
    return Model(shares.sum(), shares, cost, rollout, by_state, by_input, seen)


@compiled
def penalty(excess: float, weight: float) -> float:
    """What a constraint adds to the merit."""
    return weight * excess**2 if excess > 0 else 0.0


@compiled
def within(value: float, low: float, high: float) -> float:
    """A value within bounds."""
    return np.minimum(np.maximum(value, low), high)


@compiled
def _smooth(
    inputs: Float[np.ndarray, "N 2"], rollout: Rollout, targets: Float[np.ndarray, " 2"], around: Surroundings,
    constants: Constants,
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, "N 4"], Float[np.ndarray, "N 2"]]:  # fmt: skip
    """Costs of the nodes without constraints, and half their derivatives with respect to states and inputs."""
    tree, value = constants.tree, np.zeros(len(inputs))
    by_state, by_input = np.zeros((len(inputs), 4)), np.zeros((len(inputs), 2))
    for n in range(len(inputs)):
        p, target, wanted = tree.parent[n], targets[int(tree.safe[n])], around.wanted[tree.moment[n]]
        error = (rollout.states[n, 1] - target, rollout.states[n, 2] - wanted, rollout.states[n, 3])
        for i in range(3):
            by_state[n, 1 + i] = tree.errors[n, i] * error[i]
            value[n] += by_state[n, 1 + i] * error[i]
        for i in range(2):
            change = inputs[n, i] - (inputs[p, i] if p >= 0 else around.previous_input[i])
            by_input[n, i] += tree.inputs[n, i] * inputs[n, i] + tree.changes[n, i] * change
            if p >= 0:
                by_input[p, i] -= tree.changes[n, i] * change
            value[n] += tree.inputs[n, i] * inputs[n, i] ** 2 + tree.changes[n, i] * change**2
    return value, by_state, by_input


@compiled
def _constraints(rollout: Rollout, around: Surroundings, constants: Constants) -> Constraints:
    """The constraints in view, of which there is room for more at first."""
    nodes, most_boxes = len(rollout.states), max(around.boxes.shape[2], around.likely.shape[2])
    most = nodes * (MOST_PARTS * most_boxes + _LIMITS)
    seen, count = Constraints(np.empty(most), np.empty((most, 4)), np.empty(most, np.int64), np.empty(most)), 0
    for n in range(nodes):
        count = _limits(n, state_at(rollout.states, n, around.state), around, constants, seen, count)
        boxes = around.boxes if constants.tree.careful[n] else around.likely
        count = _boxes(n, rollout, boxes, constants, seen, count)
    return Constraints(seen.excess[:count], seen.normal[:count], seen.node[:count], seen.weight[:count])


@compiled
def _append(
    seen: Constraints, count: int, node: int, excess: float, normal: tuple[float, float, float, float], weight: float
) -> int:
    """Append a constraint; returns the number of constraints."""
    seen.excess[count], seen.node[count], seen.weight[count] = excess, node, weight
    write(seen.normal[count], normal)
    return count + 1


@compiled
def _limits(n: int, state: State, around: Surroundings, constants: Constants, seen: Constraints, count: int) -> int:
    """Append the limits of speed and heading and the road's; returns the number of constraints."""
    vehicle = constants.vehicle
    fastest, slowest = max(vehicle.max_speed, around.state[2]), min(0.0, around.state[2])
    widest = max(vehicle.max_heading, abs(around.state[3]))
    _, (half_width, widening) = smooth_half_sizes(state[3], vehicle)
    half_width += constants.shape.edge_margin
    right, right_change = value_at(state[0], RIGHT, around.road)
    left, left_change = value_at(state[0], LEFT, around.road)
    held, held_change = value_at(state[0], FASTEST, around.road)
    for value, by, weight, view in (
        (state[2] - fastest, (0.0, 0.0, 1.0, 0.0), _SPEED, _IN_VIEW),
        (slowest - state[2], (0.0, 0.0, -1.0, 0.0), _SPEED, _IN_VIEW),
        (state[3] - widest, (0.0, 0.0, 0.0, 1.0), _HEADING, _HEADING_IN_VIEW),
        (-widest - state[3], (0.0, 0.0, 0.0, -1.0), _HEADING, _HEADING_IN_VIEW),
        (state[2] - held, (-held_change, 0.0, 1.0, 0.0), _SPEED, _IN_VIEW),
        (state[1] + half_width - left, (-left_change, 1.0, 0.0, widening), OFF_ROAD, _IN_VIEW),
        (right - state[1] + half_width, (right_change, -1.0, 0.0, widening), OFF_ROAD, _IN_VIEW),
    ):
        if value > -view:
            count = _append(seen, count, n, value, by, weight)
    if not constants.tree.safe[n]:
        for side in (1.0, -1.0):
            value, by = side * state[2] * state[3] - around.sideways, (0.0, 0.0, side * state[3], side * state[2])
            if value > -_IN_VIEW:
                count = _append(seen, count, n, value, by, _SIDEWAYS)
    return count


@compiled
def _boxes(
    n: int, rollout: Rollout, boxes: Float[np.ndarray, "7 P n"], constants: Constants, seen: Constraints, count: int
) -> int:
    """Append the boxes at the end of a node's step, and where they are passed in the step after, for which the car is
    taken to go straight on; returns the number of constraints. Along the drive branch each has its share of the weight.
    """
    moment, state = constants.tree.moment[n], state_at(rollout.states, n, rollout.states[n])
    own = smooth_half_sizes(state[3], constants.vehicle)
    along, across = 2 * rollout.way[n, 0, 0], 2 * rollout.way[n, 1, 0]
    way = state[2] * along, state[2] * across
    for slot in range(boxes.shape[2]):
        weight = constants.tree.slack[n] * (1.0 if constants.tree.careful[n] else boxes[LIKELIHOOD, moment, slot])
        value, by = box_excess(state, own, box_of(boxes, moment, slot), _IN_VIEW, constants)
        if value > -_IN_VIEW:
            count = _append(seen, count, n, value, by, weight)
        if moment == constants.steps:
            continue
        parts = parts_of(way, (own[0][0], own[1][0]), boxes, moment, slot)
        for part in range(1, parts):
            share = part / parts
            there = (state[0] + share * way[0], state[1] + share * way[1], state[2], state[3])
            value, by = box_excess(there, own, box_between(boxes, moment, slot, share), _IN_VIEW, constants)
            if value > -_IN_VIEW:
                by_speed = by[2] + share * (by[0] * along + by[1] * across)
                by_heading = by[3] + share * (by[1] * way[0] - by[0] * way[1])
                count = _append(seen, count, n, value, (by[0], by[1], by_speed, by_heading), weight)
    return count


@compiled
def input_at(inputs: Float[np.ndarray, "N 2"], node: int, previous: Float[np.ndarray, " 2"]) -> tuple[float, float]:
    """The inputs of a node's step; those of node −1 are the previous ones."""
    return (inputs[node, 0], inputs[node, 1]) if node >= 0 else (previous[0], previous[1])


@compiled
def input_bounds(
    inputs: Float[np.ndarray, "N 2"], around: Surroundings, constants: Constants
) -> tuple[Float[np.ndarray, "N 2"], Float[np.ndarray, "N 2"]]:
    """Least and largest inputs: those of the first step from the jerk, too, and those of the yaw rate from the plan's
    speed and the step before, both within their bounds.
    """
    vehicle, tree, applied = constants.vehicle, constants.tree, np.empty_like(inputs)
    low, high, speed = np.empty_like(inputs), np.empty_like(inputs), np.empty(len(inputs))
    straight, states = len(around.road.rows) == 1, np.empty((len(inputs), 4))
    for n in range(len(inputs)):
        p = tree.parent[n]
        now, bend = float(speed[p] if p >= 0 else around.state[2]), STRAIGHT
        if not straight:
            bend = bend_at(state_at(states, p, around.state), constants.dt, around.road)
        before, elapsed = input_at(applied, p, around.previous_input), constants.dt if p >= 0 else constants.period
        for i in range(2):
            if i == 0:
                low[n, i], high[n, i] = accelerations(now, bend, vehicle)
            else:
                low[n, i], high[n, i] = yaw_rates(now, applied[n, 0], before, elapsed, bend, vehicle)
            if p < 0:
                most = vehicle.max_jerk * elapsed / (1.0 if i == 0 else max(now, 1.0))
                low[n, i] = min(max(low[n, i], before[i] - most), high[n, i])
                high[n, i] = max(min(high[n, i], before[i] + most), low[n, i])
            applied[n, i] = min(max(inputs[n, i], low[n, i]), high[n, i])
        speed[n] = now + constants.dt * applied[n, 0]
        if not straight:
            origin = state_at(states, p, around.state)
            write(states[n], after_step(origin, (applied[n, 0], applied[n, 1]), constants.dt))
    return low, high
