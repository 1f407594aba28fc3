"""What plans are worth: inputs driven within the limits of the ego, and all that follows; compiled.

Whatever proposes a plan (a rule, the last plan, a solver) proposes inputs; the states follow from the vehicle model,
and everything else from the states. Nothing here trusts what a search says about its result. A plan is *clear* if its
fail-safe branch touches no member of any set at any time (`coverdrive.planning.check.sweep`), could brake behind
whoever is ahead at its end, and keeps to the road. m plans, N nodes of `coverdrive.planning.problem.tree`, K steps, P =
K + 1 states.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from coverdrive.compiled import compiled, lent
from coverdrive.planning.check.contact import box_between, box_excess, box_of, half_sizes_of, parts_of
from coverdrive.planning.check.merit import input_at, merit_of
from coverdrive.planning.check.sweep import NEVER, contact_at, impact, impact_beyond, may_touch, reach, write_edges
from coverdrive.planning.problem.constants import Constants
from coverdrive.planning.problem.obstacles import LIKELIHOOD
from coverdrive.planning.problem.rollout import after_step, rollout_of, state_at, write
from coverdrive.planning.problem.vehicle import within_limits
from coverdrive.planning.surroundings import Surroundings
from coverdrive.road_ahead import FASTEST, LEFT, RIGHT, STRAIGHT, Bend, RoadAhead, State, bend_at, value_at

_ANY_CONTACT = 5.0
"""[m/s] that a contact counts as at no relative speed"""
_USUAL = 20.0
"""[m/s] of a contact that counts as much as its speed says"""
_UNCERTAIN = 0.4
"""by how much less a contact at the end of the plan counts than one now"""
_FROM_BEHIND = 0.1
"""share of the harm that a contact counts where the other one runs into the ego"""
_LEVELS = (
    (1.0, -0.05, 0.01, 0.01),
    (1.0, 0.0, 0.02, 0.02),
    (0.75, 0.0, 0.04, 0.04),
    (0.5, 0.0, 0.08, 0.08),
    (0.25, 0.0, 0.2, 0.2),
    (0.0, 0.0, 0.65, 0.35),
    (0.0, 0.15, 0.0, 0.3),
)
"""shares of what boxes have grown beyond the bodies in their middle, depth [m] from which on contact with these counts
(below 0: as near to them), and the shares that it has of the harm, and of the expected harm"""
_ON_THE_ROAD = 1e-9
"""[m] by which a body may be beyond the edge of the road"""


@lent
class Plans(NamedTuple):
    """Plans within the limits of the ego."""

    inputs: Float[np.ndarray, "m N 2"]
    """acceleration [m/s²], yaw rate [rad/s]"""
    states: Float[np.ndarray, "m N 4"]
    """lon [m], lat [m], speed [m/s], heading [rad] at the end of every node's step"""
    targets: Float[np.ndarray, "m 2"]
    """[m] lat of the centres of the target lanes of the drive branch (0) and of the fail-safe branch (1)"""
    lane: Int[np.ndarray, " m"]
    """index of the drive branch's target"""
    cost: Float[np.ndarray, " m"]
    """`coverdrive.planning.check.merit.merit`; no number where the plan is none"""
    driving: Float[np.ndarray, " m"]
    """the share of it that the drive branch has"""
    severity: Float[np.ndarray, " m"]
    """[m/s] relative speed at the first contact of the fail-safe branch with a box, of the worst box; 0 without one"""
    harm: Float[np.ndarray, " m"]
    """of the first contacts of the fail-safe branch with every member: the fourth power of their speed, so that the
    worst one decides, times their likelihood, less from behind, at the rim of a box, and later, thus less certain; of
    evasions that are steered anew at every plan, as if they were"""
    expected: Float[np.ndarray, " m"]
    """the same, but less where a body is hardly touched: the next plans may still avoid that"""
    departure: Float[np.ndarray, " m"]
    """[m] by which the fail-safe branch gets beyond the road's edges during each of its steps, summed"""
    clear: Bool[np.ndarray, " m"]
    """whether the fail-safe branch touches nothing at any time and keeps to the road"""


def empty_plans(plans: int, nodes: int) -> Plans:
    """Room for a number of plans; none yet."""
    numbers = np.full((6, plans), np.nan)
    return Plans(
        np.zeros((plans, nodes, 2)), np.zeros((plans, nodes, 4)), np.zeros((plans, 2)), np.zeros(plans, int),
        numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5], np.zeros(plans, bool),
    )  # fmt: skip


@compiled
def drive_step(
    state: State, wish: tuple[float, float], before: tuple[float, float], elapsed: float, dt: float, bend: Bend,
    vehicle: Any,
) -> tuple[tuple[float, float], State]:  # fmt: skip
    """The inputs that `within_limits` makes of the wished ones, and the state that they lead to."""
    applied = within_limits(state, wish, before, elapsed, dt, bend, vehicle)
    return applied, after_step(state, applied, dt)


