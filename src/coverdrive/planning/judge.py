"""Driving inputs within the limits of the car, and judging the motions; compiled.

The same as `coverdrive.planning.motion.judged`, for many motions at once in a fraction of the time.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.contact import box_excess, half_sizes_of
from coverdrive.planning.merit import Surroundings, cost_of_input, cost_of_state
from coverdrive.planning.motion import harm_of
from coverdrive.planning.vehicle import euler_step, within_limits

_harm_of = compiled(harm_of)
_step = compiled(euler_step)
_within_limits = compiled(within_limits)


class Judged(NamedTuple):
    """Motions within the limits of the car."""

    states: Float[np.ndarray, "m P 4"]
    inputs: Float[np.ndarray, "m U"]
    slack: Float[np.ndarray, "m K"]
    off_road: Float[np.ndarray, "m K"]
    cost: Float[np.ndarray, " m"]
    lasting_cost: Float[np.ndarray, " m"]
    """with every slack times its harm held until the end; see `coverdrive.planning.motion.Motion`"""


@compiled
def drive_step(
    state: tuple[float, float, float, float], wish: tuple[float, float], constants: Constants
) -> tuple[tuple[float, float], tuple[float, float, float, float]]:
    """The inputs within the limits that are nearest to the wished ones, and the state that they lead to.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad].
        wish: acceleration [m/s²], yaw rate [rad/s].
        constants: of the problem.
    """
    applied = _within_limits(state[2], state[3], wish[0], wish[1], constants.dt, constants.vehicle)
    return applied, _step(state, (np.cos(state[3]), np.sin(state[3])), applied, constants.dt)


@compiled
def judge(
    inputs: Float[np.ndarray, "m U"], target: Float[np.ndarray, " m"], around: Surroundings, constants: Constants
) -> Judged:
    """Drive inputs as far as the limits of the car allow, and judge the motions.

    Args:
        inputs: of the motions.
        target: [m] lat of the centre of each motion's target lane.
        around: what the motions are made for.
        constants: of the problem.
    """
    motions, steps = len(inputs), constants.steps
    states, driven = np.empty((motions, steps + 1, 4)), np.empty((motions, 2 * steps))
    slack, off_road = np.empty((motions, steps)), np.empty((motions, steps))
    cost, lasting_cost = np.zeros(motions), np.zeros(motions)
    for i in range(motions):
        state = (around.state[0], around.state[1], around.state[2], around.state[3])
        states[i, 0] = around.state
        before, lasting = (around.previous_input[0], around.previous_input[1]), 0.0
        for k in range(steps):
            applied, state = drive_step(state, (inputs[i, k], inputs[i, steps + k]), constants)
            driven[i, k], driven[i, steps + k] = applied
            for j in range(4):
                states[i, k + 1, j] = state[j]
            slack[i, k], closing = _contact(state, k, around, constants)
            lasting = max(lasting, slack[i, k] * _harm_of(closing))
            off_road[i, k] = _off_road(state, around, constants)
            each = constants.weight[k] * cost_of_state(state[1] - target[i], state[2], state[3], constants.cost)
            changes = applied[0] - before[0], applied[1] - before[1]
            each += cost_of_input(applied[0], applied[1], changes[0], changes[1], constants.cost)
            each += constants.cost.off_road * off_road[i, k] ** 2
            cost[i] += each + constants.slack[k] * slack[i, k] ** 2
            lasting_cost[i] += each + constants.slack[k] * lasting**2
            before = applied
    return Judged(states, driven, slack, off_road, cost, lasting_cost)


@compiled
def _contact(
    state: tuple[float, float, float, float], step: int, around: Surroundings, constants: Constants
) -> tuple[float, float]:
    """The slack that a state after a step asks for, and the closing speed [m/s] to the box that asks for it."""
    own, boxes = half_sizes_of(abs(state[3]), constants.vehicle), around.boxes
    slack, first = 0.0, min(step, constants.steps - 2)
    closing = 0.0
    for slot in range(boxes.shape[2]):
        excess, _ = box_excess(state[:3], own, 0.0, boxes, step, slot, 0.0, constants)
        if excess > slack:
            moved = (boxes[0, first + 1, slot] - boxes[0, first, slot]) / constants.dt
            slack, closing = excess, abs(state[2] - moved)
    return slack, closing


@compiled
def _off_road(state: tuple[float, float, float, float], around: Surroundings, constants: Constants) -> float:
    """The way [m] by which the body is beyond the road's margins."""
    half_width = half_sizes_of(abs(state[3]), constants.vehicle)[1] + constants.shape.edge_margin
    return max(0.0, state[1] + half_width - around.edges[1], around.edges[0] - state[1] + half_width)
