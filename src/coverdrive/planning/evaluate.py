"""What motions are worth: inputs driven within the limits of the car, and all that follows; compiled.

Whatever proposes a motion (a rule, the last plan, a solver) proposes inputs; the states follow from the vehicle model,
and everything else from the states. Nothing here trusts what a search says about its result. A motion is *clear* if
its body touches no box at any time, by whatever steps it is driven (`coverdrive.planning.sweep`), could brake behind
whoever is ahead at its end, and keeps to the road. m motions, K steps, U = 2K inputs, P = K + 1 states.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.contact import box_between, box_excess, box_of, half_sizes_of, parts_of
from coverdrive.planning.merit import Surroundings, cost_of_input, cost_of_state
from coverdrive.planning.problem import Situation
from coverdrive.planning.sweep import (
    NEVER,
    SPARE,
    State,
    contact_at,
    impact,
    impact_beyond,
    write_edges,
    write_exact_edges,
)
from coverdrive.planning.vehicle import euler_step, within_limits

_HARMFUL = 20.0
"""[m/s] closing speed at which a contact counts twice as much as at rest"""
_ANY_CONTACT = 5.0
"""[m/s] that a contact counts as at no relative speed"""
_UNCERTAIN = 0.4
"""by how much less a contact at the end of the plan counts than one now"""
_ON_THE_ROAD = 1e-9
"""[m] by which a body may be beyond the edge of the road"""
_step = compiled(euler_step)
_within_limits = compiled(within_limits)


class Evaluated(NamedTuple):
    """Motions within the limits of the car."""

    states: Float[np.ndarray, "m P 4"]
    """lon [m], lat [m], speed [m/s], heading [rad]"""
    inputs: Float[np.ndarray, "m U"]
    """accelerations [m/s²] and then yaw rates [rad/s]"""
    slack: Float[np.ndarray, "m K"]
    """smallest γ_k with which the obstacle constraints of the steps k = 1 … K hold, margin included, and those between
    one step and the next"""
    off_road: Float[np.ndarray, "m K"]
    """[m] by which the body gets beyond the margin of the road edges at the steps k = 1 … K"""
    cost: Float[np.ndarray, " m"]
    """value of the objective"""
    lasting_cost: Float[np.ndarray, " m"]
    """the objective with every slack, times `harm_of`, held until the end, because a contact cannot be undone; motions
    are compared by it, so that passing through a vehicle does not look better than stopping at it"""
    severity: Float[np.ndarray, " m"]
    """[m/s] relative speed at the first contact with a box, of the worst box, for a car that goes on exactly; 0 without
    contact"""
    harm: Float[np.ndarray, " m"]
    """[m/s] expected of all first contacts with boxes: each counts its relative speed, and what any contact counts,
    times its likelihood, and the less the later it is, since the later is the less certain; of a car that is a little
    larger, so that a clear motion does some if it has hardly any room"""
    departure: Float[np.ndarray, " m"]
    """[m] by which the body gets beyond the road's edges at the end of every step, summed"""
    clear: Bool[np.ndarray, " m"]
    """whether the motion touches nothing at any time and keeps to the road"""


class Motion(NamedTuple):
    """One motion over the horizon, with the fields of `Evaluated`."""

    states: Float[np.ndarray, "P 4"]
    inputs: Float[np.ndarray, "K 2"]
    """acceleration [m/s²], yaw rate [rad/s]"""
    slack: Float[np.ndarray, " K"]
    off_road: Float[np.ndarray, " K"]
    cost: float
    lasting_cost: float
    severity: float
    harm: float
    departure: float
    clear: bool


def evaluated(
    inputs: Float[np.ndarray, "m K 2"],
    target_lat: Float[np.ndarray, " m"],
    situation: Situation,
    constants: Constants,
) -> list[Motion]:
    """The motions that inputs lead to.

    Args:
        inputs: acceleration [m/s²], yaw rate [rad/s]; driven as far as the limits of the car allow.
        target_lat: [m] centre of each motion's target lane.
        situation: what the motions are made for.
        constants: of the problem.
    """
    rows = np.ascontiguousarray(np.swapaxes(inputs, 1, 2)).reshape(len(inputs), -1)
    result = empty(*rows.shape)
    fill(rows, np.asarray(target_lat, float), surroundings_of(situation), constants, result)
    by_step = np.swapaxes(result.inputs.reshape(len(inputs), 2, -1), 1, 2)
    values: Any = zip(*result._replace(inputs=by_step), strict=True)
    return [Motion(*each) for each in values]


