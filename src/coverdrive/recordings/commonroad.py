"""CommonRoad scenarios (XML, 2018b and 2020a): recorded vehicles on lanelets, taken as one straight road.

The left boundary of the leftmost lane, smoothed, becomes the direction of the road; the lanes beside it keep the
median of their lateral offsets. Ramps that accompany the road for less than half of it are not part of it.
"""

from collections import Counter
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float

from coverdrive.errors import RecordingError
from coverdrive.recordings.reference_line import ReferenceLine, reference_line
from coverdrive.recordings.smoothing import SmoothingSettings
from coverdrive.recordings.tracks import RawTracks, Reading, make_reading
from coverdrive.road import Road

ACCOMPANY = 0.5
"""Smallest share of the road's length that a lane must run beside it to be part of it"""


def read_commonroad(file: Path, settings: SmoothingSettings | None = None) -> Reading:
    """Read the recorded vehicles of one scenario; obstacles of a single state have no track and are dropped.

    Args:
        file: a CommonRoad scenario in XML.
        settings: how positions are smoothed.

    Raises:
        RecordingError: when the file is no CommonRoad scenario, or has no lanes or no recorded vehicles.

    """
    scenario = _open(file)
    lanes = _lanes(file, scenario.lanelet_network)
    line = reference_line(np.concatenate([part.left_vertices for part in lanes[0]]))
    edges = _edges(lanes, line)
    road = Road(edges=(edges - edges[-1])[::-1].copy(), length=line.length)
    raw = _tracks(file, scenario.dynamic_obstacles, line, edges[-1])
    dt, chosen = float(scenario.dt), settings or SmoothingSettings()
    return make_reading(file, file.stem, raw, dt, road, chosen, Counter())


def _open(file: Path) -> Any:
    """The scenario as commonroad-io reads it."""
    try:
        with file.open("rb") as stream:
            root = next(ElementTree.iterparse(stream, events=("start",)))[1].tag
    except (ElementTree.ParseError, StopIteration):
        raise RecordingError(file, "not a CommonRoad file: it is no XML; check that it was copied whole") from None
    if root != "commonRoad":
        raise RecordingError(file, f"not a CommonRoad file: expected the root element commonRoad, got {root}")
    from commonroad.common.file_reader import CommonRoadFileReader

    try:
        return CommonRoadFileReader(file).open()[0]
    except Exception as error:  # commonroad-io raises whatever the malformed place happens to trigger
        raise RecordingError(
            file, f"commonroad-io cannot read it ({type(error).__name__}: {error}); check the file"
        ) from error


def _lanes(file: Path, network: Any) -> list[list[Any]]:
    """The lanes of the main carriageway from left to right, each a chain of lanelets in the order of travel."""
    if not network.lanelets:
        raise RecordingError(file, "the scenario has no lanes; choose another file")
    beside = [part for part in network.lanelets if part.adj_left is not None or part.adj_right is not None]
    part = max(beside or network.lanelets, key=lambda part: float(part.distance[-1]))
    while left := _beside(network, [part], "left"):
        part = left[0]
    lanes = [_chain(network, _chain(network, part, "predecessor")[-1], "successor")]
    while right := _beside(network, lanes[-1], "right"):
        if _length(right) < ACCOMPANY * _length(lanes[0]):
            break
        lanes.append(right)
    return lanes


def _length(lane: list[Any]) -> float:
    """Length of a lane [m]."""
    return sum(float(part.distance[-1]) for part in lane)


def _chain(network: Any, lanelet: Any, direction: str) -> list[Any]:
    """A lanelet and all that follow in a direction, the longest one at every fork."""
    chain = [lanelet]
    while numbers := getattr(chain[-1], direction):
        longest = max(map(network.find_lanelet_by_id, numbers), key=lambda part: float(part.distance[-1]))
        if longest in chain:
            break
        chain.append(longest)
    return chain


def _beside(network: Any, lane: list[Any], side: str) -> list[Any]:
    """The lanelets directly left or right of a lane that are driven in the same direction."""
    return [
        network.find_lanelet_by_id(getattr(part, f"adj_{side}"))
        for part in lane
        if getattr(part, f"adj_{side}") is not None and getattr(part, f"adj_{side}_same_direction")
    ]


def _edges(lanes: list[list[Any]], line: ReferenceLine) -> Float[np.ndarray, " edges"]:
    """Median lateral offsets [m] from the line of the lane boundaries, from left to right."""
    offsets: list[float] = []
    bounds = [[part.left_vertices for part in lanes[0]]]
    bounds += [[part.right_vertices for part in lane] for lane in lanes]
    for bound in bounds:
        lon, lat = line.project(np.concatenate(bound)).T
        order = np.argsort(lon, kind="stable")
        even = np.linspace(lon.min(), lon.max(), 200)
        offsets.append(float(np.median(np.interp(even, lon[order], lat[order]))))
    return np.array(offsets)


def _tracks(file: Path, obstacles: list[Any], line: ReferenceLine, right: float) -> RawTracks:
    """The recorded states of all vehicles, with lat = 0 at the offset ``right`` [m] from the line."""
    vehicle: list[int] = []
    moment: list[int] = []
    position: list[Float[np.ndarray, " 2"]] = []
    measures: list[tuple[float, float, float]] = []
    for obstacle in obstacles:
        shape = obstacle.obstacle_shape
        if not hasattr(shape, "width"):
            raise RecordingError(
                file,
                f"obstacle {obstacle.obstacle_id} has the shape {type(shape).__name__}; expected a rectangle",
            )
        states = [obstacle.initial_state]
        if obstacle.prediction is not None:
            states += obstacle.prediction.trajectory.state_list
        if not all(_is_exact(state) for state in states):
            raise RecordingError(
                file, f"obstacle {obstacle.obstacle_id} has uncertain states; expected exact, recorded ones"
            )
        vehicle += [obstacle.obstacle_id] * len(states)
        moment += [state.time_step for state in states]
        position += [state.position for state in states]
        measures += [(shape.length, shape.width, state.velocity) for state in states]
    if not vehicle:
        raise RecordingError(file, "the scenario has no recorded vehicles; choose another file")
    lon, lat = line.project(np.array(position)).T
    length, width, speed = np.array(measures, dtype=np.float64).T
    group = np.zeros(len(vehicle), dtype=np.int64)
    return RawTracks(np.array(vehicle), np.array(moment), lon, lat - right, length, width, speed, group)


def _is_exact(state: Any) -> bool:
    """Whether position and speed of a state are known, and not sets of possible ones."""
    return isinstance(state.position, np.ndarray) and isinstance(state.velocity, int | float)
