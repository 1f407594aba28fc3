"""Rectangles on the road: overlap, gaps and extents.

A box is given by its centre (lon, lat) [m], its heading [rad] and its half length and half width [m]. Boxes that
only touch do not overlap. All functions broadcast over leading axes.
"""

from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.scene import beside

Array = Any
"""NumPy arrays and scalars"""
Numbers = Float[Array, "*#n"]
Pairs = Float[Array, "*#n 2"]

CORNERS = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
"""of a body, in half lengths and widths from its centre"""
_LEAST = 0.25
"""of 1 − κe beside a body; where a long one is so near to the centre of a curve that it would be less, this holds"""


def turned_half_extents(half_sizes: Pairs, heading: Numbers) -> Pairs:
    """Half extents [m] along the road's axes of the smallest upright box around a turned box."""
    return beside(*turned_extents(half_sizes[..., 0], half_sizes[..., 1], heading))


def turned_extents(half_length: Array, half_width: Array, heading: Array) -> tuple[Array, Array]:
    """`turned_half_extents` of numbers, or of arrays element by element."""
    cosine, sine = np.abs(np.cos(heading)), np.abs(np.sin(heading))
    return half_length * cosine + half_width * sine, half_length * sine + half_width * cosine


def bent_half_sizes(
    half_sizes: Pairs, diagonal: Numbers | float, curvature: Numbers | float, aside: Numbers | float
) -> Pairs:
    """Half extents [m] in the frame of a bent road of boxes that hold bodies as if it were straight; from above.

    ``docs/proofs.md`` proves it. At a distance e from the reference line, 1 m of the road is 1 m / (1 − κe) of lon,
    which makes bodies longer and turns them more; a straight side of half length l leaves the curve by κl²/2.

    Args:
        half_sizes: [m] half extents along lon and lat of boxes that hold a body wherever it may be.
        diagonal: [m] half of that of the body.
        curvature: [1/m] the largest, of either sign, of the reference line beside the box.
        aside: [m] distance of the reference line from the farthest side of the box; a tenth of the radius, say.
    """
    bend = np.abs(curvature)
    turning = np.maximum(1 - 2 * bend * diagonal, _LEAST)
    least = np.maximum(1 - bend * (aside + bend * diagonal**2) / turning, _LEAST)  # of 1 − κe
    bow = bend * diagonal**2 / (2 * least)
    longer = diagonal * (1 / least**2 - 1) + bow / least * (1 + bend * diagonal / (3 * least))
    return np.stack([half_sizes[..., 0] + longer, half_sizes[..., 1] / least + bow], axis=-1)


def axis_gap(first: Numbers, second: Numbers, first_half: Numbers | float, second_half: Numbers | float) -> Numbers:
    """Gap [m] between intervals of one axis, of their centres and half extents; negative, by how much, if they meet."""
    return np.abs(np.subtract(first, second)) - np.add(first_half, second_half)


def boxes_overlap(
    centre: Pairs, heading: Numbers, half_sizes: Pairs,
    other_centre: Pairs, other_heading: Numbers, other_half_sizes: Pairs,
) -> Bool[Array, "*#n"]:  # fmt: skip
    """Whether the interiors of turned boxes meet.

    By the separating axis theorem (Gottschalk, Lin, Manocha, SIGGRAPH 1996): two rectangles are apart exactly if their
    projections onto one of their four side directions are apart.
    """
    offset = np.subtract(other_centre, centre)
    turn = np.subtract(other_heading, heading)
    seen_by_first = np.abs(_turned_into(offset, heading))
    seen_by_second = np.abs(_turned_into(offset, other_heading))
    meets_first = seen_by_first < half_sizes + turned_half_extents(other_half_sizes, turn)
    meets_second = seen_by_second < other_half_sizes + turned_half_extents(half_sizes, turn)
    return np.all(meets_first & meets_second, axis=-1)


def body_distance(
    centre: Pairs, heading: Numbers, half_sizes: Pairs,
    other_centre: Pairs, other_heading: Numbers, other_half_sizes: Pairs,
) -> Numbers:  # fmt: skip
    """Distance [m] of two turned boxes, 0 if they overlap; if not, a corner of one of them is nearest to the other."""
    first, second = (centre, heading, half_sizes), (other_centre, other_heading, other_half_sizes)
    nearest = np.minimum(_corner_distance(*first, *second), _corner_distance(*second, *first))
    return np.where(boxes_overlap(*first, *second), 0.0, nearest)


def _corner_distance(
    centre: Pairs, heading: Numbers, half_sizes: Pairs,
    other_centre: Pairs, other_heading: Numbers, other_half_sizes: Pairs,
) -> Numbers:  # fmt: skip
    """Least distance [m] of the other box's corners to the one box."""
    offset = _corners(other_centre, other_heading, other_half_sizes) - centre[..., None, :]
    beyond = np.abs(_turned_into(offset, heading[..., None])) - half_sizes[..., None, :]
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=-1).min(axis=-1)


def _turned_into(offset: Pairs, heading: Any) -> Pairs:
    """The offset [m] as seen from a body with the heading [rad]: how far ahead, how far to the left."""
    cosine, sine = np.cos(heading), np.sin(heading)
    lon, lat = offset[..., 0], offset[..., 1]
    return beside(lon * cosine + lat * sine, lat * cosine - lon * sine)


def body_corners(
    states: Float[np.ndarray, "*n 4"], half_sizes: Float[np.ndarray, "*#n 2"]
) -> Float[np.ndarray, "*n 4 2"]:
    """Corners [m] of bodies of half lengths and widths [m] in states (lon, lat [m], speed [m/s], heading [rad])."""
    return _corners(states[..., :2], states[..., 3], half_sizes)


def _corners(centre: Pairs, heading: Numbers, half_sizes: Pairs) -> Float[np.ndarray, "*n 4 2"]:
    return centre[..., None, :] + _turned_into(half_sizes[..., None, :] * CORNERS, -heading[..., None])
