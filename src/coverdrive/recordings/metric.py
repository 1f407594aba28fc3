"""NGSIM tracks in metres as Parquet: `Vehicle_ID, Frame_ID, Global_Time, local_x_m, local_y_m, v_vel_mps`.

The columns hold no vehicle sizes; every vehicle becomes a car of usual size.
"""

from collections import Counter
from pathlib import Path

import polars as pl

from coverdrive.errors import RecordingError
from coverdrive.recordings.delimited import LARGEST, ROW
from coverdrive.recordings.local_frame import LENGTH, WIDTH, recordings_from_local
from coverdrive.recordings.smoothing import SmoothingSettings
from coverdrive.recordings.tracks import Reading

COLUMNS = {
    "Vehicle_ID": "vehicle",
    "Frame_ID": "frame",
    "Global_Time": "clock",
    "local_x_m": "right",
    "local_y_m": "front",
    "v_vel_mps": "speed",
}
"""and what they are called from here on"""


def is_metric(columns: list[str]) -> bool:
    """Whether a table has the columns of this format."""
    return {"Vehicle_ID", "local_x_m", "local_y_m"} <= set(columns)


def read_metric(file: Path, source: pl.DataFrame, settings: SmoothingSettings | None = None) -> tuple[Reading, ...]:
    """Metric NGSIM tracks from the columns of a file, one recording for each recording period."""
    for name in COLUMNS:
        if name not in source.columns:
            raise RecordingError(file, f"the file has no column {name}; expected {', '.join(COLUMNS)}")
        if not source[name].dtype.is_numeric():
            raise RecordingError(file, f"expected numbers, got {source[name].dtype}; convert them", None, name)
        number = source[name].cast(pl.Float64)
        for row in (~(number.abs() < LARGEST).fill_null(False) | number.is_nan()).arg_true():
            raise RecordingError(file, f"expected a number, got {source[name][row]!r}; remove the row", row + 1, name)
    if source.is_empty():
        raise RecordingError(file, "the file holds no rows of data; check that it was copied whole")
    metres = source.select(pl.col(*COLUMNS).cast(pl.Float64)).rename(COLUMNS).with_row_index(ROW, 1)
    metres = metres.with_columns(pl.col("clock") / 1000, length=pl.lit(LENGTH), width=pl.lit(WIDTH))
    repairs = Counter({"assumed sizes": metres["vehicle"].n_unique()})
    return recordings_from_local(file, metres, repairs, settings or SmoothingSettings())
