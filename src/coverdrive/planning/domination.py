"""Boxes that others dominate: whoever is clear of the larger one is clear of what lies within it, at every step.

A superellipse lies within the box that its semi-axes span, and holds the box that it was made for. So if, in both axes
and for every turn of the own car, the former of one path is in the latter of another, the one needs no constraint.
"""

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.contact import half_sizes_of


@compiled
def mark_undominated(
    boxes: Float[np.ndarray, "5 K n"], turned: float, fastest: float, constants: Constants, kept: Bool[np.ndarray, " n"]
) -> None:
    """Tell which paths no other one dominates.

    Args:
        boxes: lon, lat, half length, half width [m] and speed [m/s], as in `coverdrive.planning.merit.Surroundings`.
        turned: [rad] largest heading of the own car, either way.
        fastest: [m/s] its largest speed.
        constants: of the problem.
        kept: where the answer is written.
    """
    own = half_sizes_of(turned, constants.vehicle)
    kept[:] = True
    for inner in range(len(kept)):
        for outer in range(len(kept)):
            if outer != inner and kept[outer] and _dominates(boxes, outer, inner, own, fastest, constants):
                kept[inner] = False
                break


@compiled
def _dominates(
    boxes: Float[np.ndarray, "5 K n"],
    outer: int,
    inner: int,
    own: tuple[float, float],
    fastest: float,
    constants: Constants,
) -> bool:
    more = constants.inflation - 1
    for k in range(constants.steps - 1, -1, -1):
        if boxes[4, k, outer] > boxes[4, k, inner]:
            return False
        half_way = max(0.0, fastest - boxes[4, k, inner]) ** 2 / (4 * constants.vehicle.max_deceleration)
        for axis, grown in ((0, own[0] + half_way), (1, own[1])):
            apart = abs(boxes[axis, k, outer] - boxes[axis, k, inner])
            half_inner, half_outer = boxes[2 + axis, k, inner], boxes[2 + axis, k, outer]
            if apart + constants.inflation * half_inner + more * grown > half_outer:
                return False
    return True
