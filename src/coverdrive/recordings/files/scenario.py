"""Opens CommonRoad scenarios, and checks what is in them where it enters: time, lanes, obstacles, planning problems."""

import logging
import re
import warnings
from collections.abc import Iterable, Iterator
from contextlib import suppress
from os.path import realpath
from pathlib import Path
from traceback import walk_tb
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from coverdrive.errors import DataError, RecordingError
from coverdrive.garbage import not_looking_for_garbage
from coverdrive.recordings.checks import FASTEST, LARGEST
from coverdrive.recordings.files.boundary import naming
from coverdrive.recordings.files.kinds import OTHERS
from coverdrive.recordings.tracks.reading import check_time_step

FARTHEST = 1e8
"""[m] coordinates of maps are smaller, and all other numbers, too"""

BACKWARDS, LONGEST_DRIVE = 1.0, 600.0
"""[m/s] that a recorded speed may be below 0 by noise, and [s] from the start of a planning problem to its goal"""

LARGEST_ID = 2**63
"""Numbers of planning problems are smaller"""

_PARTS = (
    "center", "rect_center", "circle_center", "length", "width", "radius", "orientation", "vertices", "shapes",
    "occupancies",
)  # fmt: skip
"""of shapes, by their names in all versions of commonroad-io"""

_SHIFTS = ("orientation", "originXShift", "center/x", "center/y")
"""of rectangles against the positions of their obstacles"""

_PLACED = "environmentObstacle"
"""has no position besides that of its shape"""

PROTOBUF = "CommonRoad scenarios in protobuf (.pb) are not read; write them as XML with commonroad-io"

STATED = "orientation", "position", "time", "velocity"
"""of every initial state, but for the velocity of what stands; commonroad-io takes 0 for what is missing"""


def scenarios_in(paths: Iterable[Path]) -> list[Path]:
    """Files, and those in folders that are scenarios by their suffix; each once, by the first of its names.

    Links in folders that lead nowhere are among them.
    """
    named = dict[str, Path]()
    for path in paths:
        for file in sorted(filter(_may_be_scenario, path.iterdir())) if path.is_dir() else [path]:
            named.setdefault(realpath(file), file)
    return list(named.values())


def _may_be_scenario(file: Path) -> bool:
    return file.suffix.lower() == ".xml" and (file.is_file() or not file.exists())


def is_protobuf(path: Path) -> bool:
    """Whether a file is a scenario in protobuf by its suffix, or a folder holds one."""
    return any(each.suffix.lower() == ".pb" for each in (path.iterdir() if path.is_dir() else [path]))


@not_looking_for_garbage()
def open_scenario(file: Path) -> tuple[Any, Any]:
    """The scenario and its planning problems as commonroad-io reads them, without its warnings, and checked.

    Raises:
        RecordingError: it cannot be read, or time, lanes or obstacles are none.
    """
    with naming(file):
        scenario, problems = _parsed(file, _checked_lines(file))
        check_time_step(file, float(scenario.dt), "the attribute timeStepSize")
        _check_lanelets(file, scenario.lanelet_network)
        for obstacle in (*scenario.static_obstacles, *scenario.dynamic_obstacles):
            _check_obstacle(file, obstacle)
        return scenario, problems


def _parsed(file: Path, lines: dict[str, int]) -> tuple[Any, Any]:
    logger = logging.getLogger("commonroad")
    level = logger.level
    try:
        logger.setLevel(logging.CRITICAL)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            from commonroad.common.reader.file_reader_xml import XMLFileReader

            return XMLFileReader(file).open()
    except OSError:
        raise
    except Exception as error:  # commonroad-io raises whatever the malformed place happens to trigger
        part, number = _part(error)
        problem = f"commonroad-io cannot read {part} ({type(error).__name__}: {error}); check the file"
        raise RecordingError(file, problem, lines.get(number)) from error
    finally:
        logger.setLevel(level)


def _part(error: Exception) -> tuple[str, str]:
    """The part of a scenario that was being read when an error was raised, and its number; empty if it has none.

    It is what the reader held last: the innermost XML element, and that around it which has a number.
    """
    held = [each for frame, _ in walk_tb(error.__traceback__) for each in frame.f_locals.values()]
    elements = [each for each in held if isinstance(each, ElementTree.Element)]
    if not elements:
        twice = re.search(r"ID (\d+) is already used", str(error))
        return "it", twice[1] if twice else ""
    inner = elements[-1]
    around = [each for each in elements if each.get("id") and inner in each.iter()]
    if not around:
        return f"its element {inner.tag}", ""
    whole = around[-1]
    name = f"the {whole.tag} {whole.get('id')}"
    return name if whole is inner else f"{inner.tag} of {name}", whole.get("id", "")