@compiled
def hold(
    inputs: Float[np.ndarray, "n 2"], states: Float[np.ndarray, "n 4"], around: Surroundings, constants: Constants
) -> int:
    """Where a plan is driven for longer than its first step, let all steps until the next plan have the mean of their
    inputs, as far as the limits allow, and write their states; returns how many these are.
    """
    steps, dt, period = constants.held, constants.dt, constants.period
    if steps == 1:
        return 0
    acceleration = turn = 0.0
    for k in range(steps):
        share = min(dt / period, 1 - k * dt / period)
        acceleration, turn = acceleration + share * inputs[k, 0], turn + share * inputs[k, 1]
    state, before = state_at(states, -1, around.state), input_at(inputs, -1, around.previous_input)
    bend = STRAIGHT if len(around.road.rows) == 1 else bend_at(state, steps * dt, around.road)
    applied = within_limits(state, (acceleration, turn), before, period, steps * dt, bend, constants.vehicle)
    for k in range(steps):
        state = after_step(state, applied, dt)
        write(inputs[k], applied)
        write(states[k], state)
    return steps


@compiled
def evaluate(plans: Plans, first: int, last: int, around: Surroundings, constants: Constants) -> None:
    """Drive the inputs of the plans from ``first`` to before ``last`` as far as the limits of the ego allow, and
    complete what follows from these and their targets.
    """
    tree, dt, straight = constants.tree, constants.dt, len(around.road.rows) == 1
    for i in range(first, last):
        states, inputs = plans.states[i], plans.inputs[i]
        for n in range(hold(inputs, states, around, constants), len(inputs)):
            state, wish = state_at(states, tree.parent[n], around.state), (inputs[n, 0], inputs[n, 1])
            before = input_at(inputs, tree.parent[n], around.previous_input)
            elapsed = dt if tree.parent[n] >= 0 else constants.period
            bend = STRAIGHT if straight else bend_at(state, dt, around.road)
            (inputs[n, 0], inputs[n, 1]), after = drive_step(state, wish, before, elapsed, dt, bend, constants.vehicle)
            write(states[n], after)
        complete(plans, i, around, constants)


@compiled
def complete(plans: Plans, i: int, around: Surroundings, constants: Constants) -> None:
    """Complete what follows from inputs within the limits and their states: what the plan costs, whether it is clear at
    all times, how severe its contacts are, and how far off the road it gets.
    """
    tree, steps, boxes = constants.tree, constants.steps, around.boxes
    rollout = rollout_of(plans.states[i], constants.dt)
    model = merit_of(rollout, plans.inputs[i], plans.targets[i], around, constants)
    plans.cost[i], plans.driving[i] = model.value, 0.0
    for n in range(len(tree.safe)):
        plans.driving[i] += model.shares[n] * (0.0 if tree.safe[n] else 1.0)
    states, inputs = np.empty((steps + 1, 4)), np.empty((steps, 2))
    write(states[0], around.state)
    for k in range(steps):
        write(states[k + 1], plans.states[i, tree.fail_safe[k]])
        write(inputs[k], plans.inputs[i, tree.fail_safe[k]])
    edges = np.empty((steps, 2, 4))
    write_edges(states, inputs, edges, constants)
    departure, severity, harm, expected, touching = 0.0, 0.0, 0.0, 0.0, False
    for k in range(steps):
        beyond = _beyond(states[k, 0], states[k + 1, 0], edges[k], k == 0, around.road)
        departure += beyond if beyond > _ON_THE_ROAD else 0.0
    faster = states[steps, 2] - value_at(states[steps, 0], FASTEST, around.road)[0]
    if faster > 0:  # it would leave the road in a curve to come
        departure += faster * states[steps, 2] / constants.vehicle.braking
    for slot in range(boxes.shape[2]):
        if not _touching(states, edges, slot, boxes, constants):
            continue
        touching = True
        for grown, deep, share, likely in _LEVELS:
            time, speed = first_contact(states, inputs, edges, slot, grown, deep, boxes, constants)
            if time == np.inf:
                break
            if grown == 1 and deep == 0:
                severity = max(severity, abs(speed))
            if time == 0 and deep < 0:  # who is near now may be touched yet; what is touched is, whatever the ego does
                start, applied = state_at(states, 0, states[0]), (inputs[0, 0], inputs[0, 1])
                later = impact(start, applied, 1.0, boxes, 0, slot, constants.dt)
                time, speed = 1.0, -later if speed < 0 else later
            contact = boxes[LIKELIHOOD, 0, slot] * _harm_of(time / steps, speed)
            harm, expected = harm + share * contact, expected + likely * contact
    plans.departure[i], plans.severity[i], plans.harm[i], plans.expected[i] = departure, severity, harm, expected
    plans.clear[i] = departure == 0 and not touching


