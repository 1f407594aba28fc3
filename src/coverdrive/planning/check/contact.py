"""How near the ego is to a predicted box, and how that changes with its state; compiled, for one box at a time.

The definition is `coverdrive.planning.problem.obstacles.clearance`. Since the norm of order p is at least the larger of
its two parts, boxes that are far along the road or across it are told without computing it.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled
from coverdrive.planning.problem.constants import Constants
from coverdrive.planning.problem.obstacles import BRAKE_TO, FALL, FAR, TINY, own_half_sizes
from coverdrive.road_ahead import State

KINK = 0.01
"""[rad] at which a heading is rounded off"""
MOST_PARTS = 8
"""parts that a step is looked at in at the most"""
half_sizes_of = compiled(own_half_sizes)
"""compiled"""
Box = tuple[float, float, float, float, float, float]
"""lon, lat, half length, half width [m], and the speed [m/s] to brake to and its fall [m/s²]"""


@compiled
def box_of(boxes: Float[np.ndarray, "7 P n"], moment: int, slot: int) -> Box:
    """A box at a moment."""
    lon, lat, speed = boxes[0, moment, slot], boxes[1, moment, slot], boxes[BRAKE_TO, moment, slot]
    return lon, lat, boxes[2, moment, slot], boxes[3, moment, slot], speed, boxes[FALL, moment, slot]


@compiled
def box_between(boxes: Float[np.ndarray, "7 P n"], moment: int, slot: int, share: float) -> Box:
    """A box after a share of the step that follows a moment; nobody has to brake for it there."""
    now, then, rest = box_of(boxes, moment, slot), box_of(boxes, moment + 1, slot), 1 - share
    lon, lat = rest * now[0] + share * then[0], rest * now[1] + share * then[1]
    return lon, lat, rest * now[2] + share * then[2], rest * now[3] + share * then[3], FAR, 0.0


@compiled
def parts_of(
    way: tuple[float, float], own: tuple[float, float], boxes: Float[np.ndarray, "7 P n"], moment: int, slot: int
) -> int:
    """In how many parts the step after a moment is looked at, so that the ego's box cannot jump over another.

    In each, car and box come by no more than the sum of their half extents past each other: what moves alike is looked
    at once. The ego has half extents [m] of its ``own``, and in the step its ``way`` [m], along lon and lat each.
    """
    parts = 1
    for axis in range(2):
        past = abs(way[axis] - boxes[axis, moment + 1, slot] + boxes[axis, moment, slot])
        room = own[axis] + boxes[2 + axis, moment, slot]
        if past >= room:
            parts = max(parts, 1 + int(min(past / room, MOST_PARTS - 1)))
    return parts


@compiled
def smooth_half_sizes(heading: float, vehicle: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    """`own_half_sizes` for either sign of the heading, without a kink at 0 and never smaller, and the derivatives."""
    smooth = np.sqrt(heading**2 + KINK**2)
    long, wide = half_sizes_of(smooth, vehicle)
    return (long, vehicle.width / 2 * heading / smooth), (wide, vehicle.length / 2 * heading / smooth)


@compiled
def box_excess(
    state: State,
    own: tuple[tuple[float, float], tuple[float, float]],
    box: Box,
    view: float,
    constants: Constants,
) -> tuple[float, State]:
    """The slack γ that a box asks for, margin included and negative outside, and its derivatives by the state.

    Args:
        state: lon, lat [m], speed [m/s] and heading [rad] of the ego.
        own: [m] half extents of its box along lon and lat, each with its derivative by the heading.
        box: the box.
        view: what is below −view is not looked at, and −view is returned with derivatives of 0.
        constants: of the problem.
    """
    vehicle, inflation = constants.vehicle, constants.inflation
    half_way = braking = 0.0
    if state[2] > box[4]:
        fall = min(box[5], vehicle.braking)
        faster, harder = state[2] - box[4], vehicle.braking - fall
        if faster * fall <= box[4] * harder:
            braking = faster / (2 * harder)
            half_way = faster * braking / 2
        else:
            braking = state[2] / (2 * vehicle.braking)
            half_way = state[2] * braking / 2 - box[4] ** 2 / (4 * fall)
    long = inflation * (box[2] + own[0][0] + half_way)
    wide = inflation * (box[3] + own[1][0])
    ahead, aside = state[0] + half_way - box[0], state[1] - box[1]
    touching = 1 + constants.shape.margin
    if abs(ahead) >= (touching + view) * long or abs(aside) >= (touching + view) * wide:
        return -view, (0.0, 0.0, 0.0, 0.0)
    ahead, aside = ahead / long, aside / wide
    of_ahead, below_ahead = _to_order(ahead, constants)
    of_aside, below_aside = _to_order(aside, constants)
    power = of_ahead + of_aside + TINY
    norm = _root(power, constants)
    factor = -norm / power
    by_ahead, by_aside = factor * below_ahead / long, factor * below_aside / wide
    by_heading = -inflation * (by_ahead * ahead * own[0][1] + by_aside * aside * own[1][1])
    by_speed = by_ahead * (1 - inflation * ahead) * braking
    return touching - norm, (by_ahead, by_aside, by_speed, by_heading)


@compiled
def _to_order(value: float, constants: Constants) -> tuple[float, float]:
    """A number to the power of the superellipses' order, which is a power of two, and to the power below."""
    order, below = 1, 1.0
    while order < constants.shape.order:
        below *= value
        value *= value
        order *= 2
    return value, below


@compiled
def _root(value: float, constants: Constants) -> float:
    """The root of that order."""
    order = 1
    while order < constants.shape.order:
        value = np.sqrt(value)
        order *= 2
    return value
