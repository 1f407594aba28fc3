"""From NGSIM's local coordinates to recordings: periods, lanes, road frame.

NGSIM measures the front centre of a vehicle: ``Local_X`` from the left edge of the road to the right,
``Local_Y`` along the road. Its vehicle numbers start anew in each recording period.
"""

from collections import Counter
from pathlib import Path

import numpy as np
import polars as pl
from jaxtyping import Float, Int, Num

from coverdrive.errors import RecordingError
from coverdrive.recordings.checks import LENGTHS, LONGEST_ROAD, WIDTHS
from coverdrive.recordings.delimited import ROW
from coverdrive.recordings.repair import RawTracks, tidy
from coverdrive.recordings.smoothing import SmoothingSettings
from coverdrive.recordings.tracks import Reading, check_time_step, make_reading, name_of
from coverdrive.road import Road

LENGTH, WIDTH = 4.5, 1.8
"""[m] of a car, where the file does not tell"""

PAUSE = 60.0
"""[s] a new recording period begins after a longer pause, or when the frame counter was restarted by more"""

MOST_PERIODS = 20
"""More restarts of the frame counter show that it counts something else"""

MOST_ODD_SIZES = 0.05
"""Share of the rows whose length or width may be no vehicle's; more show another unit"""

LANE_WIDTH = 3.6576
"""[m] 12 ft, the lane width of US freeways (AASHTO), where the recording does not name lanes"""

RARE = 0.02
"""A lane with a smaller share of the rows is a ramp and not part of the road"""

MOST_LANES = 20
"""The widest roads have fewer lanes in one direction"""


def recordings_from_local(
    file: Path, table: pl.DataFrame, repairs: Counter[str], settings: SmoothingSettings
) -> tuple[Reading, ...]:
    """One recording for each period; their times count from the first row of the file.

    The table has the columns ``vehicle``, ``frame`` (the period's frame counter), ``clock`` [s], ``right`` [m]
    (Local_X), ``front`` [m] (Local_Y), ``length`` and ``width`` [m], ``speed`` [m/s], ``row`` (of the file), and if
    known ``lane``; all numbers are finite and below 2⁵³. ``repairs`` gains ``odd lengths`` and ``odd widths``.
    """
    _check_whole(file, table)
    table = _plausible_sizes(file, table, repairs)
    clock = table["clock"].to_numpy()
    dt = _time_step(file, table)
    moment = np.rint((clock - clock.min()) / dt).astype(np.int64)
    vehicle, frame = (table[name].to_numpy().astype(np.int64) for name in ("vehicle", "frame"))
    period = _periods(vehicle, moment, frame, dt)
    raw, edges = _in_road_frame(file, table, vehicle, moment)
    periods = np.unique(period)
    counts = [repairs, *(Counter[str]() for _ in periods[1:])]
    parts = [tidy(raw.take(period == number), dt, own) for number, own in zip(periods, counts, strict=True)]
    length = max(float((part.lon + part.length / 2).max()) for part in parts)
    if not 0 < length <= LONGEST_ROAD:
        problem = f"the road is {length:.6g} m long; expected up to {LONGEST_ROAD:g} m, check the unit of the positions"
        raise RecordingError(file, problem, None, "local_y")
    road = Road(edges=edges, length=length)
    names = [name_of(file) + (f" period {number + 1}" if len(periods) > 1 else "") for number in periods]
    return tuple(
        make_reading(file, name, part, dt, road, settings, own)
        for name, part, own in zip(names, parts, counts, strict=True)
    )


def _in_road_frame(
    file: Path, table: pl.DataFrame, vehicle: Int[np.ndarray, " R"], moment: Int[np.ndarray, " R"]
) -> tuple[RawTracks, Float[np.ndarray, " edges"]]:
    """All rows with vehicle centres in the frame of the road, and the lane edges from its right edge on."""
    right, length = table["right"].to_numpy(), table["length"].to_numpy()
    lane = table["lane"].to_numpy() if "lane" in table.columns else None
    edges = edges_from_width(right) if lane is None else edges_from_lanes(right, lane)
    if edges is None:
        problem = "the lanes cannot be told; expected a few lanes that most vehicles are in, check Lane_ID and Local_X"
        raise RecordingError(file, problem)
    raw = RawTracks(
        vehicle=vehicle,
        moment=moment,
        lon=table["front"].to_numpy() - length / 2,
        lat=edges[-1] - right,
        length=length,
        width=table["width"].to_numpy(),
        speed=table["speed"].to_numpy(),
        group=np.zeros_like(vehicle),
    )
    return raw, (edges[-1] - edges)[::-1].copy()