@compiled
def _beyond(lon: float, then: float, edges: Float[np.ndarray, "2 4"], now: bool, road: RoadAhead) -> float:
    """By how much [m] the body gets beyond the edges of the road during a step, below 0 if it does not.

    The road's edges are looked at in places between which the road has room to spare; where the ego is now, no plan
    changes, and if that is off the road, neither is the way to the end of the step.
    """
    parts, worst, off = 1 if len(road.rows) == 1 else 1 + int(abs(then - lon) / road.spacing), -np.inf, False
    for part in range(parts + 1):
        share, rest = part / parts, 1 - part / parts
        place = rest * lon + share * then
        leftmost, rightmost = rest * edges[0, 3] + share * edges[1, 3], rest * edges[0, 1] + share * edges[1, 1]
        beyond = max(leftmost - value_at(place, LEFT, road)[0], value_at(place, RIGHT, road)[0] - rightmost)
        if part == 0:
            off = now and beyond > _ON_THE_ROAD
        if part == parts or not (off or (now and part == 0)):
            worst = max(worst, beyond)
    return worst


@compiled
def _harm_of(share: float, speed: float) -> float:
    """What a contact at a relative speed [m/s], below 0 from behind, counts after a share of the plan."""
    blame = _FROM_BEHIND if speed < 0 else 1.0
    return blame * (1 - _UNCERTAIN * share) * (_ANY_CONTACT + abs(speed)) ** 4 / _USUAL**3


@compiled
def _touching(
    states: Float[np.ndarray, "P 4"], edges: Float[np.ndarray, "K 2 4"], slot: int, boxes: Float[np.ndarray, "7 P n"],
    constants: Constants,
) -> bool:  # fmt: skip
    """Whether a motion is not clear of a box: may touch it at any time, or cannot brake behind it at the end."""
    steps, braking = constants.steps, constants.vehicle.braking
    for k in range(steps):
        if may_touch(edges, boxes, k, slot):
            return True
    return impact_beyond(state_at(states, steps, states[0]), edges[steps - 1, 1], boxes, slot, braking) >= 0


@compiled
def first_contact(
    states: Float[np.ndarray, "P 4"], inputs: Float[np.ndarray, "K 2"], edges: Float[np.ndarray, "K 2 4"], slot: int,
    grown: float, deep: float, boxes: Float[np.ndarray, "7 P n"], constants: Constants,
) -> tuple[float, float]:  # fmt: skip
    """When [steps] the turned body first gets ``deep`` [m] into a box, infinity for never, and how fast [m/s], below 0
    if from behind.

    Its edges tell where it may.
    """
    for k in range(constants.steps):
        if may_touch(edges, boxes, k, slot):
            state, applied = state_at(states, k, states[0]), (inputs[k, 0], inputs[k, 1])
            share, behind = contact_at(state, applied, boxes, k, slot, grown, deep, constants)
            if share < NEVER:
                speed = impact(state, applied, share, boxes, k, slot, constants.dt)
                return k + share, -speed if behind else speed
    end = state_at(states, constants.steps, states[0])
    speed = impact_beyond(end, reach(end, max(deep, 0.0), constants.vehicle), boxes, slot, constants.vehicle.braking)
    return (float(constants.steps) if speed >= 0 else np.inf), speed


@compiled
def write_slack(
    states: Float[np.ndarray, "P 4"], around: Surroundings, constants: Constants, slack: Float[np.ndarray, " K"]
) -> None:
    """Write the smallest γ_k with which the obstacle constraints of the steps k = 1 … K and until the next hold."""
    boxes = around.boxes
    for k in range(1, constants.steps + 1):
        state, last, asked = state_at(states, k, states[0]), k == constants.steps, 0.0
        half = half_sizes_of(abs(state[3]), constants.vehicle)
        own = (half[0], 0.0), (half[1], 0.0)
        way = (0.0, 0.0) if last else (states[k + 1, 0] - state[0], states[k + 1, 1] - state[1])
        for slot in range(boxes.shape[2]):
            asked = max(asked, box_excess(state, own, box_of(boxes, k, slot), 0.0, constants)[0])
            parts = 1 if last else parts_of(way, half, boxes, k, slot)
            for part in range(1, parts):
                share = part / parts
                at = (state[0] + share * way[0], state[1] + share * way[1], state[2], state[3])
                asked = max(asked, box_excess(at, own, box_between(boxes, k, slot, share), 0.0, constants)[0])
        slack[k - 1] = max(0.0, asked - constants.shape.margin)
