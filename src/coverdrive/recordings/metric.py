"""NGSIM tracks in metres as Parquet: `Vehicle_ID, Frame_ID, Global_Time, local_x_m, local_y_m, v_vel_mps`.

The columns hold no vehicle sizes; every vehicle becomes a car of usual size.
"""

from collections import Counter
from pathlib import Path

import polars as pl

from coverdrive.errors import RecordingError
from coverdrive.recordings.local_frame import recordings_from_local
from coverdrive.recordings.smoothing import SmoothingSettings
from coverdrive.recordings.tracks import Reading

LENGTH, WIDTH = 4.5, 1.8
"""[m] of a car, where the file does not tell"""

COLUMNS = ("Vehicle_ID", "Frame_ID", "Global_Time", "local_x_m", "local_y_m", "v_vel_mps")


def is_metric(columns: list[str]) -> bool:
    """Whether a table has the columns of this format."""
    return {"Vehicle_ID", "local_x_m", "local_y_m"} <= set(columns)


def read_metric(file: Path, settings: SmoothingSettings | None = None) -> tuple[Reading, ...]:
    """Read metric NGSIM tracks, one recording for each recording period.

    Args:
        file: Parquet with the columns of this format.
        settings: how positions are smoothed.

    Raises:
        RecordingError: when a column is missing or holds something else.

    """
    source = pl.read_parquet(file)
    for name in COLUMNS:
        if name not in source.columns:
            raise RecordingError(file, f"the file has no column {name}; expected {', '.join(COLUMNS)}")
        wrong = ~source[name].cast(pl.Float64, strict=False).is_finite().fill_null(False)
        if wrong.any():
            row = int(wrong.arg_max() or 0)
            raise RecordingError(file, f"expected a number, got {source[name][row]!r}; remove the row", row + 1, name)
    if source.is_empty():
        raise RecordingError(file, "the file holds no rows of data; check that it was copied whole")
    number = pl.Float64
    metres = source.select(
        vehicle=pl.col("Vehicle_ID").cast(number),
        frame=pl.col("Frame_ID").cast(number),
        clock=pl.col("Global_Time").cast(number) / 1000,
        right=pl.col("local_x_m").cast(number),
        front=pl.col("local_y_m").cast(number),
        length=pl.lit(LENGTH),
        width=pl.lit(WIDTH),
        speed=pl.col("v_vel_mps").cast(number),
    )
    repairs = Counter({"assumed sizes": metres["vehicle"].n_unique()})
    return recordings_from_local(file, metres, repairs, settings or SmoothingSettings())
