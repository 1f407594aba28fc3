"""CommonRoad scenarios (XML, 2018b and 2020a): recorded vehicles on the carriageways of a lanelet network.

Each carriageway that vehicles have for themselves becomes a recording, the one that is driven farthest first. The road
comes from the bounds of the lanelets (`coverdrive.recordings.roads.lanelets`,
`coverdrive.recordings.roads.drawn_road`).
"""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import tee
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from coverdrive.errors import NoVehiclesError, RecordingError
from coverdrive.recordings.files.kinds import NUMBER_OF
from coverdrive.recordings.files.scenario import is_vehicle, open_scenario, states_of
from coverdrive.recordings.formats.reader import AS_USUAL, How
from coverdrive.recordings.roads.driven_road import driven_road, roads_of
from coverdrive.recordings.tracks.reading import MOST_BESIDE, Reading, make_reading, name_of
from coverdrive.recordings.tracks.repair import RawTracks, on_road, tidy
from coverdrive.road import Road

LEFT = "AUS BGD CYP GBR HKG IDN IND IRL JPN KEN LKA MLT MYS NZL PAK SGP THA UGA ZAF ZMB ZWE"
"""Countries (ISO 3166) in which one drives on the left"""

COLUMNS = pl.Schema(
    {"vehicle": pl.Int64, "moment": pl.Int64, "length": pl.Float64, "width": pl.Float64, "kind": pl.Int8}
    | dict.fromkeys(("x", "y", "speed"), pl.Float64)
)
"""Vehicles at a time step: sizes and map coordinates [m], speed [m/s], and number in `KINDS`"""

STEP = 5.0
"""[m] between two places at which two roads are compared"""


def read_commonroad(file: Path, how: How = AS_USUAL) -> tuple[Reading, ...]:
    """Read the recorded vehicles of one scenario; obstacles of a single state have no track and are dropped."""
    scenario = open_scenario(file)[0]
    dt = float(scenario.dt)
    repairs: Counter[str] = Counter()
    rows = _rows(file, scenario.dynamic_obstacles, repairs)
    side = "left" if scenario.scenario_id.country_id in LEFT else "right"
    limit = speed_limit(scenario.lanelet_network)

    def reading(name: str, road: Road, raw: RawTracks, repairs: Counter[str]) -> Reading:
        road, tracks = replace(road, side=side, speed_limit=limit), tidy(raw, dt, repairs)
        return make_reading(file, name, tracks, dt, road, how.smoothing, repairs, {"lanes": "map"})

    problems: list[str] = []
    (road, raw), *others = _driven(file, scenario.lanelet_network.lanelets, rows, problems)
    name, apart = name_of(file), list[Reading]()
    for other, own in others:
        with suppress(RecordingError):  # too little for a recording: left with the rows off the road
            apart.append(reading(f"{name} carriageway {len(apart) + 2}", other, own, Counter()))
    for each in apart:
        raw = raw.take(~np.isin(raw.vehicle, each.raw.vehicle))
    if problems and on_road(raw, road).mean() <= MOST_BESIDE:
        raise RecordingError(file, problems[0])
    return (reading(name, road, raw, repairs), *apart)


def _driven(file: Path, lanelets: list[Any], rows: pl.DataFrame, problems: list[str]) -> list[tuple[Road, RawTracks]]:
    """The roads of the network that are driven on, with all vehicles on the main one and their own on the others.

    ``problems`` gains why parts of the network are no road; it is refused if none is.
    """
    try:
        first, others = tee(roads_of(lanelets, problems))
        found = driven_road(first, rows)
        if found is None:
            raise RecordingError(file, problems[0])
        return [found, *_apart(others, rows, *found)]
    except KeyError as error:
        (other,) = error.args
        by = next(
            part for part in lanelets if other in (*part.predecessor, *part.successor, part.adj_left, part.adj_right)
        )
        problem = f"lanelet {by.lanelet_id} refers to {other}, which is not in the file; check the file"
        raise RecordingError(file, problem) from error


