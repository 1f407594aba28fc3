"""How near the own car is to a predicted box, and how that changes with its state; compiled, for one box at a time.

The definition is `coverdrive.planning.obstacles.clearance`. Since the norm of order p is at least the larger of its two
parts, boxes that are far along the road or across it are told without computing it.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.obstacles import TINY, own_half_sizes

half_sizes_of = compiled(own_half_sizes)
"""compiled"""


@compiled
def box_excess(
    state: tuple[float, float, float],
    own: tuple[float, float],
    sign: float,
    boxes: Float[np.ndarray, "5 K n"],
    step: int,
    slot: int,
    view: float,
    constants: Constants,
) -> tuple[float, Any]:
    """The slack γ that a box asks for, margin included and negative outside, and its derivatives.

    Args:
        state: lon, lat [m] and speed [m/s] of the own car.
        own: [m] half extents of its box along lon and lat.
        sign: of the heading that they are taken for, by which they grow with it.
        boxes: lon, lat, half length, half width [m] and speed [m/s] of the boxes.
        step: index of the step, from 0.
        slot: index of the box.
        view: what is below −view is not looked at, and −view is returned with derivatives of 0.
        constants: of the problem.

    Returns:
        The slack, and its derivatives with respect to lon, lat, speed and heading.
    """
    vehicle, inflation = constants.vehicle, constants.inflation
    half_way = braking = 0.0
    faster = state[2] - boxes[4, step, slot]
    if faster > 0:
        braking = faster / (2 * vehicle.max_deceleration)
        half_way = faster * braking / 2
    long = inflation * (boxes[2, step, slot] + own[0] + half_way)
    wide = inflation * (boxes[3, step, slot] + own[1])
    ahead, aside = state[0] + half_way - boxes[0, step, slot], state[1] - boxes[1, step, slot]
    touching = 1 + constants.shape.margin
    if abs(ahead) >= (touching + view) * long or abs(aside) >= (touching + view) * wide:
        return -view, (0.0, 0.0, 0.0, 0.0)
    per_long, per_wide = 1 / long, 1 / wide
    ahead, aside = ahead * per_long, aside * per_wide
    of_ahead, below_ahead = _to_order(ahead, constants)
    of_aside, below_aside = _to_order(aside, constants)
    power = of_ahead + of_aside + TINY
    norm = _root(power, constants)
    factor = -norm / power
    by_ahead, by_aside = factor * below_ahead * per_long, factor * below_aside * per_wide
    tilting = -inflation / 2 * sign
    by_heading = tilting * (by_ahead * ahead * vehicle.width + by_aside * aside * vehicle.length)
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