def surroundings_of(situation: Situation) -> Surroundings:
    """A situation in the arrays that compiled functions take."""
    centres, half_sizes, *others = situation.obstacles
    boxes = np.concatenate([centres, half_sizes, *(each[..., None] for each in others)], axis=-1)
    return Surroundings(
        np.array(situation.state, dtype=float),
        np.array(situation.previous_input, dtype=float),
        np.array(situation.road_edges, dtype=float),
        np.ascontiguousarray(boxes.transpose(2, 0, 1)),
    )


def empty(motions: int, inputs: int) -> Evaluated:
    """Arrays for a number of motions with a number U of inputs each."""
    steps = inputs // 2
    return Evaluated(
        np.empty((motions, steps + 1, 4)), np.empty((motions, inputs)), np.empty((motions, steps)),
        np.empty((motions, steps)), np.zeros(motions), np.zeros(motions), np.zeros(motions), np.zeros(motions),
        np.zeros(motions), np.ones(motions, np.bool_),
    )  # fmt: skip


compiled_empty = compiled(empty)


@compiled
def drive_step(state: State, wish: tuple[float, float], constants: Constants) -> tuple[tuple[float, float], State]:
    """The inputs within the limits that are nearest to the wished ones, and the state that they lead to.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad].
        wish: acceleration [m/s²], yaw rate [rad/s].
        constants: of the problem.
    """
    applied = _within_limits(state[2], state[3], wish[0], wish[1], constants.dt, constants.vehicle)
    return applied, _step(state, (np.cos(state[3]), np.sin(state[3])), applied, constants.dt)


@compiled
def evaluate(
    inputs: Float[np.ndarray, "m U"], target: Float[np.ndarray, " m"], around: Surroundings, constants: Constants
) -> Evaluated:
    """Drive inputs as far as the limits of the car allow, and evaluate the motions.

    Args:
        inputs: of the motions.
        target: [m] lat of the centre of each motion's target lane.
        around: what the motions are made for.
        constants: of the problem.
    """
    result = compiled_empty(inputs.shape[0], inputs.shape[1])
    fill(inputs, target, around, constants, result)
    return result


@compiled
def fill(
    inputs: Float[np.ndarray, "m U"],
    target: Float[np.ndarray, " m"],
    around: Surroundings,
    constants: Constants,
    result: Evaluated,
    priced: bool = True,
) -> None:
    """`evaluate` into arrays of `empty`: from Python, where an interrupt may come. Costs are left out if not wanted."""
    motions, steps = len(inputs), constants.steps
    for i in range(motions):
        state = (around.state[0], around.state[1], around.state[2], around.state[3])
        result.states[i, 0] = around.state
        for k in range(steps):
            applied, state = drive_step(state, (inputs[i, k], inputs[i, steps + k]), constants)
            result.inputs[i, k], result.inputs[i, steps + k] = applied
            for j in range(4):
                result.states[i, k + 1, j] = state[j]
        if priced:
            _add_costs(i, target[i], result, around, constants)
        _look_at_all_times(i, result, around, constants)


@compiled
def harm_of(closing_speed: float) -> float:
    """How much worse a contact is at a closing speed [m/s] than at none."""
    return 1 + closing_speed / _HARMFUL


@compiled
def _state(states: Float[np.ndarray, "P 4"], k: int) -> State:
    return states[k, 0], states[k, 1], states[k, 2], states[k, 3]


@compiled
def _add_costs(i: int, target: float, result: Evaluated, around: Surroundings, constants: Constants) -> None:
    """Complete slack, way off the road and costs of a motion whose states and inputs are known."""
    steps, cost = constants.steps, constants.cost
    before, lasting = (around.previous_input[0], around.previous_input[1]), 0.0
    for k in range(steps):
        applied = result.inputs[i, k], result.inputs[i, steps + k]
        _, lat, speed, heading = _state(result.states[i], k + 1)
        slack, closing = _nearest(result.states[i], k + 1, around, constants)
        lasting = max(lasting, slack * harm_of(closing))
        half_width = half_sizes_of(abs(heading), constants.vehicle)[1] + constants.shape.edge_margin
        off_road = max(0.0, lat + half_width - around.edges[1], around.edges[0] - lat + half_width)
        each = constants.weight[k] * cost_of_state(lat - target, speed, heading, cost)
        each += cost_of_input(applied[0], applied[1], applied[0] - before[0], applied[1] - before[1], cost)
        each += cost.off_road * off_road**2
        result.slack[i, k], result.off_road[i, k] = slack, off_road
        result.cost[i] += each + constants.slack[k] * slack**2
        result.lasting_cost[i] += each + constants.slack[k] * lasting**2
        before = applied


