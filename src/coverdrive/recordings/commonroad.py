"""CommonRoad scenarios (XML, 2018b and 2020a): recorded vehicles on lanelets, taken as one straight road.

The left boundary of the leftmost lane, smoothed, becomes the direction of the road; the lanes beside it keep the
median of their lateral offsets. Ramps that accompany the road for less than half of it are not part of it. Roads that
bend are refused.
"""

import logging
import warnings
from collections import Counter
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np
from jaxtyping import Float

from coverdrive.errors import RecordingError
from coverdrive.recordings.checks import LONGEST_ROAD
from coverdrive.recordings.reference_line import LARGEST_BEND, ReferenceLine, bend, reference_line
from coverdrive.recordings.repair import RawTracks, tidy
from coverdrive.recordings.smoothing import SmoothingSettings
from coverdrive.recordings.tracks import Reading, check_time_step, make_reading, name_of
from coverdrive.road import Road

ACCOMPANY = 0.5
"""Smallest share of the road's length that a lane must run beside it to be part of it"""

FARTHEST = 1e8
"""[m] coordinates of maps are smaller"""


def read_commonroad(file: Path, settings: SmoothingSettings | None = None) -> Reading:
    """Read the recorded vehicles of one scenario; obstacles of a single state have no track and are dropped."""
    scenario = _open(file)
    dt = float(scenario.dt)
    check_time_step(file, dt, "the attribute timeStepSize")
    try:
        lanes = _lanes(file, scenario.lanelet_network)
    except AttributeError:  # a lanelet that another one names is not there
        raise RecordingError(file, "a lanelet refers to one that is not in the file; check the file") from None
    line = _line(file, lanes)
    edges = _edges(lanes, line)
    road = Road(edges=(edges - edges[-1])[::-1].copy(), length=line.length)
    raw = _tracks(file, scenario.dynamic_obstacles, line, edges[-1])
    repairs: Counter[str] = Counter()
    tracks, how = tidy(raw, dt, repairs), settings or SmoothingSettings()
    return make_reading(file, name_of(file), tracks, dt, road, how, repairs, {"lanes": "map"})


def _open(file: Path) -> Any:
    """The scenario as commonroad-io reads it, without its warnings."""
    root = _root(file)
    if root != "commonRoad":
        raise RecordingError(file, f"not a CommonRoad file: expected the root element commonRoad, got {root}")
    from commonroad.common.file_reader import CommonRoadFileReader

    logger = logging.getLogger("commonroad")
    level = logger.level
    try:
        logger.setLevel(logging.CRITICAL)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return CommonRoadFileReader(file).open()[0]
    except OSError:
        raise
    except Exception as error:  # commonroad-io raises whatever the malformed place happens to trigger
        problem = f"commonroad-io cannot read it ({type(error).__name__}: {error}); check the file"
        raise RecordingError(file, problem) from error
    finally:
        logger.setLevel(level)


def _root(file: Path) -> str:
    """Name of the root element of a well-formed file without entities, which could make a small file huge."""
    names: list[str] = []
    parser = expat.ParserCreate()

    def refuse(*_: Any) -> None:
        raise RecordingError(file, "it declares a document type; expected none, remove it", parser.CurrentLineNumber)

    parser.StartElementHandler = lambda name, _: names.append(name)
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(file.read_bytes(), True)
    except expat.ExpatError as error:
        what = "it is cut or damaged" if names else "it is no XML"
        problem = f"not a CommonRoad file: {what} ({expat.ErrorString(error.code)}); check that it was copied whole"
        raise RecordingError(file, problem, error.lineno) from None
    return names[0]


def _lanes(file: Path, network: Any) -> list[list[Any]]:
    """The lanes of the main carriageway from left to right, each a chain of lanelets in the order of travel."""
    if not network.lanelets:
        raise RecordingError(file, "the scenario has no lanes; choose another file")
    for part in network.lanelets:
        if not all(np.all(np.abs(bound) < FARTHEST) for bound in (part.left_vertices, part.right_vertices)):
            problem = f"lanelet {part.lanelet_id} has a point that is not finite or beyond {FARTHEST:g} m"
            raise RecordingError(file, f"{problem}; check the coordinates")
    beside = [part for part in network.lanelets if part.adj_left is not None or part.adj_right is not None]
    part = max(beside or network.lanelets, key=lambda part: _length([part]))
    seen = {part.lanelet_id}
    while left := _beside(network, [part], "left"):
        part = left[0]
        _refuse_circle(file, part, seen)
    lanes = [_chain(network, _chain(network, part, "predecessor")[-1], "successor")]
    seen = {part.lanelet_id for part in lanes[0]}
    while right := _beside(network, lanes[-1], "right"):
        if _length(right) < ACCOMPANY * _length(lanes[0]):
            break
        for part in right:
            _refuse_circle(file, part, seen)
        lanes.append(right)
    return lanes