def _time_step(file: Path, table: pl.DataFrame) -> float:
    """[s] the usual time between two rows of a vehicle, of the first hundred vehicles."""
    some = table["vehicle"].unique(maintain_order=True).head(100)
    tracks = table.select("vehicle", "clock").filter(pl.col("vehicle").is_in(some.implode())).sort("vehicle", "clock")
    steps = np.diff(tracks["clock"].to_numpy())[np.diff(tracks["vehicle"].to_numpy()) == 0]
    if not np.any(steps > 0):
        raise RecordingError(file, "no vehicle was seen at two times; check that the file was copied whole")
    dt = round(float(np.median(steps[steps > 0])), 6)
    check_time_step(file, dt, "the time between two rows of a vehicle (Global_Time is in milliseconds)")
    return dt


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


def _plausible_sizes(file: Path, table: pl.DataFrame, repairs: Counter[str]) -> pl.DataFrame:
    """With the usual size of the same vehicle, or of a car, where the file states one that no vehicle has."""
    for name, (least, most), usual in (("length", LENGTHS, LENGTH), ("width", WIDTHS, WIDTH)):
        good = pl.col(name).is_between(least, most)
        odd = table.select(ROW, name).filter(~good)
        if len(odd) > MOST_ODD_SIZES * len(table):
            problem = f"expected {least:g} to {most:g} m in most rows, got {odd[name][0]:g} m; check the unit"
            raise RecordingError(file, problem, odd[ROW][0], name)
        if len(odd):
            repairs[f"odd {name}s"] += len(odd)
            own = pl.when(good).then(pl.col(name)).median().over("vehicle").fill_null(usual)
            table = table.with_columns(pl.when(good).then(pl.col(name)).otherwise(own).alias(name))
    return table


def _check_whole(file: Path, table: pl.DataFrame) -> None:
    """Refuse numbers of vehicles, frames and lanes that are not whole, and vehicles below 0."""
    for name in (name for name in ("vehicle", "frame", "lane") if name in table.columns):
        for row in ((table[name] != table[name].round()) | ((table[name] < 0) & (name == "vehicle"))).arg_true():
            problem = f"expected a whole number, got {table[name][row]:g}; put the cell right or remove the row"
            raise RecordingError(file, problem, table[ROW][row], name)


def edges_from_lanes(right: Float[np.ndarray, " R"], lane: Num[np.ndarray, " R"]) -> Float[np.ndarray, " edges"] | None:
    """Edges [m] half-way between the median positions of neighbouring lanes, ascending; None if no lane is frequent.

    ``right`` [m] is the distance of every vehicle's centre from the left edge, ``lane`` the lane that the recording
    names. Lanes that are rare, or so close to a more frequent one that they cannot lie beside it, are left out.
    """
    names, rows = np.unique(lane, return_counts=True)
    kept: list[float] = []
    for index in np.argsort(-rows, kind="stable")[: round(1 / RARE)]:
        if rows[index] >= RARE * len(right):
            centre = float(np.median(right[lane == names[index]]))
            if all(abs(centre - other) > LANE_WIDTH / 2 for other in kept):
                kept.append(centre)
    if not kept:
        return None
    inner = np.sort(kept)
    widths = np.diff(inner) if len(inner) > 1 else np.array([LANE_WIDTH])
    middles = (inner[:-1] + inner[1:]) / 2
    return np.concatenate([[inner[0] - widths[0] / 2], middles, [inner[-1] + widths[-1] / 2]])


def edges_from_width(right: Float[np.ndarray, " R"]) -> Float[np.ndarray, " edges"] | None:
    """Edges of 12 ft lanes from the left edge on, as many as hold all but 2 % of the rows; None if too many."""
    lanes = max(1, int(np.ceil(np.quantile(right, 1 - RARE) / LANE_WIDTH)))
    return np.arange(lanes + 1) * LANE_WIDTH if lanes <= MOST_LANES else None
