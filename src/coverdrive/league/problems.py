"""Planning problems of CommonRoad scenarios as a world of the league: trial i is the i-th of them, for everybody.

A world is named ``commonroad:PATHS``: scenarios, folders or patterns with commas between them. They are driven in a BMW
320i as a kinematic single-track model, by ``commonroad-st:PATHS`` as a dynamic one, and the drivability checker judges.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from glob import glob
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from coverdrive.certificates.certificate import fingerprint
from coverdrive.driving.planning_problem import PlanningProblem, read_problems
from coverdrive.driving.single_track import ModelName
from coverdrive.driving.solved import solve_problem
from coverdrive.driving.solving import settings_for
from coverdrive.errors import DataError, MissingExtraError, RecordingError
from coverdrive.league.entrants import Known, Place, Seat, entrant
from coverdrive.league.fiss import FISS
from coverdrive.league.fiss import drive as drive_fiss
from coverdrive.plan import Planner
from coverdrive.progress import heard_by
from coverdrive.recordings.files.scenario import scenarios_in
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.trial import SCHEMA, Row, measure, unstarted
from coverdrive.simulation.studies.setup import described, identity, made

MODELS: dict[str, ModelName] = {"commonroad": "KS", "commonroad-st": "ST"}
"""vehicle models, by how the names of worlds begin"""

COLUMNS = pl.Schema(
    SCHEMA
    | {"scenario": pl.String(), "problem": pl.Int64(), "solved": pl.Boolean(), "off_road": pl.Boolean()}
    | {"progress": pl.Float64()}
)
"""of the rows: those of trials, of which ``reason`` says why a problem is not solved; and ``progress``, the share of
the way to the place of the goal, null where there is none"""

_CHECKER = "pip install '.[commonroad]'"
_NUMBER = re.compile(rb'<planningProblem\s[^>]*\bid="(\d+)"')

Read = Callable[[Path], dict[int, PlanningProblem | str]]
"""the problems of a scenario by number, or why one cannot be driven"""


@dataclass(frozen=True, eq=False)
class Problems:
    """The planning problems of a world."""

    model: ModelName
    places: tuple[tuple[Path, int], ...]
    """scenario and number of each"""
    known: tuple[Known, ...] = ()
    """what entrants are made of, for each, if it is not the same as elsewhere"""

    @property
    def files(self) -> tuple[Path, ...]:
        """The scenario of each."""
        return tuple(file for file, _ in self.places)

    def drives(self, name: str, known: Known, seed: int) -> "DrivesOfProblems | str":
        """The drives of an entrant, or why there are none."""
        refused = entrant(name)(known, Place(known.planner, problems=True))
        return refused if isinstance(refused, str) else DrivesOfProblems(self, name, known, seed)


def is_problems(world: str) -> bool:
    """Whether a world is one of planning problems, by its name."""
    return ":" in world and world.partition(":")[0] in MODELS


def problems_of(world: str) -> Problems:
    """The planning problems that a world names.

    Raises:
        DataError: there are none.
        MissingExtraError: the drivability checker is not installed.
    """
    if find_spec("commonroad_dc") is None:
        raise MissingExtraError(f"{world} needs the CommonRoad drivability checker; install it with `{_CHECKER}`")
    kind, _, paths = world.partition(":")
    found = [Path(file) for each in paths.split(",") for file in sorted(glob(each)) or [each]]  # noqa: PTH207
    places = tuple((file, number) for file in scenarios_in(found) for number in sorted(_numbers(file)))
    if not places:
        raise DataError(f"{world} names no planning problems; expected scenarios or folders, as in {kind}:scenarios/")
    return Problems(MODELS[kind], places)


def _numbers(file: Path) -> list[int]:
    """Those of the planning problems in a file, in its order."""
    return [int(each) for each in _NUMBER.findall(_content(file))]


def _content(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        raise DataError(f"{file} cannot be read ({error.strerror}); name scenarios, folders or patterns") from error


@dataclass(frozen=True, eq=False)
class DrivesOfProblems:
    """Drives of one entrant; implements `coverdrive.simulation.studies.workers.Drives`."""

    problems: Problems
    entrant: str
    """its name"""
    known: Known
    """what it is made of, unless the problems say otherwise"""
    seed: int
    """of nothing but the rows: who is where is recorded"""

    @property
    def seats(self) -> list[Seat]:
        """What the entrant drives with, on some of the problems or on all."""
        place = Place(self.known.planner, problems=True)
        found = (entrant(self.entrant)(each, place) for each in dict.fromkeys(self.problems.known or (self.known,)))
        return [each for each in found if isinstance(each, Seat)]

    def description(self) -> dict[str, Any]:
        """Everything that a drive depends on."""
        names = "/".join(f"{file.name} {number}" for file, number in self.problems.places).encode()
        contents, seats = map(_content, dict.fromkeys(self.problems.files)), self.seats
        return {
            "world": "commonroad",
            "problems": fingerprint(*(np.frombuffer(each, np.uint8) for each in (names, *contents))),
            "model": self.problems.model,
            "seed": self.seed,
            "predictor": [identity(each.belief) for each in seats],
            "planner": described(seats[0].planner),
            "entrant": self.entrant,
        }

    def participants(self) -> Read:
        """What reads the scenarios."""
        return lru_cache(maxsize=1)(_read)

    def row(self, trial: int, participants: Read) -> Row:
        """Drive and judge a problem."""
        file, number = self.problems.places[trial]
        known = {"scenario": file.stem, "problem": number, "solved": False, "off_road": False, "progress": None}
        with heard_by(None):
            problem = participants(file).get(number, "it is not in the file")
            trace, reason = (None, problem) if isinstance(problem, str) else self._driven(trial, problem)
        if trace is None or isinstance(problem, str):
            return unstarted(self.seed, trial, 0, reason) | known
        return measure(trace, self.seed, trial) | known | {
            "reason": reason, "solved": not reason, "off_road": reason == "off the road",
            "progress": _progress(problem, trace),
        }  # fmt: skip

    def _driven(self, trial: int, problem: PlanningProblem) -> tuple[Trace | None, str]:
        """The drive, and why the problem is not solved."""
        if told := FISS.get(self.entrant):
            first = problem.number == _numbers(problem.file)[0]
            return drive_fiss(problem, told) if first else (None, "not driven: not the first problem of its scenario")
        known = self.problems.known[trial] if self.problems.known else self.known
        seat = entrant(self.entrant)(known, Place(settings_for(problem, known.planner), problems=True))
        if not isinstance(seat, Seat) or seat.belief is None or seat.planner is None:
            return None, f"not driven: {seat}"
        found = solve_problem(problem, seat.belief, self.problems.model, made(seat.planner, Planner))
        return found.drive and found.drive.trace, found.row["reason"]


def _read(file: Path) -> dict[int, PlanningProblem | str]:
    numbers = sorted(_numbers(file))
    try:
        found: Sequence[Any] = list(read_problems(file))
    except (DataError, RecordingError) as error:
        found = [error] * len(numbers)
    each = (problem if isinstance(problem, PlanningProblem) else f"not driven: {problem}" for problem in found)
    return dict(zip(numbers, each, strict=True))


def _progress(problem: PlanningProblem, trace: Trace) -> float | None:
    """The share of the way along the road to the place of the goal."""
    place, lon = problem.goal.position, trace.scene.lon[:, 0]
    way = place and place[0] - float(lon[0])
    return float(np.clip((lon[-1] - lon[0]) / way, 0, 1)) if way and way > 0 else None
