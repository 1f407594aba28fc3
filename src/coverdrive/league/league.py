"""Many entrants in many worlds on equal seeds; what was stopped goes on where it was.

The folder of the league has one folder for every world, and in it one for every entrant: a study
(`coverdrive.simulation.studies.folder`), whose trials are kept one by one. Beside them are ``league.csv``, the table
(`coverdrive.league.table`), and ``drives.csv`` with every drive. An entrant's drives in a world are
driven by `coverdrive.simulation.studies.workers`; equal seeds begin alike.
"""

import hashlib
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from coverdrive.bridges.world import World, drive
from coverdrive.driving.driver import Driver
from coverdrive.errors import SettingError, during
from coverdrive.files import write_stream
from coverdrive.league.entrants import Known, Place, Seat, claim_of, entrant, seated
from coverdrive.league.others import OTHERS
from coverdrive.league.problems import COLUMNS, DrivesOfProblems, Problems, is_problems
from coverdrive.league.table import league_table
from coverdrive.plan import Planner
from coverdrive.planning.planner import MpcPlanner
from coverdrive.progress import heard_by, stage
from coverdrive.simulation.measures.trial import SCHEMA, Row, measure
from coverdrive.simulation.predictor import Learning, as_given
from coverdrive.simulation.studies.folder import StudyFolder
from coverdrive.simulation.studies.setup import Setup, described, identity, made
from coverdrive.simulation.studies.study import drive_missing
from coverdrive.simulation.studies.workers import Drives
from coverdrive.simulation.traffic.registry import NAMES

_LONGEST = 100
"""characters of a name that the name of a folder keeps"""


def check_names(planners: Sequence[str], worlds: Sequence[str], ours: Collection[str] = NAMES) -> None:
    """Refuse, with a SettingError, names of nobody and of no world."""
    for name in planners:
        entrant(name)
    if unknown := [name for name in worlds if name not in (*ours, *OTHERS) and not is_problems(name)]:
        there = ", ".join((*ours, *OTHERS))
        raise SettingError(
            f"no world is called {unknown[0]!r}; choose {there}, commonroad:PATHS or commonroad-st:PATHS"
        )


def league(
    setups: Mapping[str, Setup],
    known: Known,
    folder: Path,
    *,
    planners: Sequence[str],
    worlds: Sequence[str],
    trials: int,
    seed: int = 0,
    duration: float | None = None,
    problems: Mapping[str, Problems] | None = None,
    workers: int = 1,
    cluster: str | None = None,
) -> pl.DataFrame:
    """Drive whatever the folder does not hold yet, and write the table.

    Args:
        setups: studies of the default in our traffics, by the names of these worlds.
        known: what entrants may be made of.
        folder: of this league.
        planners: names of `coverdrive.league.entrants.ENTRANTS`, or ``module:factory``, the usual one first.
        worlds: names of setups, of ``problems``, and of `coverdrive.league.others.OTHERS`.
        trials: of every entrant in every world; of problems the first ones, as many as there are.
        seed: of the drives in worlds of others; setups have their own.
        duration: [s] of drives in worlds of others, at the most.
        problems: planning problems of CommonRoad, by the names of these worlds.
        workers: number of processes.
        cluster: address of a Dask scheduler whose workers drive instead.

    Returns:
        The table of `coverdrive.league.table.league_table`.

    Raises:
        SettingError: nobody, or no world, has such a name, or a number makes no sense.
        DataError: the folder holds drives of another configuration.
    """
    if min(trials, workers) < 1:
        raise SettingError(f"a league needs at least one trial and one worker; got {trials} and {workers}")
    check_names(planners, worlds, setups)
    problems = problems or {}
    replayed = [world for world, setup in setups.items() if setup.replays]
    driven: dict[tuple[str, str], pl.DataFrame | str] = {}
    sets: dict[tuple[str, str], str] = {}
    for world in worlds:
        for name in planners:
            found = drives_of(world, name, known, setups, seed, duration, problems)
            if not isinstance(found, str):
                sets[world, name] = _sets(found)
                files = StudyFolder(folder / _plain(world) / _plain(name), COLUMNS if world in problems else SCHEMA)
                files.claim(found.description())
                count = min(trials, len(problems[world].places)) if world in problems else trials
                with stage(f"{name} in {world} ({count})"):
                    found = drive_missing(files.table_of([]), count, files, found, workers, cluster)
                files.save_table(found)
            driven[world, name] = found
            write_stream(folder / "league.csv", league_table(driven, replayed, sets).write_csv)
    each = [
        rows.select(pl.lit(world).alias("world"), pl.lit(name).alias("planner"), pl.all())
        for (world, name), rows in driven.items()
        if isinstance(rows, pl.DataFrame)
    ]
    if each:
        write_stream(folder / "drives.csv", pl.concat(each, how="diagonal").write_csv)
    return league_table(driven, replayed, sets)


