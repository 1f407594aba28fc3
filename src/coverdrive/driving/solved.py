"""How planning problems were solved, as rows of a table."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from coverdrive.driving.drivability import refusal
from coverdrive.driving.planning_problem import PlanningProblem, read_problems
from coverdrive.driving.single_track import ModelName
from coverdrive.driving.solving import Drive, drive
from coverdrive.errors import CoverdriveError, blamed
from coverdrive.plan import Planner
from coverdrive.planning.planner import PlannerSettings
from coverdrive.recordings.files.boundary import naming
from coverdrive.recordings.tracks.reading import name_of
from coverdrive.simulation.measures.trial import SCHEMA as MEASURED
from coverdrive.simulation.measures.trial import Row, measure
from coverdrive.simulation.predictor import Belief

MEASURES = (
    "vehicles", "time", "mean_speed", "minimum_gap", "hardest_braking", "jerk_longitudinal", "share_unsafe", "windows",
    "prediction_misses", "planning_median",
)  # fmt: skip
"""those of `coverdrive.simulation.measures.trial` that are of interest here; the mean speed is that of the car on its
own way, which in bends is another one than along the line of the road"""

SCHEMA = pl.Schema(
    {"scenario": pl.String(), "problem": pl.Int64(), "model": pl.String(), "solved": pl.Boolean()}
    | {"reason": pl.String(), "checked": pl.Boolean()}
    | {name: MEASURED[name] for name in MEASURES}
    | {"file": pl.String(), "solution": pl.String(), "video": pl.String(), "made_from": pl.String()}
)
"""of the table: whether a problem is ``solved``, by the drivability checker if that is installed (``checked``), or else
the ``reason``; the ``file`` of the scenario, those of its ``solution`` and of a ``video``, if this drive has one, and a
hash of all that a drive depends on"""


@dataclass(frozen=True, eq=False)
class Solved:
    """What came of one planning problem."""

    row: Row
    """by the names of `SCHEMA`"""
    drive: Drive | None
    """None: it could not be driven"""


def solve(
    scenario: Path, predictor: Belief, model: ModelName = "KS", planner: Planner | PlannerSettings | None = None
) -> Iterator[Solved]:
    """Drive and judge the planning problems of a scenario; arguments are those of `drive`."""
    known = unsolved(scenario, model)
    problems = read_problems(scenario)
    while True:
        try:
            with naming(scenario):
                problem = next(problems, None)
        except CoverdriveError as error:
            yield Solved(known | because(f"not read: {error}"), None)
            return
        if problem is None:
            return
        if isinstance(problem, PlanningProblem):
            yield solve_problem(problem, predictor, model, planner)
        else:
            yield Solved(known | {"problem": problem.number} | because(f"not driven: {problem}"), None)


def unsolved(scenario: Path, model: ModelName) -> Row:
    """The row of a scenario of which nothing is known, with no reason yet."""
    return dict.fromkeys(SCHEMA) | {"scenario": name_of(scenario), "model": model, "solved": False, "checked": False}


def because(reason: str) -> Row:
    """The reason of a row, in one line."""
    return {"reason": " ".join(reason.split())}


def solve_problem(
    problem: PlanningProblem,
    predictor: Belief,
    model: ModelName = "KS",
    planner: Planner | PlannerSettings | None = None,
) -> Solved:
    """Drive and judge one planning problem; arguments are those of `drive`."""
    known = unsolved(problem.file, model) | {"problem": problem.number}
    try:
        driven = drive(problem, predictor, model, planner)
        contact, lack = driven.contact, driven.lack
    except CoverdriveError as error:
        return Solved(known | because(f"not driven: {error}"), None)
    except Exception as error:  # a scenario that nobody thought of must not end those after it
        whose = blamed(error) or "please report it"
        return Solved(known | because(f"not driven: {type(error).__name__}: {error}; {whose}"), None)
    measured = measure(driven.trace, 0, 0)
    try:
        refused = refusal(driven)
    except Exception as error:  # of another package
        refused = f"not judged: {type(error).__name__}: {error}"
    reason = contact or lack
    if refused is not None:
        reason = {"collision": contact, "goal missed": lack}.get(refused) or refused
    row = known | {name: measured[name] for name in MEASURES}
    row |= {"time": driven.seconds, "mean_speed": driven.mean_speed}
    return Solved(row | because(reason) | {"solved": not reason, "checked": refused is not None}, driven)
