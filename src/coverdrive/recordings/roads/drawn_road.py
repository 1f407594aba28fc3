"""A road from the bounds of its lanes in a map.

The left bound of one lane, smoothed, is the line along which the road is measured. Lanes beside it belong to the road
where they touch it: one that begins, ends, comes from a ramp or leaves on one is there as long as it is wide enough.
S is the number of stations, positions along the line at which the bounds are looked at.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.errors import DataError
from coverdrive.recordings.checks import LONGEST_ROAD
from coverdrive.recordings.roads.line_fit import fit_line
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import NARROWEST, LaneEdges, Road

STATION = 2.0
"""[m] between two stations"""

TOUCHING = 1.0
"""[m] between two lanes of one carriageway, at most"""

SHORTEST_LANE = 20.0
"""[m] along which a lane has to touch the road to be one of it"""

AT_END = 10.0
"""[m] from the ends of the road: the lanes of a cross-section do not end exactly side by side"""

ASIDE, INSIDE = 45.0, 0.2
"""[m] points farther from the line have nothing to do with the road, and [m] those that are as near to the centre of a
curve that one drives so little for 1 m of the line"""

EVEN = 0.05
"""[m] by which edges may differ from even ones that stand for them"""


class DrawnLane(NamedTuple):
    """Bounds of a lane in map coordinates [m], in the direction of travel."""

    left: Float[np.ndarray, "P 2"]
    right: Float[np.ndarray, "Q 2"]

    @staticmethod
    def around(centre: Float[np.ndarray, "P 2"], width: float) -> "DrawnLane":
        """The lane of a width [m] around a centre line, of which no two successive points are the same."""
        ahead = np.gradient(centre, axis=0)
        aside = np.stack([-ahead[:, 1], ahead[:, 0]], axis=-1) / np.hypot(*ahead.T)[:, None] * width / 2
        return DrawnLane(centre + aside, centre - aside)

    def cut(self, place: Float[np.ndarray, " 2"], behind: float, ahead: float) -> "DrawnLane":
        """The stretch from so far [m] behind what is nearest to a place [m] to so far ahead of it."""
        return DrawnLane(*(_cut(bound, place, behind, ahead) for bound in self))


def drawn_road(lanes: Sequence[DrawnLane], touching: float = TOUCHING) -> Road:
    """The road along the first of some lanes, with those beside it; its right edge is at lat = 0.

    Lanes that run against the direction of the first one, or are farther from the road than ``touching`` [m], are left
    out. A DataError if the road bends too sharply, or its first lane has no width.
    """
    line = fit_line(lanes[0].left)
    stations = np.linspace(0.0, line.length, max(2, round(line.length / STATION) + 1))
    bounds = [np.stack([_offsets(line, bound, stations) for bound in (lane.right, lane.left)]) for lane in lanes]
    own = bounds.pop(0)
    width = own[1] - own[0]
    width = width[np.abs(width) > EVEN]
    width = float(np.median(width)) if len(width) else 0.0
    if width < NARROWEST:
        problem = f"the lane that leads the road is {width:.2g} m wide"
        raise DataError(f"{problem}; expected at least {NARROWEST:g} m, its left bound left of its right one")
    inner = [np.interp(stations, stations[~np.isnan(edge)], edge[~np.isnan(edge)]) for edge in own]
    left = _outwards(inner[1], bounds, touching)
    right = _outwards(-inner[0], [-bound[::-1] for bound in bounds], touching)
    edges = np.stack([*(-edge for edge in reversed(right)), *left], axis=-1)
    usual = _usual(edges, len(right))
    road = Road(edges=usual - usual[0], length=line.length, line=replace(line, lat=float(-usual[0])))
    if np.abs(edges - usual).max() <= EVEN:
        return road
    return replace(road, changing=LaneEdges(stations, edges - usual[0]))


def _cut(
    bound: Float[np.ndarray, "P 2"], place: Float[np.ndarray, " 2"], behind: float, ahead: float
) -> Float[np.ndarray, "C 2"]:
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(bound, axis=0).T))])
    if not way[-1] <= LONGEST_ROAD:
        return bound
    dense = np.linspace(0.0, way[-1], max(2, round(way[-1]) + 1))
    points = np.stack([np.interp(dense, way, values) for values in bound.T], axis=-1)
    here = dense[np.argmin(np.hypot(*(points - place).T))]
    first, last = max(0.0, here - behind), min(way[-1], here + ahead)
    ways = np.concatenate([[first], way[(way > first) & (way < last)], [last]])
    return np.stack([np.interp(ways, way, values) for values in bound.T], axis=-1)


def _offsets(line: ReferenceLine, bound: Float[np.ndarray, "P 2"], stations: Float[np.ndarray, " S"]) -> np.ndarray:
    """lat [m] of a bound at every station, NaN where it is not beside the line or runs against it."""
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(bound, axis=0).T))])
    if way[-1] > LONGEST_ROAD:
        return np.full(len(stations), np.nan)
    grid = np.linspace(0.0, way[-1], max(2, round(way[-1]) + 1))
    lon, lat = line.to_road(*(np.interp(grid, way, values) for values in bound.T))
    beside = (lon > -AT_END) & (lon < line.length + AT_END) & (np.abs(lat) < ASIDE)
    forward = beside & (1 - line.curvature_at(lon) * lat > INSIDE) & (np.gradient(lon) > 0)
    kept = forward & (lon >= np.maximum.accumulate(np.where(forward, lon, -np.inf)))
    if kept.sum() < 2:
        return np.full(len(stations), np.nan)
    lon, lat = lon[kept], lat[kept]
    before = lat[0] if lon[0] < AT_END else np.nan
    after = lat[-1] if lon[-1] > line.length - AT_END else np.nan
    return np.interp(stations, lon, lat, left=before, right=after)


def _outwards(
    inner: Float[np.ndarray, " S"], bounds: Sequence[Float[np.ndarray, "2 S"]], touching: float
) -> list[np.ndarray]:
    """The edges [m] of the lanes to the left of an edge, from it outwards.

    Of the bounds (right, left) of lanes, those that touch the road are taken, the nearest first. Lanes that are there
    at different stations may lie in one column.
    """
    near = [bound for bound in bounds if np.any(bound[0] + bound[1] > 2 * inner)]
    near.sort(key=lambda bound: float(np.nanmedian((bound[0] + bound[1]) / 2 - inner)))
    columns: list[tuple[Float[np.ndarray, " S"], Bool[np.ndarray, " S"]]] = []
    outer = inner
    for bound in near:
        gap, width = bound[0] - outer, bound[1] - outer
        there = (gap <= touching) & (width > 0)
        if np.sum(there & (width >= NARROWEST)) * STATION < SHORTEST_LANE:
            continue
        column = len(columns)
        while column and not np.any(columns[column - 1][1] & there):
            column -= 1
        if column == len(columns):
            columns.append((outer, there))
        edge, taken = columns[column]
        columns[column] = np.where(there, bound[1], edge), taken | there
        outer = np.where(there, bound[1], outer)
    edges = [inner]
    for edge, _ in columns:
        edges.append(np.maximum(edges[-1], edge))
    return edges


def _usual(edges: Float[np.ndarray, "S E"], known: int) -> Float[np.ndarray, " E"]:
    """Edges [m] of lanes of the median width where each is at least `NARROWEST`, beside the median of a known edge."""
    widths = np.diff(edges, axis=-1)
    usual = np.nanmedian(np.where(widths >= NARROWEST, widths, np.nan), axis=0)
    across = np.concatenate([[0.0], np.cumsum(usual)])
    return across - across[known] + np.median(edges[:, known])