@compiled
def _nearest(
    states: Float[np.ndarray, "P 4"], moment: int, around: Surroundings, constants: Constants
) -> tuple[float, float]:
    """The slack that a moment, and the time until the next, ask for, and the closing speed [m/s] to who asks for it."""
    boxes, state = around.boxes, states[moment]
    own, last = half_sizes_of(abs(state[3]), constants.vehicle), moment == constants.steps
    way = (0.0, 0.0) if last else (states[moment + 1, 0] - state[0], states[moment + 1, 1] - state[1])
    slack = closing = 0.0
    for slot in range(boxes.shape[2]):
        excess, _, _ = box_excess((state[0], state[1], state[2]), own, 0.0, box_of(boxes, moment, slot), 0.0, constants)
        parts = 1 if last else parts_of(way, own, boxes, moment, slot)
        for part in range(1, parts):
            share = part / parts
            at = (state[0] + share * way[0], state[1] + share * way[1], state[2])
            between, _, _ = box_excess(at, own, 0.0, box_between(boxes, moment, slot, share), 0.0, constants)
            excess = max(excess, between)
        if excess > slack:
            after = min(moment + 1, constants.steps)
            moved = (boxes[0, after, slot] - boxes[0, after - 1, slot]) / constants.dt
            slack, closing = excess, abs(state[2] - moved)
    return slack, closing


@compiled
def _look_at_all_times(i: int, result: Evaluated, around: Surroundings, constants: Constants) -> None:
    """Tell whether a motion is clear at all times, how severe its contacts are, and how far off the road it gets."""
    steps, states, boxes = constants.steps, result.states[i], around.boxes
    edges, exact, known = np.empty((steps, 2, 4)), np.empty((steps, 2, 4)), False
    write_edges(states, result.inputs[i], edges, constants)
    for k in range(steps):
        beyond = max(edges[k, 1, 3] - around.edges[1], around.edges[0] - edges[k, 1, 1])
        if beyond > _ON_THE_ROAD:
            result.departure[i] += beyond
            result.clear[i] = False
    for slot in range(boxes.shape[2]):
        time, speed = _first_contact(i, slot, SPARE, result, edges, boxes, constants)
        if time == np.inf:
            continue
        if result.clear[i] and _first_contact(i, slot, 0.0, result, edges, boxes, constants)[0] < np.inf:
            result.clear[i] = False
        if not known:
            write_exact_edges(states, exact, constants)
            known = True
        sure, speed_then = _first_contact(i, slot, SPARE, result, exact, boxes, constants)
        if sure < np.inf:
            time, speed = sure, speed_then
            result.severity[i] = max(result.severity[i], speed)
        result.harm[i] += boxes[6, 0, slot] * (1 - _UNCERTAIN * time / steps) * (_ANY_CONTACT + speed)
    if result.clear[i]:
        result.severity[i] = 0.0


@compiled
def _first_contact(
    i: int, slot: int, room: float, result: Evaluated, edges: Float[np.ndarray, "K 2 4"],
    boxes: Float[np.ndarray, "7 P n"], constants: Constants,
) -> tuple[float, float]:  # fmt: skip
    """When [steps] a motion first touches a box, infinity for never, and their relative speed [m/s] then."""
    steps, states = constants.steps, result.states[i]
    for k in range(steps):
        share = contact_at(edges, boxes, k, slot, room)
        if share < NEVER:
            applied = result.inputs[i, k], result.inputs[i, steps + k]
            return k + share, impact(_state(states, k), applied, share, boxes, k, slot, constants.dt)
    braking = constants.vehicle.max_deceleration
    speed = impact_beyond(_state(states, steps), edges[steps - 1, 1], boxes, slot, braking, room)
    return (float(steps) if speed >= 0 else np.inf), speed
