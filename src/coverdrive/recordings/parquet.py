"""The package's own recordings as Parquet: one file holds any number of recordings, exactly."""

import json
import os
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
import polars as pl
from pydantic import BaseModel, TypeAdapter, ValidationError

from coverdrive.errors import DataError, RecordingError
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.recordings.repair import RawTracks
from coverdrive.recordings.tracks import Reading
from coverdrive.road import Road

KEY = "coverdrive"
"""Where the file's metadata hold name, dt, road and repairs of every recording"""


def write_parquet(recordings: Sequence[Recording], path: Path) -> None:
    """Write recordings to one file; the file appears whole or not at all.

    Args:
        recordings: at least one.
        path: of the file, replaced if it exists.

    Raises:
        DataError: when there is no recording.

    """
    if not recordings:
        raise DataError("there is no recording to write; read or generate at least one")
    heads = [
        {
            "name": recording.name,
            "dt": recording.dt,
            "edges": np.asarray(recording.road.edges, dtype=np.float64).tolist(),
            "length": float(recording.road.length),
            "repairs": recording.repairs,
            "causal": recording.causal,
        }
        for recording in recordings
    ]
    rows = pl.concat(
        recording.table.with_columns(recording=pl.lit(number, dtype=pl.Int64))
        for number, recording in enumerate(recordings)
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    try:
        rows.write_parquet(temporary, metadata={KEY: json.dumps(heads)})
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


class _Head(BaseModel):
    """What the metadata say of one recording."""

    name: str
    dt: float
    edges: list[float]
    length: float
    repairs: dict[str, int]
    causal: bool = False


def read_heads(file: Path, content: bytes) -> list[_Head] | None:
    """What the metadata of a Parquet file say of its recordings; None if `write_parquet` did not write it.

    Raises:
        RecordingError: when they are not as `write_parquet` writes them.

    """
    metadata = pl.read_parquet_metadata(BytesIO(content))
    if KEY not in metadata:
        return None
    try:
        heads = TypeAdapter(list[_Head]).validate_json(metadata[KEY])
    except ValidationError as error:
        first = error.errors()[0]
        place = " ".join(map(str, first["loc"]))
        problem = f"the file is damaged or of another version ({place}: {first['msg']}); write the recordings anew"
        raise RecordingError(file, problem) from None
    if not heads:
        raise RecordingError(file, "the file names no recording; write the recordings anew")
    return heads


def read_parquet(file: Path, rows: pl.DataFrame, heads: Sequence[_Head]) -> tuple[Reading, ...]:
    """What `write_parquet` wrote, exactly.

    Raises:
        RecordingError: when the file is not as `write_parquet` writes it, or a recording cannot be traffic.

    """
    schema = pl.Schema(SCHEMA | {"recording": pl.Int64})
    if dict(rows.schema) != dict(schema):
        problem = (
            f"the file is damaged or of another version: expected the columns {dict(schema)}, got {dict(rows.schema)}"
        )
        raise RecordingError(file, f"{problem}; write the recordings anew")
    strange = ~rows["recording"].is_between(0, len(heads) - 1).fill_null(False)
    if strange.any():
        row = int(strange.arg_max() or 0)
        problem = f"expected the number of one of {len(heads)} recordings, got {rows['recording'][row]}"
        raise RecordingError(file, f"{problem}; write the recordings anew", row + 1, "recording")
    try:
        return tuple(_reading(head, rows, number) for number, head in enumerate(heads))
    except DataError as error:
        raise RecordingError(file, str(error)) from error


def _reading(head: _Head, rows: pl.DataFrame, number: int) -> Reading:
    """Recording ``number`` of a file, its rows found by the column ``recording``."""
    table = rows.filter(pl.col("recording") == number).select(SCHEMA.names())
    road = Road(edges=np.array(head.edges, dtype=np.float64), length=head.length)
    recording = Recording(head.name, table, head.dt, road, head.repairs, head.causal)
    names = ("vehicle", "lon", "lat", "length", "width", "speed", "group")
    values = {name: table[name].to_numpy() for name in names}
    moment = np.rint(table["time"].to_numpy() / head.dt).astype(np.int64)
    return Reading(recording, RawTracks(moment=moment, **values))
