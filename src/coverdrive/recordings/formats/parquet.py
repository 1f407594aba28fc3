"""The package's own recordings as Parquet: one file holds any number of recordings, exactly."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, BinaryIO, Literal

import numpy as np
import polars as pl
from pydantic import BaseModel, BeforeValidator, TypeAdapter, ValidationError, model_validator

from coverdrive.errors import DataError, RecordingError
from coverdrive.files import write_stream
from coverdrive.recordings.files.columns import whole_parquet
from coverdrive.recordings.recording import SCHEMA, Recording, each_alone
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import LaneEdges, Road

KEY = "coverdrive"
"""Where the file's metadata hold name, dt, road and repairs of every recording"""


Numbers = BeforeValidator(lambda values: values.tolist() if hasattr(values, "tolist") else values)
"""Takes arrays for the lists that JSON has"""


class _Line(BaseModel, from_attributes=True):
    start: Annotated[list[float], Numbers]
    heading: float
    curvature: Annotated[list[float], Numbers]
    length: float
    lat: float


class _Changing(BaseModel, from_attributes=True):
    lon: Annotated[list[float], Numbers]
    lat: Annotated[list[list[float]], Numbers]

    @model_validator(mode="after")
    def _even(self) -> "_Changing":
        edges = {len(row) for row in self.lat}
        if not len(self.lon) == len(self.lat) > 0 or len(edges) > 1:
            found = f"got {len(self.lat)} rows of {sorted(edges)} edges at {len(self.lon)} positions"
            raise ValueError(f"expected a row of as many edges at every position, {found}")
        return self


class _Head(BaseModel):
    """What the metadata say of one recording."""

    name: str
    dt: float
    file_dt: float = 0.0
    edges: Annotated[list[float], Numbers]
    length: float
    line: _Line | None = None
    changing: _Changing | None = None
    speed_limit: float | None = None
    side: Literal["right", "left"] = "right"
    repairs: dict[str, int]
    notes: dict[str, str] = {}

    @staticmethod
    def of(recording: Recording) -> "_Head":
        """What there is to say of a recording."""
        own = {name: getattr(recording, name) for name in ("name", "dt", "file_dt", "repairs", "notes")}
        return _Head.model_validate(vars(recording.road) | own | {"length": float(recording.road.length)})

    @property
    def road(self) -> Road:
        """The road, as it was."""
        line, changing = self.line, self.changing
        return Road(
            edges=np.array(self.edges, dtype=np.float64),
            length=self.length,
            line=line
            and ReferenceLine(np.array(line.start), line.heading, np.array(line.curvature), line.length, line.lat),
            changing=changing and LaneEdges(np.array(changing.lon), np.array(changing.lat)),
            speed_limit=self.speed_limit,
            side=self.side,
        )


_HEADS = TypeAdapter(list[_Head])


def write_parquet(recordings: Sequence[Recording], path: Path) -> None:
    """Write one recording or more to a file, which appears or is replaced whole or not at all."""
    if not recordings:
        raise DataError("there is no recording to write; read or generate at least one")
    heads = [_Head.of(recording) for recording in recordings]
    rows = pl.concat(
        recording.table.with_columns(recording=pl.lit(number, dtype=pl.Int64))
        for number, recording in enumerate(recordings)
    )
    metadata = {KEY: _HEADS.dump_json(heads).decode()}
    write_stream(path, lambda file: rows.write_parquet(file, metadata=metadata))


def is_own(stream: BinaryIO) -> bool:
    """Whether `write_parquet` wrote a Parquet file."""
    return KEY in pl.read_parquet_metadata(stream)


def read_parquet(file: Path) -> tuple[Recording, ...]:
    """What `write_parquet` wrote, exactly; a file that is not as it writes them is refused."""
    rows = whole_parquet(file)
    heads = _heads(file, pl.read_parquet_metadata(file.read_bytes()))
    found, schema = dict(rows.schema), dict(SCHEMA) | {"recording": pl.Int64}
    if not schema.items() <= found.items():
        problem = f"the file is damaged or of another version: expected the columns {schema}, got {found}"
        raise RecordingError(file, f"{problem}; write the recordings anew")
    for row in (~rows["recording"].is_between(0, len(heads) - 1).fill_null(False)).arg_true():
        problem = f"expected the number of one of {len(heads)} recordings, got {rows['recording'][row]}"
        raise RecordingError(file, f"{problem}; write the recordings anew", row + 1, "recording")
    return tuple(_recording(head, rows, number) for number, head in enumerate(heads))


def _heads(file: Path, metadata: dict[str, str]) -> list[_Head]:
    """What the metadata of a Parquet file say of its recordings."""
    try:
        heads = _HEADS.validate_json(metadata.get(KEY, "[]"))
    except ValidationError as error:
        first = error.errors()[0]
        place = " ".join(map(str, first["loc"]))
        problem = f"the file is damaged or of another version ({place}: {first['msg']}); write the recordings anew"
        raise RecordingError(file, problem) from None
    if not heads:
        raise RecordingError(file, "the file names no recording; write the recordings anew")
    return heads


def _recording(head: _Head, rows: pl.DataFrame, number: int) -> Recording:
    """Recording ``number`` of a file, its rows found by the column ``recording``."""
    table = rows.filter(pl.col("recording") == number).drop("recording")
    if table.schema.get("stated") == pl.Float32:  # of a file with as many rows
        table = table.with_columns(each_alone(table["stated"]))
    return Recording(head.name, table, head.dt, head.road, head.repairs, head.notes, file_dt=head.file_dt)
