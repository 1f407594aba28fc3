"""Writes one carriageway of generated traffic as NGSIM tracks: the portal's CSV, the original text, metric Parquet.

Feet, front centres, ``Local_X`` from the left edge of the road, lanes from the left.
"""

from pathlib import Path
from typing import Literal

import polars as pl
from published_formats import WIDTH, Truth
from recordings_fakes import FOOT, TEXT_COLUMNS

START = 1_118_846_980_200
"""[ms] POSIX time of the first frame"""


def write_ngsim(folder: Path, real: Truth, form: Literal["csv", "txt", "parquet"] = "csv") -> Path:
    """``trajectories`` in one of the three forms; speeds have no direction."""
    seen = real.tables[0].with_columns(front=pl.col("lon") + pl.col("length") / 2, right=WIDTH - pl.col("lat"))
    path = folder / f"trajectories.{form}"
    moment = {"Frame_ID": pl.col("frame"), "Global_Time": START + (1000 * pl.col("time")).round().cast(pl.Int64)}
    if form == "parquet":
        metres = {"local_x_m": "right", "local_y_m": "front", "v_vel_mps": "speed"}
        seen.select(Vehicle_ID=pl.col("vehicle") + 1, **moment, **metres).write_parquet(path)
        return path
    feet = {"Local_X": "right", "Local_Y": "front", "v_length": "length", "v_Width": "width", "v_Vel": "speed"}
    rows = seen.select(
        Vehicle_ID=pl.col("vehicle") + 1,
        **moment,
        **{name: (pl.col(source) / FOOT).round(3) for name, source in feet.items()},
        v_Class=pl.when(pl.col("length") > 8).then(3).otherwise(2),
        Lane_ID=3 - (pl.col("lat") / 3.6).floor().cast(pl.Int64).clip(0, 2),
    )
    whole = rows.with_columns(**{name: pl.lit(0) for name in TEXT_COLUMNS if name not in rows.columns})
    if form == "csv":
        whole.with_columns(Location=pl.lit("us-101")).write_csv(path)
    else:
        whole.select(TEXT_COLUMNS).write_csv(path, include_header=False, separator=" ")
    return path
