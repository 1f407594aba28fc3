"""Rectangles on the road: overlap, gaps and extents.

A box is given by its centre (lon, lat) [m], its heading [rad] and its half length and half width [m]. Boxes that
only touch do not overlap. All functions broadcast over leading axes.
"""

from typing import Any

import numpy as np
from jaxtyping import Bool, Float

Array = Any
"""NumPy arrays and scalars"""


def turned_half_extents(half_sizes: Float[Array, "*#n 2"], heading: Float[Array, "*#n"]) -> Float[Array, "*#n 2"]:
    """Half extents along the road's axes of the smallest upright box around a turned box.

    Args:
        half_sizes: [m] half length and half width.
        heading: [rad] of the box.

    Returns:
        [m] half extents along lon and lat.
    """
    return np.stack(turned_extents(half_sizes[..., 0], half_sizes[..., 1], heading), axis=-1)


def turned_extents(half_length: Array, half_width: Array, heading: Array) -> tuple[Array, Array]:
    """`turned_half_extents` of numbers, or of arrays element by element."""
    cosine, sine = np.abs(np.cos(heading)), np.abs(np.sin(heading))
    return half_length * cosine + half_width * sine, half_length * sine + half_width * cosine


def axis_gap(
    first: Float[Array, "*#n"],
    second: Float[Array, "*#n"],
    first_half: Float[Array, "*#n"] | float,
    second_half: Float[Array, "*#n"] | float,
) -> Float[Array, "*#n"]:
    """Gap between two intervals of one axis: bumper to bumper along lon, side to side along lat.

    Args:
        first: [m] centre of the one interval.
        second: [m] centre of the other.
        first_half: [m] half extent of the one.
        second_half: [m] half extent of the other.

    Returns:
        [m] distance between the facing ends; negative, by how much, where the intervals overlap.
    """
    return np.abs(np.subtract(first, second)) - np.add(first_half, second_half)


def boxes_overlap(
    centre: Float[Array, "*#n 2"],
    heading: Float[Array, "*#n"],
    half_sizes: Float[Array, "*#n 2"],
    other_centre: Float[Array, "*#n 2"],
    other_heading: Float[Array, "*#n"],
    other_half_sizes: Float[Array, "*#n 2"],
) -> Bool[Array, "*#n"]:
    """Whether turned boxes overlap, by the separating axis theorem (Gottschalk, Lin, Manocha, SIGGRAPH 1996).

    Two rectangles are apart exactly if their projections onto one of their four side directions are apart.

    Args:
        centre: [m] (lon, lat) of the one box.
        heading: [rad] of the one box.
        half_sizes: [m] half length and half width of the one box.
        other_centre: [m] (lon, lat) of the other box.
        other_heading: [rad] of the other box.
        other_half_sizes: [m] half length and half width of the other box.

    Returns:
        True where the interiors meet.
    """
    offset = np.subtract(other_centre, centre)
    turn = np.subtract(other_heading, heading)
    seen_by_first = np.abs(_turned_into(offset, heading))
    seen_by_second = np.abs(_turned_into(offset, other_heading))
    meets_first = seen_by_first < half_sizes + turned_half_extents(other_half_sizes, turn)
    meets_second = seen_by_second < other_half_sizes + turned_half_extents(half_sizes, turn)
    return np.all(meets_first & meets_second, axis=-1)


def body_distance(
    centre: Float[Array, "*#n 2"],
    heading: Float[Array, "*#n"],
    half_sizes: Float[Array, "*#n 2"],
    other_centre: Float[Array, "*#n 2"],
    other_heading: Float[Array, "*#n"],
    other_half_sizes: Float[Array, "*#n 2"],
) -> Float[Array, "*#n"]:
    """Distance [m] of two turned boxes, 0 if they overlap; arguments as of `boxes_overlap`.

    Of two convex polygons that are apart, a corner of one is nearest to the other.
    """
    first, second = (centre, heading, half_sizes), (other_centre, other_heading, other_half_sizes)
    overlap = boxes_overlap(*first, *second)
    return np.where(overlap, 0.0, np.minimum(_corner_distance(*first, *second), _corner_distance(*second, *first)))


def _corner_distance(
    centre: Float[Array, "*#n 2"],
    heading: Float[Array, "*#n"],
    half_sizes: Float[Array, "*#n 2"],
    other_centre: Float[Array, "*#n 2"],
    other_heading: Float[Array, "*#n"],
    other_half_sizes: Float[Array, "*#n 2"],
) -> Float[Array, "*#n"]:
    """Least distance [m] of the other box's corners to the one box."""
    distances = list[Any]()
    for side in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        corner = other_centre + _turned_into(np.array(side) * other_half_sizes, -other_heading)
        beyond = np.abs(_turned_into(corner - centre, heading)) - half_sizes
        distances.append(np.linalg.norm(np.maximum(beyond, 0.0), axis=-1))
    return np.min(np.stack(np.broadcast_arrays(*distances)), axis=0)


def _turned_into(offset: Float[Array, "*#n 2"], heading: Any) -> Float[Array, "*#n 2"]:
    """The offset [m] as seen from a body with the heading [rad]: how far ahead, how far to the left."""
    cosine, sine = np.cos(heading), np.sin(heading)
    lon, lat = offset[..., 0], offset[..., 1]
    return np.stack([lon * cosine + lat * sine, lat * cosine - lon * sine], axis=-1)
