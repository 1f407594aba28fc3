"""Solves the planning problems of many scenarios, on one process or on several.

A solution is written when all problems of its scenario are driven, the table after each. What is there already, of the
same scenario with the same settings, is not solved again; what is there of other scenarios stays, and what is there of
the same one, changed or with other settings, until it is replaced. A trial of `coverdrive.simulation.studies.workers`
is a scenario.
"""

import hashlib
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import version
from importlib.util import find_spec
from itertools import count
from os.path import realpath
from pathlib import Path
from typing import Any

import polars as pl

from coverdrive.driving.single_track import ModelName
from coverdrive.driving.solved import SCHEMA, Solved, because, solve, unsolved
from coverdrive.driving.solving import Drive, solution_of
from coverdrive.errors import CoverdriveError
from coverdrive.files import write_stream, write_text
from coverdrive.locks import alone
from coverdrive.planning.planner import PlannerSettings
from coverdrive.progress import done, stage
from coverdrive.recordings.tracks.reading import name_of
from coverdrive.simulation.measures.trial import Row
from coverdrive.simulation.predictor import Belief
from coverdrive.simulation.studies.setup import identity
from coverdrive.simulation.studies.workers import run_trials

TABLE = "solved.csv"


@dataclass(frozen=True, eq=False)
class _Scenarios:
    """Implements `coverdrive.simulation.studies.workers.Drives`."""

    files: Sequence[Path]
    predictors: Sequence[Belief | str]
    """for each, or why there is none"""
    model: ModelName
    planner: PlannerSettings
    draw: Callable[[Drive, str], str | None] | None
    names: Sequence[str]
    """of the drawings of each"""
    seed: int = 0

    def description(self) -> dict[str, Any]:
        """What all drives depend on."""
        judge = find_spec("commonroad_dc") is not None
        planner = self.planner.model_dump(mode="json")
        return {"coverdrive": version("coverdrive"), "model": self.model, "judge": judge, "planner": planner}

    def made_from(self, trial: int) -> str:
        """A hash of all that the drives of a scenario depend on; empty if it cannot be read."""
        file, belief = self.files[trial], self.predictors[trial]
        about = f"{self.description()} {_path_of(file)} {identity(belief)}\n"
        with suppress(OSError):
            content = about.encode(errors="surrogateescape") + file.read_bytes()
            return hashlib.blake2b(content, digest_size=8).hexdigest()
        return ""

    def participants(self) -> None:
        """No one who could be made beforehand."""

    def row(self, trial: int, participants: None) -> Row:
        """Drive the problems of a scenario: their rows, the name of the benchmark, and the text of the solution."""
        file, belief = self.files[trial], self.predictors[trial]
        if isinstance(belief, str):
            rows = [unsolved(file, self.model) | because(f"not driven: {belief}")]
            return {"trial": trial, "rows": rows, "benchmark": "", "text": ""}
        with stage(name_of(file)):
            found = list(solve(file, belief, self.model, self.planner))
        rows, text = [self._shown(each, self.names[trial]) for each in found], ""
        drives = [each.drive for each in found if each.drive]
        try:
            text = solution_of(drives) if drives else ""
        except (ValueError, AttributeError) as error:  # of commonroad-io
            lost = {"solved": False} | because(f"driven, but it has no solution that can be written: {error}")
            rows = [row | lost if row["solved"] else row for row in rows]
        return {"trial": trial, "rows": rows, "benchmark": drives[0].name if drives else "", "text": text}

    def _shown(self, found: Solved, name: str) -> Row:
        """The row of a problem, whose drive is drawn, if any."""
        return found.row | ({"video": self.draw(found.drive, name)} if self.draw and found.drive else {})


