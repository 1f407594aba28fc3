"""NGSIM recordings: the US DOT portal's CSV (25 columns) and the original text (18 columns) in feet, Parquet in metres.

The metric columns hold no vehicle sizes; every vehicle becomes a car of usual size.

NGSIM measures the front centre of a vehicle: ``Local_X`` from the left edge of the road to the right, ``Local_Y`` along
the road. Its vehicle numbers start anew in each recording period.
"""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
from jaxtyping import Float, Int

from coverdrive.errors import RecordingError
from coverdrive.recordings.checks import LONGEST_ROAD
from coverdrive.recordings.files.columns import LENGTH, WIDTH, parquet_numbers, plausible_rows
from coverdrive.recordings.files.delimited import ROW, Layout, csv_layout, read_columns
from coverdrive.recordings.files.times import moments_of, time_step
from coverdrive.recordings.formats.reader import AS_USUAL, How
from coverdrive.recordings.roads.lanes import edges_from_lanes, edges_from_width, order_of
from coverdrive.recordings.roads.partial_lanes import with_partial_lanes
from coverdrive.recordings.tracks.reading import Reading, make_reading, name_of
from coverdrive.recordings.tracks.repair import RawTracks, tidy
from coverdrive.recordings.tracks.smoothing import SmoothingSettings
from coverdrive.road import Road

FOOT = 0.3048
"""[m]"""

PAUSE = 60.0
"""[s] a new recording period begins after a longer pause, or when the frame counter was restarted by more"""

MOST_PERIODS = 20
"""More restarts of the frame counter show that it counts something else"""

TEXT_COLUMNS = (
    "vehicle_id frame_id total_frames global_time local_x local_y global_x global_y v_length v_width v_class "
    "v_vel v_acc lane_id preceding following space_headway time_headway"
)
REQUIRED = ("vehicle_id", "frame_id", "global_time", "local_x", "local_y", "v_length", "v_width", "v_vel")
OPTIONAL = ("lane_id", "v_class")

KIND_OF_CLASS = {1: 5, 2: 1, 3: 3}
"""Number in `coverdrive.recordings.files.kinds.KINDS` of motorcycles, automobiles and trucks"""

METRIC_COLUMNS = {
    "Vehicle_ID": "vehicle",
    "Frame_ID": "frame",
    "Global_Time": "clock",
    "local_x_m": "right",
    "local_y_m": "front",
    "v_vel_mps": "speed",
}
"""and what they are called from here on"""

_kind = pl.col("v_class").cast(pl.Int64).replace_strict(KIND_OF_CLASS, default=0, return_dtype=pl.Int8)


def read_ngsim(file: Path, how: How = AS_USUAL) -> tuple[Reading, ...]:
    """Read one site of an NGSIM file, one recording for each recording period."""
    layout = _layout(file)
    missing = [name for name in REQUIRED if name not in layout.columns]
    if missing:
        problem = f"the file has no column {missing[0]}; expected the columns {', '.join(REQUIRED)}"
        raise RecordingError(file, problem, 1)
    wanted = [name for name in (*REQUIRED, *OPTIONAL) if name in layout.columns]
    repairs: Counter[str] = Counter()
    feet = read_columns(layout, wanted, how.location if layout.separator == "," else None, repairs)
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
    return recordings_from_local(file, metres, repairs, how.smoothing)


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


def read_metric(file: Path, how: How = AS_USUAL) -> tuple[Reading, ...]:
    """Metric NGSIM tracks of a Parquet file, one recording for each recording period."""
    metres = parquet_numbers(file, METRIC_COLUMNS)
    metres = metres.with_columns(pl.col("clock") / 1000, length=pl.lit(LENGTH), width=pl.lit(WIDTH))
    repairs = Counter({"assumed sizes": metres["vehicle"].n_unique()})
    return recordings_from_local(file, metres, repairs, how.smoothing)


