"""How planning problems were solved, as rows of a table."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from coverdrive.driving.drivability import refusal
from coverdrive.driving.planning_problem import PlanningProblem, read_problems
from coverdrive.driving.single_track import ModelName
from coverdrive.driving.solving import Drive, drive, write_solution
from coverdrive.errors import DataError, RecordingError
from coverdrive.files import write_atomically
from coverdrive.plan import Planner
from coverdrive.simulation.predictor import Belief
from coverdrive.simulation.trial import SCHEMA as MEASURED
from coverdrive.simulation.trial import measure

MEASURES = (
    "vehicles", "time", "mean_speed", "minimum_gap", "hardest_braking", "jerk_longitudinal", "share_unsafe", "windows",
    "prediction_misses", "planning_median",
)  # fmt: skip
"""those of `coverdrive.simulation.trial` that are of interest here"""

SCHEMA = pl.Schema(
    {"scenario": pl.String(), "problem": pl.Int64(), "model": pl.String(), "solved": pl.Boolean()}
    | {"reason": pl.String(), "checked": pl.Boolean()}
    | {name: MEASURED[name] for name in MEASURES}
)
"""of the table: whether a problem is ``solved``, by the drivability checker if that is installed (``checked``), or else
the ``reason``"""


@dataclass(frozen=True, eq=False)
class Solved:
    """What came of one planning problem."""

    row: dict[str, Any]
    """by the names of `SCHEMA`"""
    drive: Drive | None
    """None: it could not be driven"""


def solve(
    scenario: Path, predictor: Belief, model: ModelName = "KS", planner: Planner | None = None
) -> Iterator[Solved]:
    """Drive and judge the planning problems of a scenario; arguments are those of `drive`."""
    known = _unsolved(scenario, model)
    try:
        for problem in read_problems(scenario):
            if isinstance(problem, PlanningProblem):
                yield solve_problem(problem, predictor, model, planner)
            else:
                yield Solved(known | {"reason": f"not driven: {problem}"}, None)
    except (DataError, RecordingError) as error:
        yield Solved(known | {"reason": f"not read: {error}"}, None)


def _unsolved(scenario: Path, model: ModelName) -> dict[str, Any]:
    return dict.fromkeys(SCHEMA) | {"scenario": scenario.stem, "model": model, "solved": False, "checked": False}


def solve_problem(
    problem: PlanningProblem, predictor: Belief, model: ModelName = "KS", planner: Planner | None = None
) -> Solved:
    """Drive and judge one planning problem; arguments are those of `drive`."""
    known = _unsolved(problem.file, model) | {"problem": problem.number}
    try:
        driven = drive(problem, predictor, model, planner)
    except DataError as error:
        return Solved(known | {"reason": f"not driven: {error}"}, None)
    measured = measure(driven.trace, 0, 0)
    refused = refusal(driven)
    contact, lack = driven.contact, driven.lack
    reason = contact or lack
    if refused is not None:
        reason = {"collision": contact, "goal missed": lack}.get(refused) or refused
    row = known | {name: measured[name] for name in MEASURES} | {"time": driven.seconds}
    return Solved(row | {"reason": reason, "solved": not reason, "checked": refused is not None}, driven)


def write(found: Sequence[Solved], folder: Path) -> Path:
    """Write the solution of every scenario that could be driven, and the table; the path of this."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in dict.fromkeys(each.row["scenario"] for each in found):
        if drives := [each.drive for each in found if each.row["scenario"] == name and each.drive]:
            write_solution(drives, folder)
    path = folder / "solved.csv"
    write_atomically(path, pl.DataFrame([each.row for each in found], schema=SCHEMA).write_csv)
    return path