def _checked_lines(file: Path) -> dict[str, int]:
    """The line of each number in a CommonRoad file, in which all of `STATED` is stated.

    Bodies that are beside the positions of their obstacles or turned against them are refused, as some versions of
    commonroad-io read them as if they were not.
    """
    root, lines, ends = _elements(file)
    if root.tag != "commonRoad":
        raise RecordingError(file, f"not a CommonRoad file: expected the root element commonRoad, got {root.tag}")
    for parent in root.findall(".//initialState/.."):
        role = (parent.findtext("role") or "").strip() if parent.tag == "obstacle" else ""  # of 2018b
        whose = f"{role}Obstacle" if role else parent.tag
        for state in parent.findall("initialState"):
            for missing in (each for each in STATED if state.find(each) is None):
                if (missing, whose) != ("velocity", "staticObstacle"):
                    problem = f"the initial state of {'an' if whose == 'obstacle' else 'a'} {whose} has no {missing}"
                    raise RecordingError(file, f"{problem}; expected one, or leave it out", ends[state])
    for parent in root.findall(".//shape/.."):
        if parent.tag not in ("occupancy", _PLACED):
            for part in (part for place in _SHIFTS for part in parent.findall(f"shape//{place}")):
                if _number(part.text or ""):
                    problem = f"the body of a {parent.tag} is beside its position, or turned against it"
                    raise RecordingError(file, f"{problem}; expected its position in its middle", ends[part])
    return lines


def _elements(file: Path) -> tuple[ElementTree.Element, dict[str, int], dict[ElementTree.Element, int]]:
    """The root of a well-formed file without entities, which could make a small file huge.

    With it, the line on which what has each ``id`` begins, and that on which each element ends.
    """
    parser, builder = expat.ParserCreate(), ElementTree.TreeBuilder()
    lines, ends = dict[str, int](), dict[ElementTree.Element, int]()

    def refuse(*_: Any) -> None:
        raise RecordingError(file, "it declares a document type; expected none, remove it", parser.CurrentLineNumber)

    def opened(name: str, attributes: dict[str, str]) -> None:
        builder.start(name, attributes)
        if "id" in attributes:
            lines[attributes["id"]] = parser.CurrentLineNumber

    def closed(name: str) -> None:
        ends[builder.end(name)] = parser.CurrentLineNumber

    parser.StartElementHandler, parser.EndElementHandler = opened, closed
    parser.StartDoctypeDeclHandler, parser.CharacterDataHandler = refuse, builder.data
    parser.buffer_text = True
    try:
        parser.Parse(file.read_bytes(), True)
    except expat.ExpatError as error:
        begun = bool(lines or ends)
        if is_protobuf(file) and not begun:
            raise RecordingError(file, PROTOBUF) from None
        what = "it is cut or damaged" if begun else "it is no XML"
        problem = f"not a CommonRoad file: {what} ({expat.ErrorString(error.code)}); check that it was copied whole"
        raise RecordingError(file, problem, error.lineno) from None
    except (LookupError, ValueError) as error:  # of encodings
        raise RecordingError(file, f"not a CommonRoad file: {error}; expected UTF-8, save it so", 1) from None
    return builder.close(), lines, ends


def _number(text: str) -> float:
    """What a text says, 0 if that is no number, which commonroad-io complains of."""
    with suppress(ValueError):
        return float(text)
    return 0.0


def _check_lanelets(file: Path, network: Any) -> None:
    if not network.lanelets:
        raise RecordingError(file, "the scenario has no lanes; choose another file")
    for part in network.lanelets:
        if not all(np.all(np.abs(bound) < FARTHEST) for bound in (part.left_vertices, part.right_vertices)):
            problem = f"lanelet {part.lanelet_id} has a point that is not finite or beyond {FARTHEST:g} m"
            raise RecordingError(file, f"{problem}; check the coordinates")


def states_of(obstacle: Any) -> Iterator[Any]:
    """All states of an obstacle, None for those of predictions that have none."""
    yield obstacle.initial_state
    prediction = getattr(obstacle, "prediction", None)
    if prediction is not None:  # one of sets has no trajectory
        yield from getattr(getattr(prediction, "trajectory", None), "state_list", [None])


def has_sets(obstacle: Any) -> bool:
    """Whether sets of places tell where an obstacle is after its initial state, and no states."""
    prediction = getattr(obstacle, "prediction", None)
    return prediction is not None and not hasattr(prediction, "trajectory")


def sets_of(obstacle: Any) -> list[tuple[Any, Any]]:
    """Time steps of the sets of places of an obstacle, and their shapes, which versions of commonroad-io hold apart."""
    if (listed := getattr(obstacle.prediction, "occupancy_set", None)) is not None:
        return [(each.time_step, each.shape) for each in listed]
    return list(obstacle.prediction.occupancies.items())


