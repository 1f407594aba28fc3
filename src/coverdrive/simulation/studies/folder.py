"""The folder of a study: what is studied, one file for each finished trial, all rows together, and stored drives.

``study.json`` says what is studied · ``trials/`` holds one row for each finished trial · ``trials.parquet`` all rows ·
``traces/`` drives that were looked at · ``planned.json`` the number of trials, or null if that was not fixed. Rows
carry a hash of ``study.json``, so that those of another study are not taken for its own. Only the process that runs the
study writes.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from coverdrive._version import __version__
from coverdrive.certificates.certificate import fingerprint
from coverdrive.errors import DataError
from coverdrive.files import write_json, write_stream
from coverdrive.simulation.drives.storage import load_trace, save_trace
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.trial import SCHEMA, Row
from coverdrive.simulation.studies.setup import Setup

ASIDE = "@"
"""between the name of what drove and the scale of the sets with which it did, where the results have others now"""
_FORMAT = 4
_STUDY = "study"
"""key of the hash of the description in the metadata of a table"""


class StudyFolder:
    """Reads and writes the files of one study."""

    def __init__(self, path: Path, schema: Mapping[str, Any] = SCHEMA):
        """Name the folder, which is made as needed, and the columns of its rows: those of trials, or more."""
        self.path, self._schema = path, schema
        self._description, self._table = path / "study.json", path / "trials.parquet"
        self._planned = path / "planned.json"
        self._studied: str | None = None
        self.set_aside: list[Path] = []
        """damaged files, and those of other studies, that were moved out of the way"""

    @property
    def exists(self) -> bool:
        """Whether there is a study."""
        return self._description.exists()

    @property
    def finished(self) -> bool:
        """Whether all rows of a study are there together."""
        return self._table.exists()

    @property
    def anytime(self) -> bool:
        """Whether the number of trials was not fixed before the first: what was seen may have decided it."""
        return self._planned.exists() and self._fixed() is None

    def go_on(self, trials: int, early: bool) -> None:
        """Keep, before so many trials are driven, whether their number is fixed: it is not if they may end early, nor
        if another number was begun.
        """
        if self._planned.exists():
            known = self._fixed()
        else:  # of older studies there are but the rows, once they are finished
            finished = _table_in(self._table) if self.finished else None
            known = trials if finished is None else finished.height
        write_json(self._planned, trials if known == trials and not early else None)

    def _fixed(self) -> int | None:
        """The number of trials, if that was fixed; what cannot be read does not tell."""
        try:
            return json.loads(self._planned.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None

    def description(self) -> dict[str, Any]:
        """What is studied, as `claim` of this version wrote it; else a DataError."""
        file = self._description
        try:
            found = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise DataError(f"{file} is not the description of a study ({error}); use another folder") from error
        if not isinstance(found, dict) or found.get("format") != _FORMAT:
            raise DataError(f"{file} is not the description of a study of this version; drive it in another folder")
        return found

    def claim(self, description: dict[str, Any]) -> None:
        """Say in the folder what is studied, or check that it says the same; else a DataError."""
        wanted = json.loads(json.dumps({"format": _FORMAT, "version": __version__} | description))
        if not self.exists:
            write_json(self._description, wanted)
        found, wanted = flat(self.description()), flat(wanted)
        different = sorted(key for key in found | wanted if found.get(key) != wanted.get(key))
        if different == ["scenarios"]:
            raise DataError(f"the study in {self.path} replayed other recordings; name the same ones with --recording")
        if different:
            changes = ", ".join(f"{key} {found.get(key)!r}, now {wanted.get(key)!r}" for key in different[:3])
            raise DataError(
                f"{self.path} holds a study of another configuration ({len(different)} different: {changes}); "
                "go back to that configuration, use another folder, or give this one another name"
            )
        self._studied = self.digest  # whatever becomes of the file from now on
        for temporary in (self.path / "trials").glob(".*.parquet"):  # of a killed study
            temporary.unlink(missing_ok=True)

    @property
    def digest(self) -> str:
        """A hash of what is studied."""
        return self._studied or fingerprint(
            np.frombuffer(json.dumps(self.description(), sort_keys=True).encode(), np.uint8)
        )

    def save(self, row: Row) -> pl.DataFrame:
        """Keep the row of a finished trial, and give it as a table."""
        table = self.table_of([row])
        self._write(self._part(row["trial"]), table)
        return table

    def _write(self, file: Path, table: pl.DataFrame) -> None:
        """Write a table that says which study it is of."""
        metadata = {_STUDY: self.digest}
        write_stream(file, lambda temporary: table.write_parquet(temporary, metadata=metadata))

    def table_of(self, rows: Sequence[Row]) -> pl.DataFrame:
        """Rows as a table."""
        return pl.DataFrame(rows, schema=self._schema)

    def row_of(self, trial: int, seed: int) -> pl.DataFrame | None:
        """The row of a trial of a seed, or None if it is not finished; what is no row of it is set aside."""
        file = self._part(trial)
        if not file.exists():
            return None
        row = _table_in(file) if _study_of(file) == self.digest else None
        mine = {"trial": trial, "seed": seed}
        if row is not None and row.height == 1 and row.select(list(mine)).row(0, named=True) == mine:
            return row
        damaged = file.with_suffix(".damaged")
        file.replace(damaged)
        self.set_aside.append(damaged)
        return None

    def save_table(self, table: pl.DataFrame) -> None:
        """Keep all rows together."""
        self._write(self._table, table)

    def table(self) -> pl.DataFrame:
        """One row for each trial, also for those that could not start; a DataError if they are not there."""
        if not self.exists:
            beside = {
                each.parent.name for each in self.path.parent.glob(f"{self.path.name}-*/{self._description.name}")
            }
            others = ", ".join(sorted(each for each in beside if ASIDE not in each))
            named = f", but in {others} beside it: name one by --traffic or --road" if others else ""
            raise DataError(f"there is no study in {self.path}{named}; drive one with `coverdrive study`")
        if not self.finished:
            raise DataError(
                f"the study in {self.path} is not finished: {self._table.name} is missing; the command that began it "
                "goes on with it"
            )
        table = _table_in(self._table)
        if table is None:
            raise DataError(
                f"{self._table} is damaged or of another version; the command that drove the study makes it anew"
            )
        if _study_of(self._table) != self.digest:
            raise DataError(f"{self._table} is of another study; the command that drove this one makes it anew")
        return table

    def trace(self, trial: int, vehicles: int, setup: Callable[[], Setup]) -> Trace:
        """A drive that is stored, or is driven now and stored."""
        file = self.path / "traces" / f"{trial:06d}_{vehicles}_{self.digest}.npz"
        if file.exists():
            with suppress(DataError):  # damaged; a drive can be driven again
                return load_trace(file)
        save_trace(setup().drive(trial), file)
        return load_trace(file)

    def _part(self, trial: int) -> Path:
        return self.path / "trials" / f"{trial:06d}.parquet"


def _table_in(file: Path) -> pl.DataFrame | None:
    """The table of trials in a file, or None if it holds none of this version."""
    try:
        table = pl.read_parquet(file.read_bytes())
    except (OSError, pl.exceptions.PolarsError, pl.exceptions.PanicException):
        return None
    return table if SCHEMA.items() <= dict(table.schema).items() else None


def _study_of(file: Path) -> str | None:
    """The hash of the study that a table belongs to, if it says so."""
    try:
        return pl.read_parquet_metadata(file.read_bytes()).get(_STUDY)
    except (OSError, pl.exceptions.PolarsError, pl.exceptions.PanicException):
        return None


def flat(value: Any, name: str = "") -> dict[str, Any]:
    """Nested JSON objects as one object with dotted names."""
    if not isinstance(value, dict):
        return {name: value}
    parts = (flat(inner, f"{name}.{key}" if name else key) for key, inner in value.items())
    return {key: leaf for part in parts for key, leaf in part.items()}
