"""How planning problems were solved, as rows of a table."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import polars as pl

from coverdrive.driving.drivability import refusal
from coverdrive.driving.planning_problem import PlanningProblem, read_problems
from coverdrive.driving.single_track import ModelName
from coverdrive.driving.solving import Drive, drive, solution_of
from coverdrive.errors import CoverdriveError
from coverdrive.files import write_atomically
from coverdrive.plan import Planner
from coverdrive.recordings.files.boundary import naming
from coverdrive.recordings.tracks.reading import name_of
from coverdrive.simulation.measures.trial import SCHEMA as MEASURED
from coverdrive.simulation.measures.trial import Row, measure
from coverdrive.simulation.predictor import Belief

TABLE = "solved.csv"

MEASURES = (
    "vehicles", "time", "mean_speed", "minimum_gap", "hardest_braking", "jerk_longitudinal", "share_unsafe", "windows",
    "prediction_misses", "planning_median",
)  # fmt: skip
"""those of `coverdrive.simulation.measures.trial` that are of interest here"""

SCHEMA = pl.Schema(
    {"scenario": pl.String(), "problem": pl.Int64(), "model": pl.String(), "solved": pl.Boolean()}
    | {"reason": pl.String(), "checked": pl.Boolean()}
    | {name: MEASURED[name] for name in MEASURES}
    | {"solution": pl.String(), "made_from": pl.String()}
)
"""of the table: whether a problem is ``solved``, by the drivability checker if that is installed (``checked``), or else
the ``reason``; the file of its ``solution``, and a hash of all that this depends on"""


@dataclass(frozen=True, eq=False)
class Solved:
    """What came of one planning problem."""

    row: Row
    """by the names of `SCHEMA`"""
    drive: Drive | None
    """None: it could not be driven"""


def solve(
    scenario: Path, predictor: Belief, model: ModelName = "KS", planner: Planner | None = None
) -> Iterator[Solved]:
    """Drive and judge the planning problems of a scenario; arguments are those of `drive`."""
    known = unsolved(scenario, model)
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


def unsolved(scenario: Path, model: ModelName) -> Row:
    """The row of a scenario of which nothing is known, with no reason yet."""
    return dict.fromkeys(SCHEMA) | {"scenario": name_of(scenario), "model": model, "solved": False, "checked": False}


def solve_problem(
    problem: PlanningProblem, predictor: Belief, model: ModelName = "KS", planner: Planner | None = None
) -> Solved:
    """Drive and judge one planning problem; arguments are those of `drive`."""
    known = unsolved(problem.file, model) | {"problem": problem.number}
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
    by_file, names = dict[Path, list[Drive]](), dict[Path, str]()
    for each in (each.drive for each in found if each.drive):
        by_file.setdefault(each.problem.file, []).append(each)
    for file, drives in by_file.items():
        names[file] = write_solution(drives[0].name, solution_of(drives), folder, names.values())
    return write_table(
        [each.row | {"solution": names[each.drive.problem.file] if each.drive else None} for each in found], folder
    )


def write_solution(benchmark: str, text: str, folder: Path, taken: Collection[str]) -> str:
    """Write a solution; its name is that of the benchmark, with a number where others have ``taken`` it."""
    names = (f"solution_{benchmark}{f' ({number})' * (number > 1)}.xml" for number in count(1))
    name = next(name for name in names if name not in taken)
    write_atomically(folder / name, lambda file: file.write_text(text, encoding="utf-8"))
    return name


def write_table(rows: Sequence[Row], folder: Path) -> Path:
    """Write ``solved.csv``; its path."""
    write_atomically(folder / TABLE, pl.DataFrame(rows, schema=SCHEMA).write_csv)
    return folder / TABLE