def solve_all(
    scenarios: Sequence[Path],
    predictor_of: Callable[[Path], Belief],
    folder: Path,
    model: ModelName = "KS",
    workers: int = 1,
    draw: Callable[[Drive, str], str | None] | None = None,
    planner: PlannerSettings | None = None,
) -> Iterator[list[Row]]:
    """Drive and judge the planning problems of scenarios, and write their solutions and the table.

    Args:
        scenarios: files; what cannot be read or driven is a row with its reason, and ends nothing.
        predictor_of: the predictor for a scenario.
        folder: of the table ``solved.csv``, whose rows are sorted by file, and the solutions.
        model: of the ego.
        workers: number of processes.
        draw: is shown every drive, in the process that drove it, with a name that no other scenario in the folder has,
            and says which file in the folder is its video; what is solved already, but has no such file, is driven
            again.
        planner: settings of it, fitted to car and problem as by `coverdrive.driving.solving.settings_for`; the defaults
            if left out.

    Yields:
        The rows of a scenario, by the names of `coverdrive.driving.solved.SCHEMA`: first of all that are there already,
        then as they are solved.

    Raises:
        DataError: another process solves into the folder.
    """
    with alone(folder):
        predictors = [_predictor(predictor_of, each) for each in scenarios]
        found, files = _kept(folder), [_path_of(each) for each in scenarios]
        names = _names(scenarios, files, found)
        setup = _Scenarios(scenarios, predictors, model, planner or PlannerSettings(), draw, names)
        made, left = [setup.made_from(trial) for trial in range(len(scenarios))], list[int]()
        for trial, file in enumerate(files):
            rows = found.get(file, [])
            drawn = not draw or all(row["time"] is None or _is_in(folder, row["video"]) for row in rows)
            if drawn and made[trial] and made[trial] in {row["made_from"] for row in rows}:
                yield rows
            else:
                left.append(trial)
        with stage("scenarios"):
            for number, each in enumerate(run_trials(setup, left, workers), start=len(scenarios) - len(left) + 1):
                file, made_from = files[each["trial"]], made[each["trial"]]
                taken = {row["solution"] or "" for other, rows in found.items() if other != file for row in rows}
                written = None
                if each["text"]:
                    written = _free(f"solution_{each['benchmark']}", taken, ".xml")
                    write_text(folder / written, each["text"])
                found[file] = [row | {"file": file, "made_from": made_from} for row in each["rows"]]
                for row in found[file]:
                    row["solution"] = written if row["time"] is not None else None
                table = pl.DataFrame([row for file in sorted(found) for row in found[file]], schema=SCHEMA)
                write_stream(folder / TABLE, table.write_csv)
                done(number, len(scenarios))
                yield found[file]


def _predictor(predictor_of: Callable[[Path], Belief], scenario: Path) -> Belief | str:
    try:
        return predictor_of(scenario)
    except CoverdriveError as error:
        return str(error)


def _names(scenarios: Sequence[Path], files: Sequence[str], found: dict[str, list[Row]]) -> list[str]:
    """For each scenario a name that no other file has here, nor in the rows that are there: the one it has there."""
    drawn = [row for rows in found.values() for row in rows if row["video"]]
    taken = {row["video"].rsplit("_", 1)[0]: row["file"] for row in drawn}
    for scenario, file in zip(scenarios, files, strict=True):
        if file not in taken.values():
            taken[_free(name_of(scenario), taken)] = file
    own = {file: name for name, file in taken.items()}
    return [own[file] for file in files]


def _free(name: str, taken: Collection[str], suffix: str = "") -> str:
    """A name, with a number where others have ``taken`` it."""
    names = (f"{name}{f' ({number})' * (number > 1)}{suffix}" for number in count(1))
    return next(each for each in names if each not in taken)


def _path_of(file: Path) -> str:
    """From the root of the disk; bytes that are no UTF-8 become question marks."""
    return realpath(file).encode("utf-8", "replace").decode()


def _is_in(folder: Path, name: str | None) -> bool:
    return bool(name) and (folder / name).is_file()


def _kept(folder: Path) -> dict[str, list[Row]]:
    """The rows in a folder whose solutions are there, too, by the files of their scenarios."""
    found = dict[str, list[Row]]()
    with suppress(OSError, pl.exceptions.PolarsError):  # none, or of another version
        for row in pl.read_csv((folder / TABLE).read_bytes(), schema=SCHEMA).iter_rows(named=True):
            found.setdefault(row["file"] or "", []).append(row | {"reason": row["reason"] or ""})
    named = [row for rows in found.values() for row in rows if row["solution"]]
    lost = {row["file"] for row in named if not _is_in(folder, row["solution"])}
    return {file: rows for file, rows in found.items() if file and file not in lost}
