"""How planning problems were solved, as rows of a table."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from coverdrive.driving.drivability import refusal
from coverdrive.driving.planning_problem import PlanningProblem, read_problems
from coverdrive.driving.single_track import ModelName
from coverdrive.driving.solving import Drive, drive, write_solution
from coverdrive.errors import CoverdriveError
from coverdrive.files import write_atomically
from coverdrive.plan import Planner
from coverdrive.progress import stage
from coverdrive.recordings.boundary import naming
from coverdrive.recordings.tracks import name_of
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


def solve_all(
    scenarios: Sequence[Path], predictor_of: Callable[[Path], Belief], folder: Path, model: ModelName = "KS"
) -> Iterator[Solved]:
    """Drive and judge the planning problems of scenarios; after each, its solution and the table are written.

    Args:
        scenarios: files; what cannot be read or driven is a row with its reason, and ends nothing.
        predictor_of: the predictor for a scenario.
        folder: of the table ``solved.csv`` and the solutions.
        model: of the ego.
    """
    found = list[Solved]()
    for scenario in scenarios:
        with stage(name_of(scenario)):
            for each in _with_predictor(scenario, predictor_of, model):
                found.append(each)
                if each.drive:
                    found[-1] = _written(found, folder)
                _write_table(found, folder)
                yield found[-1]


def _with_predictor(scenario: Path, predictor_of: Callable[[Path], Belief], model: ModelName) -> Iterator[Solved]:
    try:
        predictor = predictor_of(scenario)
    except CoverdriveError as error:
        yield Solved(_unsolved(scenario, model) | {"reason": f"not driven: {error}"}, None)
    else:
        yield from solve(scenario, predictor, model)


def solve(
    scenario: Path, predictor: Belief, model: ModelName = "KS", planner: Planner | None = None
) -> Iterator[Solved]:
    """Drive and judge the planning problems of a scenario; arguments are those of `drive`."""
    known = _unsolved(scenario, model)
    problems = read_problems(scenario)
    while True:
        try:
            with naming(scenario):
                problem = next(problems, None)
        except CoverdriveError as error:
            yield Solved(known | {"reason": f"not read: {error}"}, None)
            return
        if problem is None:
            return
        if isinstance(problem, PlanningProblem):
            yield solve_problem(problem, predictor, model, planner)
        else:
            yield Solved(known | {"reason": f"not driven: {problem}"}, None)


def _unsolved(scenario: Path, model: ModelName) -> dict[str, Any]:
    return dict.fromkeys(SCHEMA) | {"scenario": name_of(scenario), "model": model, "solved": False, "checked": False}


def solve_problem(
    problem: PlanningProblem, predictor: Belief, model: ModelName = "KS", planner: Planner | None = None
) -> Solved:
    """Drive and judge one planning problem; arguments are those of `drive`."""
    known = _unsolved(problem.file, model) | {"problem": problem.number}
    try:
        driven = drive(problem, predictor, model, planner)
    except CoverdriveError as error:
        return Solved(known | {"reason": f"not driven: {error}"}, None)
    except Exception as error:  # a scenario that nobody thought of must not end those after it
        return Solved(known | {"reason": f"not driven: {type(error).__name__}: {error}; please report it"}, None)
    measured = measure(driven.trace, 0, 0)
    refused = _refusal(driven)
    contact, lack = driven.contact, driven.lack
    reason = contact or lack
    if refused is not None:
        reason = {"collision": contact, "goal missed": lack}.get(refused) or refused
    row = known | {name: measured[name] for name in MEASURES} | {"time": driven.seconds}
    return Solved(row | {"reason": reason, "solved": not reason, "checked": refused is not None}, driven)


def _refusal(driven: Drive) -> str | None:
    try:
        return refusal(driven)
    except Exception as error:  # of another package
        return f"not judged: {type(error).__name__}: {error}"


def write(found: Sequence[Solved], folder: Path) -> Path:
    """Write the solution of every scenario that could be driven, and the table; the path of this."""
    last = {each.drive.problem.file: number for number, each in enumerate(found, 1) if each.drive}
    for number in last.values():
        _written(found[:number], folder)
    return _write_table(found, folder)


def _written(found: Sequence[Solved], folder: Path) -> Solved:
    """Write the solution of the scenario of the last one, all of its problems in one; the last with what came of it.

    A benchmark id that several files have gets a number.
    """
    last, driven = found[-1], [each.drive for each in found if each.drive]
    file, name = driven[-1].problem.file, driven[-1].name
    same = list(dict.fromkeys(each.problem.file for each in driven if each.name == name))
    number = f" ({len(same)})" if len(same) > 1 else ""
    try:
        drives = [each for each in driven if each.problem.file == file]
        write_solution(drives, folder / f"solution_{name}{number}.xml")
    except (OSError, ValueError) as error:
        lost = {"solved": False, "reason": f"driven, but its solution cannot be written: {error}"}
        return Solved(last.row | lost, last.drive)
    return last


def _write_table(found: Sequence[Solved], folder: Path) -> Path:
    path = folder / "solved.csv"
    write_atomically(path, pl.DataFrame([each.row for each in found], schema=SCHEMA).write_csv)
    return path