def _refuse_circle(file: Path, lanelet: Any, seen: set[int]) -> None:
    if lanelet.lanelet_id in seen:
        raise RecordingError(file, f"lanelet {lanelet.lanelet_id} lies beside itself; check the adjacent lanelets")
    seen.add(lanelet.lanelet_id)


def _line(file: Path, lanes: list[list[Any]]) -> ReferenceLine:
    """The left boundary of the leftmost lane, which must be straight."""
    left = np.concatenate([part.left_vertices for part in lanes[0]])
    if not 1.0 <= np.sum(np.hypot(*np.diff(left, axis=0).T)) <= LONGEST_ROAD:
        raise RecordingError(file, f"the road is not between 1 m and {LONGEST_ROAD:g} m long; check the coordinates")
    turned = np.degrees(bend(left))
    if turned > LARGEST_BEND:
        found = f"the road bends by {turned:.0f}°; only roads that bend by at most {LARGEST_BEND:g}° can be read so far"
        raise RecordingError(file, f"{found}: choose a straight one, or cut the scenario")
    return reference_line(left)


def _length(lane: list[Any]) -> float:
    """Length of a lane [m]."""
    return sum(float(part.distance[-1]) for part in lane)


def _chain(network: Any, lanelet: Any, direction: str) -> list[Any]:
    """A lanelet and all that follow in a direction, the longest one at every fork."""
    chain = [lanelet]
    while numbers := getattr(chain[-1], direction):
        longest = max(map(network.find_lanelet_by_id, numbers), key=lambda part: _length([part]))
        if longest in chain:
            break
        chain.append(longest)
    return chain


def _beside(network: Any, lane: list[Any], side: str) -> list[Any]:
    """The lanelets directly left or right of a lane that are driven in the same direction."""
    numbers = [getattr(part, f"adj_{side}") for part in lane if getattr(part, f"adj_{side}_same_direction")]
    return [network.find_lanelet_by_id(number) for number in numbers if number is not None]


def _edges(lanes: list[list[Any]], line: ReferenceLine) -> Float[np.ndarray, " edges"]:
    """Median lateral offsets [m] from the line of the lane boundaries, from left to right."""
    offsets: list[float] = []
    bounds = [[part.left_vertices for part in lanes[0]], *([part.right_vertices for part in lane] for lane in lanes)]
    for bound in bounds:
        lon, lat = line.project(np.concatenate(bound)).T
        order = np.argsort(lon, kind="stable")
        even = np.linspace(lon.min(), lon.max(), 200)
        offsets.append(float(np.median(np.interp(even, lon[order], lat[order]))))
    return np.array(offsets)


def _tracks(file: Path, obstacles: list[Any], line: ReferenceLine, right: float) -> RawTracks:
    """The recorded states of all vehicles, with lat = 0 at the offset ``right`` [m] from the line."""
    rows: list[tuple[float, ...]] = []
    for obstacle in obstacles:
        shape, name = obstacle.obstacle_shape, f"obstacle {obstacle.obstacle_id}"
        if not hasattr(shape, "width"):
            raise RecordingError(file, f"{name} has the shape {type(shape).__name__}; expected a rectangle")
        states = [obstacle.initial_state]
        if obstacle.prediction is not None:  # one of sets has no trajectory
            states += getattr(getattr(obstacle.prediction, "trajectory", None), "state_list", [None])
        for state in states:
            if not _is_exact(state):
                raise RecordingError(file, f"{name} has uncertain states; expected exact, recorded ones")
            size = (shape.length, shape.width)
            row = (obstacle.obstacle_id, *size, state.time_step, *state.position, state.velocity)
            if not all(-FARTHEST < number < FARTHEST for number in row):
                found = f"number, size, time step, position and speed of {name} are {row}"
                raise RecordingError(file, f"{found}; expected numbers below {FARTHEST:g}, check the file")
            rows.append(row)
    if not rows:
        raise RecordingError(file, "the scenario has no recorded vehicles; choose another file")
    table = np.array(rows, dtype=np.float64)
    vehicle, length, width, moment, _, _, speed = table.T.copy()
    lon, lat = line.project(table[:, 4:6]).T
    whole = vehicle.astype(np.int64)
    return RawTracks(whole, moment.astype(np.int64), lon, lat - right, length, width, speed, np.zeros_like(whole))


def _is_exact(state: Any) -> bool:
    """Whether time, position and speed of a state are known, and not sets of possible ones."""
    numbers = (getattr(state, name, None) for name in ("time_step", "velocity"))
    position = getattr(state, "position", None)
    exact = isinstance(position, np.ndarray) and position.shape == (2,)
    return exact and all(isinstance(number, int | float) for number in numbers)