def recordings_from_local(
    file: Path, table: pl.DataFrame, repairs: Counter[str], settings: SmoothingSettings
) -> tuple[Reading, ...]:
    """One recording for each period; their times count from the first row of the file.

    The table has the columns ``vehicle``, ``frame`` (the period's frame counter), ``clock`` [s], ``right`` [m]
    (Local_X), ``front`` [m] (Local_Y), ``length`` and ``width`` [m], ``speed`` [m/s], ``row`` (of the file), and if
    known ``lane`` and ``kind`` (in `KINDS`); all numbers are finite and below 2⁵³. ``repairs`` gains ``odd lengths``
    and ``odd widths``.
    """
    table = plausible_rows(file, table, repairs)
    clock = table["clock"].to_numpy()
    dt = time_step(file, table, "Global_Time is in milliseconds")
    moment = moments_of(file, clock - clock.min(), dt)
    table = table.with_columns(pl.col("vehicle", "frame").cast(pl.Int64), moment=moment)
    period = _periods(table["vehicle"].to_numpy(), moment, table["frame"].to_numpy(), dt)
    raw, edges = _in_road_frame(file, table)
    periods = np.unique(period)
    counts = [repairs, *(Counter[str]() for _ in periods[1:])]
    parts = [tidy(raw.take(period == number), dt, own) for number, own in zip(periods, counts, strict=True)]
    length = max(float((part.lon + part.length / 2).max()) for part in parts)
    if not 0 < length <= LONGEST_ROAD:
        problem = f"the road is {length:.6g} m long; expected up to {LONGEST_ROAD:g} m, check the unit of the positions"
        raise RecordingError(file, problem, None, "local_y")
    found = with_partial_lanes(parts, edges)
    parts = [replace(part, lat=part.lat - found.right) for part in parts]
    road = Road(edges=found.edges, length=length, changing=found.changing)
    lanes = ("lane numbers" if "lane" in table.columns else "12 ft from the left") + found.told
    names = [name_of(file) + (f" period {number + 1}" if len(periods) > 1 else "") for number in periods]
    return tuple(
        make_reading(file, name, part, dt, road, settings, own, {"lanes": lanes})
        for name, part, own in zip(names, parts, counts, strict=True)
    )


def _in_road_frame(file: Path, table: pl.DataFrame) -> tuple[RawTracks, Float[np.ndarray, " edges"]]:
    """All rows with vehicle centres in the frame of the road, and the lane edges from its right edge on."""
    right = table["right"].to_numpy()
    if "lane" in table.columns and order_of(table["lane"].to_numpy(), right) < 0:
        problem = "Local_X falls from lane to lane as Lane_ID counts; expected both to grow from the left edge"
        raise RecordingError(file, f"{problem}: positions are mirrored, turn Local_X round", None, "local_x")
    edges = edges_from_lanes(right, table["lane"].to_numpy()) if "lane" in table.columns else edges_from_width(right)
    if edges is None:
        problem = "the lanes cannot be told; expected a few lanes that most vehicles are in, check Lane_ID and Local_X"
        raise RecordingError(file, problem)
    lon = (table["front"] - table["length"] / 2).to_numpy()
    return RawTracks.placed(table, lon, edges[-1] - right), (edges[-1] - edges)[::-1].copy()


def _periods(
    vehicle: Int[np.ndarray, " R"], moment: Int[np.ndarray, " R"], frame: Int[np.ndarray, " R"], dt: float
) -> Int[np.ndarray, " R"]:
    """The recording period of every row, from 0, in the order of time.

    The frame counter starts anew in each period. Where it tells nothing, a period ends with a pause after which numbers
    of vehicles are used again.
    """
    pause = round(PAUSE / dt)
    by_counter = _clusters(moment - frame, pause)
    if 0 < by_counter.max() < MOST_PERIODS:
        return by_counter
    by_pause = _clusters(moment, pause)
    pairs = np.unique(np.stack([vehicle, by_pause]), axis=1)
    reused = len(np.unique(pairs[0])) < pairs.shape[1]
    return by_pause if reused else np.zeros_like(by_pause)


def _clusters(values: Int[np.ndarray, " R"], distance: int) -> Int[np.ndarray, " R"]:
    """Number of the cluster of every value, ascending; clusters are more than ``distance`` apart."""
    distinct, inverse = np.unique(values, return_inverse=True)
    return np.cumsum(np.diff(distinct, prepend=distinct[:1]) > distance)[inverse]
