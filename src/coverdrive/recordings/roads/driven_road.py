"""Of the roads in a map, the one that is driven on: along which the vehicles of a file drive farthest, ahead.

R is the number of rows.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from itertools import islice
from typing import Any

import numpy as np
import polars as pl

from coverdrive.errors import DataError
from coverdrive.recordings.checks import LONGEST_ROAD
from coverdrive.recordings.roads.drawn_road import DrawnLane, drawn_road
from coverdrive.recordings.roads.lanelets import carriageways
from coverdrive.recordings.tracks.repair import RawTracks, on_road
from coverdrive.road import Road

MOST_CARRIAGEWAYS = 20
"""of a map that are looked at, the longest and widest first"""


def roads_of(
    lanelets: list[Any],
    problems: list[str],
    through: Sequence[Collection[int]] = (),
    draw: Callable[[list[DrawnLane]], Road] = drawn_road,
) -> Iterator[Road]:
    """The roads of the carriageways of a lanelet network; ``problems`` gains why others are none.

    ``through`` is that of `carriageways`; ``draw`` makes the road of the lanes of each. A KeyError if a lanelet names
    one that is not there, a DataError if the network is none of lanes.
    """
    for lanes in islice(carriageways(lanelets, through), MOST_CARRIAGEWAYS):
        longest = max(float(np.sum(np.hypot(*np.diff(bound, axis=0).T))) for lane in lanes for bound in lane)
        if longest > LONGEST_ROAD:
            raise DataError(f"a lane is {longest:g} m long; expected up to {LONGEST_ROAD:g} m")
        try:
            road = draw(lanes)
        except DataError as error:
            problems.append(str(error))
            continue
        yield road


def driven_road(roads: Iterable[Road], rows: pl.DataFrame) -> tuple[Road, RawTracks] | None:
    """The road, and where the vehicles are on it; None if there is none.

    Rows are those of `RawTracks.placed`, with x and y [m] in map coordinates. No other road is looked for if vehicles
    are on one for most of their way.
    """
    best, farthest = None, -np.inf
    for road in roads:
        raw = RawTracks.placed(rows, *road.to_road(rows["x"], rows["y"]))
        there, same = on_road(raw, road), np.diff(raw.vehicle) == 0
        ahead = float(np.sum(np.diff(raw.lon) * same * there[1:]))
        if ahead > farthest:
            best, farthest = (road, raw), ahead
        if 2 * ahead > float(np.sum(np.hypot(np.diff(raw.lon), np.diff(raw.lat)) * same)):
            break
    return best
