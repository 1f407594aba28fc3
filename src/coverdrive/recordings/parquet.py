"""The package's own recordings as Parquet: one file holds any number of recordings, exactly."""

import json
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl

from coverdrive.errors import DataError, RecordingError
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.recordings.tracks import RawTracks, Reading
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


def is_own(file: Path) -> bool:
    """Whether a Parquet file was written by `write_parquet`."""
    return KEY in pl.read_parquet_metadata(file)


def read_parquet(file: Path) -> tuple[Reading, ...]:
    """Read back what `write_parquet` wrote.

    Raises:
        RecordingError: when the file is not as `write_parquet` writes it.

    """
    try:
        heads = json.loads(pl.read_parquet_metadata(file)[KEY])
        rows = pl.read_parquet(file)
        return tuple(_reading(head, rows, number) for number, head in enumerate(heads))
    except (KeyError, TypeError, ValueError, pl.exceptions.PolarsError, DataError) as error:
        raise RecordingError(
            file, f"the file is damaged or of another version ({error}); write the recordings anew"
        ) from error


def _reading(head: dict[str, object], rows: pl.DataFrame, number: int) -> Reading:
    """Recording ``number`` of a file, its rows found by the column ``recording``."""
    table = rows.filter(pl.col("recording") == number).select(SCHEMA.names())
    road = Road(edges=np.array(head["edges"], dtype=np.float64), length=float(str(head["length"])))
    dt = float(str(head["dt"]))
    repairs = json.loads(json.dumps(head["repairs"]))
    recording = Recording(str(head["name"]), table, dt, road, repairs, head.get("causal") is True)
    names = ("vehicle", "lon", "lat", "length", "width", "speed", "group")
    values = {name: table[name].to_numpy() for name in names}
    moment = np.rint(table["time"].to_numpy() / dt).astype(np.int64)
    return Reading(recording, RawTracks(moment=moment, **values))
