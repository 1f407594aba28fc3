"""NGSIM recordings: the US DOT portal's CSV (25 columns) and the original text (18 columns) in feet, Parquet in metres.

The metric columns hold no vehicle sizes; every vehicle becomes a car of usual size.
"""

from collections import Counter
from pathlib import Path

import numpy as np
import polars as pl

from coverdrive.errors import RecordingError
from coverdrive.recordings.columns import LENGTH, WIDTH, parquet_numbers
from coverdrive.recordings.delimited import ROW, Layout, csv_layout, read_columns
from coverdrive.recordings.local_frame import recordings_from_local
from coverdrive.recordings.smoothing import SmoothingSettings
from coverdrive.recordings.tracks import Reading

FOOT = 0.3048
"""[m]"""

USUAL_LENGTHS = (8.0, 60.0)
"""[ft] of the median vehicle; cars are 15 ft long"""

TEXT_COLUMNS = (
    "vehicle_id frame_id total_frames global_time local_x local_y global_x global_y v_length v_width v_class "
    "v_vel v_acc lane_id preceding following space_headway time_headway"
)
REQUIRED = ("vehicle_id", "frame_id", "global_time", "local_x", "local_y", "v_length", "v_width", "v_vel")
OPTIONAL = ("lane_id", "v_class")

KIND_OF_CLASS = {1: 5, 2: 1, 3: 3}
"""Number in `coverdrive.recordings.kinds.KINDS` of motorcycles, automobiles and trucks"""

METRIC_COLUMNS = {
    "Vehicle_ID": "vehicle",
    "Frame_ID": "frame",
    "Global_Time": "clock",
    "local_x_m": "right",
    "local_y_m": "front",
    "v_vel_mps": "speed",
}
"""and what they are called from here on"""

METRIC = "vehicle_id local_x_m local_y_m"
"""The columns that tell this format"""


_kind = pl.col("v_class").cast(pl.Int64).replace_strict(KIND_OF_CLASS, default=0, return_dtype=pl.Int8)


def read_ngsim(
    file: Path, location: str | None = None, settings: SmoothingSettings | None = None
) -> tuple[Reading, ...]:
    """Read one site of an NGSIM file, one recording for each recording period.

    The site ``location``, such as ``us-101``, is needed where the file holds several; the original text cannot.
    """
    layout = _layout(file)
    missing = [name for name in REQUIRED if name not in layout.columns]
    if missing:
        problem = f"the file has no column {missing[0]}; expected the columns {', '.join(REQUIRED)}"
        raise RecordingError(file, problem, 1)
    wanted = [name for name in (*REQUIRED, *OPTIONAL) if name in layout.columns]
    repairs: Counter[str] = Counter()
    feet = read_columns(layout, wanted, location if layout.separator == "," else None, repairs)
    usual = float(np.median(feet["v_length"].to_numpy()))
    if not USUAL_LENGTHS[0] <= usual <= USUAL_LENGTHS[1]:
        least, most = USUAL_LENGTHS
        problem = f"the median vehicle length is {usual:.2f}, which cannot be feet; expected {least:g} to {most:g}"
        raise RecordingError(file, f"{problem}, convert the file to feet")
    lengths = {"right": "local_x", "front": "local_y", "length": "v_length", "width": "v_width", "speed": "v_vel"}
    metres = feet.select(
        ROW,
        vehicle="vehicle_id",
        frame="frame_id",
        clock=pl.col("global_time") / 1000,
        **{name: pl.col(source) * FOOT for name, source in lengths.items()},
        **({"lane": pl.col("lane_id")} if "lane_id" in wanted else {}),
        **({"kind": _kind} if "v_class" in wanted else {}),
    )
    del feet  # a third of the memory
    return recordings_from_local(file, metres, repairs, settings or SmoothingSettings())


def _layout(file: Path) -> Layout:
    """Tell the two formats apart by the first line."""
    layout = csv_layout(file)
    if layout.columns:
        return layout
    with file.open("rb") as stream:
        first = stream.readline(100_000).decode("utf-8", errors="replace").lstrip("\ufeff")
    columns = tuple(TEXT_COLUMNS.split())
    if len(first.split()) != len(columns):
        problem = f"the first line has {len(first.split())} columns and no comma; expected a header with commas, as"
        problem += f" the NGSIM portal writes it, or the {len(columns)} columns of the original NGSIM text"
        raise RecordingError(file, problem, 1)
    return Layout(file, columns, " ")


def read_metric(file: Path, settings: SmoothingSettings | None = None) -> tuple[Reading, ...]:
    """Metric NGSIM tracks of a Parquet file, one recording for each recording period."""
    metres = parquet_numbers(file, METRIC_COLUMNS)
    metres = metres.with_columns(pl.col("clock") / 1000, length=pl.lit(LENGTH), width=pl.lit(WIDTH))
    repairs = Counter({"assumed sizes": metres["vehicle"].n_unique()})
    return recordings_from_local(file, metres, repairs, settings or SmoothingSettings())