def _apart(roads: Iterable[Road], rows: pl.DataFrame, road: Road, raw: RawTracks) -> Iterator[tuple[Road, RawTracks]]:
    """Other carriageways, with the vehicles that are on none before: long ones that touch none before, as ramps do."""
    roads = (other for other in roads if other.length > road.length / 2)
    left = rows.filter(~np.isin(raw.vehicle, raw.vehicle[on_road(raw, road)]))
    while len(left):
        roads = [other for other in roads if not _touch(other, road)]
        found = driven_road(roads, left)
        if found is None or not (there := on_road(found[1], found[0])).any():
            return
        road, raw = found
        own = np.isin(raw.vehicle, raw.vehicle[there])
        yield road, raw.take(own)
        left = left.filter(~own)


def _touch(one: Road, other: Road) -> bool:
    """Whether a lane of one road runs on the other, somewhere."""
    lon = np.arange(0.0, float(one.length), STEP)[:, None]
    edges = one.edges_at(lon[:, 0])
    there = one.has_lane(lon[:, 0])
    at, lat = other.to_road(
        *one.to_map(np.broadcast_to(lon, there.shape)[there], ((edges[:, 1:] + edges[:, :-1]) / 2)[there])
    )
    inside, limits = (at >= 0) & (at <= other.length), other.edges_at(at)
    return bool(np.any(inside & (lat > limits[:, 0]) & (lat < limits[:, -1])))


def speed_limit(network: Any, through: Collection[int] = ()) -> float | None:
    """[m/s] that holds on most of the lanelets that have a limit, of those with the numbers ``through`` if given."""
    limits = dict[float, float]()
    for part in (each for each in network.lanelets if not through or each.lanelet_id in through):
        signs = map(network.find_traffic_sign_by_id, part.traffic_signs)
        for element in (each for sign in signs if sign is not None for each in sign.traffic_sign_elements):
            with suppress(ValueError, IndexError):
                if element.traffic_sign_element_id.name == "MAX_SPEED":
                    limit = float(element.additional_values[0])
                    limits[limit] = limits.get(limit, 0.0) + float(part.distance[-1])
    return max(limits, key=lambda limit: limits[limit], default=None)


def _rows(file: Path, obstacles: list[Any], repairs: Counter[str]) -> pl.DataFrame:
    """The columns of `COLUMNS`, for all vehicles at all times.

    ``repairs`` gains ``rows of other road users``, which are left out.
    """
    rows: list[tuple[float, ...]] = []
    for obstacle in obstacles:
        shape, name = obstacle.obstacle_shape, f"obstacle {obstacle.obstacle_id}"
        kind, states = obstacle.obstacle_type.value, list(states_of(obstacle))
        if not is_vehicle(obstacle):
            repairs["rows of other road users"] += len(states)
            continue
        if not hasattr(shape, "width"):
            raise RecordingError(file, f"{name} has the shape {type(shape).__name__}; expected a rectangle")
        for state in states:
            if not _is_exact(state):
                raise RecordingError(file, f"{name} has uncertain states; expected exact, recorded ones")
            about = (obstacle.obstacle_id, state.time_step, shape.length, shape.width, NUMBER_OF.get(kind, 0))
            rows.append((*about, *state.position, state.velocity))
    if not rows:
        raise NoVehiclesError(file, "the scenario has no recorded vehicles; choose another file")
    table = pl.DataFrame(np.array(rows, dtype=np.float64), schema=list(COLUMNS)).cast(COLUMNS)
    if not (table["vehicle"].unique_counts() > 2).any():
        problem = "no vehicle is there at more than two time steps: an interactive scenario, or one of single states"
        raise NoVehiclesError(file, f"{problem}; choose one with recorded tracks")
    return table


def _is_exact(state: Any) -> bool:
    """Whether time, position and speed of a state are known, and not sets of possible ones."""
    numbers = (getattr(state, name, None) for name in ("time_step", "velocity"))
    position = getattr(state, "position", None)
    exact = isinstance(position, np.ndarray) and position.shape == (2,)
    return exact and all(isinstance(number, int | float) for number in numbers)
