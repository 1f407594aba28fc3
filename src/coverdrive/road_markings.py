"""The lines on a road from above, in its frame, which is drawn flat: unrolled where it bends. E edges."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.road import Road

_DASH, _PERIOD = 3.0, 12.0
"""[m] length of a dash, and from one to the next (MUTCD: 10 ft of 40 ft)"""

BEND = 1.0
"""[degrees] by which a road bends to be told as unrolled"""


class Marking(NamedTuple):
    """A line along the road."""

    points: Float[np.ndarray, "n 2"]
    """[m] lon and lat"""
    outer: bool
    """whether the road ends there"""


def across(road: Road) -> tuple[float, float]:
    """lat [m] of the rightmost and of the leftmost point of a road."""
    edges = np.asarray(road.edges if road.changing is None else road.changing.lat)
    return float(edges.min()), float(edges.max())


def stations(road: Road, first: float, last: float) -> Float[np.ndarray, " S"]:
    """Positions [m] between which the edges of a road are straight, from the first to the last."""
    inside = (
        [] if road.changing is None else road.changing.lon[(road.changing.lon > first) & (road.changing.lon < last)]
    )
    return np.concatenate([[first], inside, [last]])


def drawn_edges(road: Road, lon: Float[np.ndarray, " n"]) -> Bool[np.ndarray, "n E"]:
    """Which edges are lines at positions [m]: the outermost ones, and those with lanes on both sides."""
    there = road.has_lane(lon)
    right, left = (np.logical_or.accumulate(side, axis=1) for side in (there, there[:, ::-1]))
    always = np.ones((len(lon), 1), dtype=bool)
    return np.concatenate([always, right[:, :-1] & left[:, -2::-1], always], axis=1)


def markings(road: Road, first: float, last: float) -> list[Marking]:
    """All lines between two positions [m], the borders of the road first."""
    lon = stations(road, first, last)
    edges, drawn = road.edges_at(lon), drawn_edges(road, lon)
    found: list[Marking] = []
    for edge in (0, road.lanes, *range(1, road.lanes)):
        points, turns = np.stack([lon, edges[:, edge]], axis=-1), np.flatnonzero(np.diff(drawn[:, edge])) + 1
        for start, end in pairwise([0, *turns.tolist(), len(lon)]):
            if drawn[start, edge] and end - start > 1:
                found.append(Marking(points[start:end], edge in (0, road.lanes)))
    return found


def dashes(road: Road, first: float, last: float) -> Float[np.ndarray, "n 2 2"]:
    """Both ends [m] of the dashes of all lines within the road between two positions [m]; they stand still on it."""
    start = _PERIOD * np.arange(np.floor(first / _PERIOD), last / _PERIOD)
    lon = np.stack([start, start + _DASH], axis=-1)
    drawn = np.logical_and(*(drawn_edges(road, each) for each in lon.T))
    lines = np.stack(np.broadcast_arrays(lon[..., None], road.edges_at(lon)), axis=-1)[:, :, 1:-1].swapaxes(1, 2)
    return lines[drawn[:, 1:-1]]


def bends(road: Road) -> bool:
    """Whether it is to be said that a road is unrolled."""
    return road.line is not None and bool(np.degrees(road.line.bend) > BEND)


def ahead_label(road: Road) -> str:
    """What the axis along a road says."""
    return f"distance ahead of the ego{' along the road, which is drawn unrolled' * bends(road)} [m]"