def _sets(drives: Drives) -> str:
    """What is claimed of the sets with which an entrant drives; of several fits, each once."""
    match drives:
        case Setup():
            beliefs = [drives.predictor]
        case DrivesOfOthers():
            beliefs = [drives.seat.belief]
        case DrivesOfProblems():
            beliefs = [each.belief for each in drives.seats]
        case _:
            beliefs = []
    return " or ".join(filter(None, dict.fromkeys(map(claim_of, beliefs))))


def _plain(name: str) -> str:
    """A name as that of a folder; of a long one the beginning, and what tells it from others."""
    plain = re.sub(r"[^\w.-]+", "_", name)
    if len(plain) <= _LONGEST:
        return plain
    return f"{plain[:_LONGEST]}-{hashlib.sha256(name.encode()).hexdigest()[:16]}"


@dataclass(frozen=True, eq=False)
class DrivesOfOthers:
    """Drives in a world of others; implements `coverdrive.simulation.studies.workers.Drives`."""

    world: str
    """its name"""
    seat: Seat
    """what drives there, for the car of that world"""
    seed: int
    """of all drives"""
    duration: float | None
    """[s] of a drive at the most; the world's own if left out"""

    def description(self) -> dict[str, Any]:
        """Everything that a drive depends on."""
        belief, planner = self.seat
        return {
            "world": self.world,
            "seed": self.seed,
            "duration": self.duration,
            "predictor": identity(belief),
            "planner": described(planner),
        }

    def participants(self) -> tuple[World, Driver | None]:
        """The world, and who drives in it, or None for its own driver."""
        return OTHERS[self.world].make(), self._driver()

    def _driver(self) -> Driver | None:
        there, (belief, planner) = OTHERS[self.world], self.seat
        if belief is None or planner is None:
            return None
        planner = made(planner, Planner)
        ours = isinstance(planner, MpcPlanner)  # which knows its car
        length, width = (None if ours else there.ego[name] for name in ("length", "width"))
        return Driver(as_given(belief), planner, length=length, width=width)

    def row(self, trial: int, participants: tuple[World, Driver | None]) -> Row:
        """Drive, and keep the measures."""
        seed = int(np.random.SeedSequence(self.seed, spawn_key=(trial,)).generate_state(1)[0] >> 1)
        world, driver = participants
        if isinstance(self.seat.belief, Learning):
            driver = self._driver()
        with heard_by(None), during(f"in trial {trial} of seed {self.seed} in {self.world}"):
            return measure(drive(world, driver, seed, self.duration), self.seed, trial)


def drives_of(
    world: str,
    name: str,
    known: Known,
    setups: Mapping[str, Setup],
    seed: int,
    duration: float | None,
    problems: Mapping[str, Problems] | None = None,
) -> Drives | str:
    """The drives of the entrant ``name`` in a world, or why there are none; all else as of `league`."""
    if problems and world in problems:
        return problems[world].drives(name, known, seed)
    if world in setups:
        return seated(setups[world], name, known)
    seat = entrant(name)(known, Place(OTHERS[world].settings(known.planner), own_driver=True))
    return seat if isinstance(seat, str) else DrivesOfOthers(world, seat, seed, duration)