def is_vehicle(obstacle: Any) -> bool:
    """Whether an obstacle is one of the vehicles of a motorway, and no other road user."""
    return obstacle.obstacle_type.value not in OTHERS


def _check_obstacle(file: Path, obstacle: Any) -> None:
    """Refuse sizes, times, places, headings and speeds that are no numbers, or none of this world."""
    name = f"obstacle {obstacle.obstacle_id}"
    if not abs(obstacle.obstacle_id) < LARGEST:
        raise RecordingError(file, f"{name} has no number below 2⁵³, as they are told apart; give it another one")
    for part in ("length", "width", "radius", "orientation", "vertices", "shapes"):
        value = getattr(obstacle.obstacle_shape, part, ())
        if not _are_numbers(value, 0.0 if part in ("length", "width", "radius") else -FARTHEST):
            raise RecordingError(file, f"the {part} of {name} is {value}; expected numbers below {FARTHEST:g}")
    for state in filter(None, states_of(obstacle)):
        for part in ("time_step", "position", "orientation", "velocity"):
            value = getattr(state, part, None)
            if not _are_numbers(value, 0.0 if part == "time_step" else -FARTHEST):
                least = "0 or more" if part == "time_step" else f"finite numbers below {FARTHEST:g}"
                found = f"the {part} of {name} at time step {state.time_step} is {value}"
                raise RecordingError(file, f"{found}; expected {least}, check the file or leave the obstacle out")
    for step, shape in sets_of(obstacle) if has_sets(obstacle) else ():
        if not (_are_numbers(step, 0.0) and _are_numbers(shape) and _has_size(shape)):
            problem = f"a set of places of {name}, at time step {step}, has no extent or numbers that are none"
            expected = f"a time step of 0 or more, and a shape of finite numbers below {FARTHEST:g}"
            raise RecordingError(file, f"{problem}; expected {expected}, check the file or leave the obstacle out")


def check_problem(problem: Any, dt: float) -> None:
    """Refuse a planning problem that nobody can drive.

    Args:
        problem: as commonroad-io reads it.
        dt: [s] time step.

    Raises:
        DataError: start or goal are not known, or are none of this world.
    """
    start, goals = problem.initial_state, problem.goal.state_list
    if not 0 <= problem.planning_problem_id < LARGEST_ID:
        raise DataError(f"its number is not between 0 and {LARGEST_ID:g}; give it another one")
    for part, (least, most) in {
        "time_step": (0.0, FARTHEST),
        "position": (-FARTHEST, FARTHEST),
        "orientation": (-FARTHEST, FARTHEST),
        "velocity": (-BACKWARDS, FASTEST),
    }.items():
        value = getattr(start, part, None)
        if not _are_numbers(value, least, most) or not isinstance(value, int | float | np.ndarray):
            raise DataError(f"the {part} of its start is {value}; expected exact numbers from {least:g} to {most:g}")
    if not goals:
        raise DataError("it has no goal; give it a state to be reached")
    latest = max(numbers_of(goal.time_step)[-1] for goal in goals) - start.time_step
    if not 0 < latest * dt <= LONGEST_DRIVE:
        expected = f"expected one later than the start, by {LONGEST_DRIVE:g} s at the most"
        raise DataError(f"its goal is at {latest * dt:g} s after the start; {expected}")
    for goal in goals:
        for part in goal.used_attributes:
            value = getattr(goal, part)
            if not _are_numbers(value) or not _has_size(value):
                raise DataError(f"the {part} of its goal is {value}; expected finite numbers, and sizes above 0")


def _has_size(value: Any) -> bool:
    """Whether a shape has an extent; an interval, which may be a single value, has the attribute ``length``, too."""
    parts = [] if hasattr(value, "start") else getattr(value, "occupancies", getattr(value, "shapes", [value]))
    return all(getattr(part, name, 1.0) > 0 for part in parts for name in ("length", "width", "radius"))


def _are_numbers(value: Any, least: float = -FARTHEST, most: float = FARTHEST) -> bool:
    return all(least <= number <= most for number in numbers_of(value))


def numbers_of(value: Any) -> list[float]:
    """The numbers that a value of commonroad-io is made of: itself, ends of an interval, coordinates of a shape."""
    if isinstance(value, int | float | np.number):
        return [float(value)]
    if hasattr(value, "start"):
        return [float(value.start), float(value.end)]
    if isinstance(value, Iterable):
        return [number for part in value for number in numbers_of(part)]
    if hasattr(value, "x"):
        return [float(value.x), float(value.y)]
    return [number for name in _PARTS if hasattr(value, name) for number in numbers_of(getattr(value, name))]
