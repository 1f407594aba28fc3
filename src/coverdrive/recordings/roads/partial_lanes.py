"""Lanes that begin or end, such as those of ramps, told from where vehicles drive.

A lane in which nobody is seen may only be empty. It ends where most of its vehicles are seen to leave it and none goes
on in it, and begins where most come to be in it and none was before; by a few vehicles that cannot be told. R is the
number of rows, V of vehicles, L of lanes.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from coverdrive.recordings.roads.lanes import NARROWEST, RARE, WIDEST
from coverdrive.recordings.tracks.repair import RawTracks
from coverdrive.road import LaneEdges

ENOUGH, MOST = 5, 0.5
"""Vehicles, and share of those of a lane, that have to be seen to leave it: if it went on, and at least 45 % of such
vehicles stayed in it, the chance that none of five does would be 5 %"""

INSIDE = 50.0
"""[m] from the first or last place at which the lanes beside are seen: one that is seen up to there goes on; and the
shortest lane that is looked for"""

STRAY = 0.05
"""Share of its vehicles that may be in a lane before it begins, and after it ends"""

AT_ONCE = 20.0
"""[m] within which vehicles come into view, or leave it, on a ramp that comes to the road, or leaves it"""

TAPER = 30.0
"""[m] over which a lane widens before the first vehicles in it, and narrows after the last ones"""


class Lanes(NamedTuple):
    """Lanes between edges that count from the right edge of the road."""

    right: float
    """[m] where that is in the frame in which they were looked for"""
    edges: Float[np.ndarray, " E"]
    """[m] the usual ones, from right to left"""
    changing: LaneEdges | None
    """None if all lanes go on"""
    told: str
    """how many begin or end on which side, for people; empty if none does"""


class _Extent(NamedTuple):
    """A lane that begins or ends."""

    place: Float[np.ndarray, " 2"]
    """[m] where it begins and ends, infinite where it goes on"""
    width: float
    """[m]"""


def with_partial_lanes(parts: Sequence[RawTracks], edges: Float[np.ndarray, " E"]) -> Lanes:
    """Which outer lanes begin or end, and one more on either side where vehicles drive that leave it, or come to it.

    Args:
        parts: tracks in one frame, each sorted by vehicle.
        edges: [m] of the lanes that are known, from right to left; one of them at least is taken as going on.

    """
    starts = np.concatenate([np.diff(part.vehicle, prepend=-1) != 0 for part in parts]).nonzero()[0]
    lon, lat = (np.concatenate([getattr(part, name) for part in parts]) for name in ("lon", "lat"))
    places = np.tile([-np.inf, np.inf], (len(edges) - 1, 1))
    for side in (1, -1):  # the right side, then the left one, as if it were the right one
        ordered, there = side * edges[::side], places[::side]
        for lane in range(int(np.isinf(places).all(axis=1).sum()) - 1):
            found = _extent(starts, lon, ordered[lane + 1] - side * lat)
            if found is None or (lane and not _holds(found.place, there[lane - 1])):
                break
            there[lane] = found.place
        if np.isinf(there[0]).all() and (found := _extent(starts, lon, ordered[0] - side * lat)) is not None:
            edges = side * np.insert(ordered, 0, ordered[0] - found.width)[::side]
            places = np.insert(there, 0, found.place, axis=0)[::side]
    right, edges = float(edges[0]), edges - edges[0]
    whole = np.flatnonzero(np.isinf(places).all(axis=1))
    sides = {"right": int(whole[0]), "left": int(len(places) - 1 - whole[-1])}
    told = "".join(f"; begin or end on the {side}: {count}" for side, count in sides.items() if count)
    return Lanes(right, edges, _changing(edges, places, int(whole[0])) if told else None, told)


def _holds(outer: Float[np.ndarray, " 2"], inner: Float[np.ndarray, " 2"]) -> bool:
    """Whether one place is within another."""
    return bool(outer[0] <= inner[0] and inner[1] <= outer[1])


def _extent(
    starts: Int[np.ndarray, " V"], lon: Float[np.ndarray, " R"], out: Float[np.ndarray, " R"]
) -> _Extent | None:
    """Where the lane beyond an edge begins and ends; None if there is none, or it goes on.

    ``starts`` are the first rows of the vehicles, ``out`` [m] is how far each is beyond the edge. Those who were never
    wholly across it count as in the lanes beside.
    """
    inside, beside = (out > 0) & (out <= WIDEST), out <= 0
    own = np.maximum.reduceat(np.where(inside, out, 0.0), starts) >= NARROWEST / 2
    if own.sum() < max(ENOUGH, RARE * len(starts)) or not beside.any():
        return None
    inside &= np.repeat(own, np.diff(starts, append=len(lon)))
    width = 2 * float(np.median(out[inside]))
    entered, left = (np.where(inside, lon, far) for far in (np.inf, -np.inf))
    entered, left = np.minimum.reduceat(entered, starts)[own], np.maximum.reduceat(left, starts)[own]
    first, last = np.minimum.reduceat(lon, starts)[own], np.maximum.reduceat(lon, starts)[own]
    begin, end = np.quantile(entered, STRAY, method="lower"), np.quantile(left, 1 - STRAY, method="higher")
    came = (first < begin) | ((first == entered) & (first <= begin + AT_ONCE))
    went = (last > end) | ((last == left) & (last >= end - AT_ONCE))
    late, early = begin > lon[beside].min() + INSIDE, end < lon[beside].max() - INSIDE
    enough = max(ENOUGH, MOST * len(first))
    begins, ends = late and came.sum() >= enough, early and went.sum() >= enough
    if not (begins or ends) or end - begin < INSIDE or width < NARROWEST:
        return None
    return _Extent(np.array([begin if late else -np.inf, end if early else np.inf]), min(width, WIDEST))


def _changing(edges: Float[np.ndarray, " E"], places: Float[np.ndarray, "L 2"], whole: int) -> LaneEdges:
    """The edges of lanes that are there in places [m] and as wide as usual, beside one that goes on."""
    outer = places + TAPER * np.array([-1.0, 1.0])
    lon = np.unique(np.concatenate([places, outer])[np.isfinite(np.concatenate([places, outer]))])
    share = np.minimum(lon[:, None] - outer[:, 0], outer[:, 1] - lon[:, None]) / TAPER
    widths = np.diff(edges) * share.clip(0.0, 1.0)
    lat = np.insert(np.cumsum(widths, axis=1), 0, 0.0, axis=1)
    return LaneEdges(lon, lat - lat[:, [whole]] + edges[whole])
