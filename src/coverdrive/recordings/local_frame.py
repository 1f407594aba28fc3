"""From NGSIM's local coordinates to recordings: periods, lanes, road frame.

NGSIM measures the front centre of a vehicle: ``Local_X`` from the left edge of the road to the right,
``Local_Y`` along the road. Its vehicle numbers start anew in each recording period.
"""

from collections import Counter
from pathlib import Path

import numpy as np
import polars as pl
from jaxtyping import Float, Int

from coverdrive.errors import RecordingError
from coverdrive.recordings.lanes import edges_from_lanes, edges_from_width
from coverdrive.recordings.smoothing import SmoothingSettings
from coverdrive.recordings.tracks import RawTracks, Reading, make_reading
from coverdrive.road import Road

PAUSE = 60.0
"""[s] a new recording period begins after a longer pause, or when the frame counter was restarted by more"""

MOST_PERIODS = 20
"""More restarts of the frame counter show that it counts something else"""

FASTEST = 60.0
"""[m/s] hardly any vehicle drives faster, so a file in which many do is not in metres"""


def recordings_from_local(
    file: Path, table: pl.DataFrame, repairs: Counter[str], settings: SmoothingSettings
) -> tuple[Reading, ...]:
    """One recording for each period; their times count from the first row of the file.

    Args:
        file: names the recordings, and is named in errors.
        table: columns ``vehicle``, ``clock`` [s], ``right`` [m] (Local_X), ``front`` [m] (Local_Y),
            ``length`` and ``width`` [m], ``speed`` [m/s], and if known ``lane`` and ``frame`` (the period's
            frame counter); all numbers finite.
        repairs: what has been repaired in the file so far.
        settings: how positions are smoothed.

    Raises:
        RecordingError: when the numbers cannot be what they claim to be.

    """
    clock = table["clock"].to_numpy()
    dt = _time_step(file, table)
    moment = np.rint((clock - clock.min()) / dt).astype(np.int64)
    frame = table["frame"].to_numpy() if "frame" in table.columns else None
    vehicle = table["vehicle"].to_numpy().astype(np.int64)
    period = _periods(vehicle, moment, None if frame is None else frame.astype(np.int64), dt)
    right, length = table["right"].to_numpy(), table["length"].to_numpy()
    edges = edges_from_lanes(right, table["lane"].to_numpy()) if "lane" in table.columns else None
    edges = edges_from_width(right) if edges is None else edges
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
    road = Road(edges=(edges[-1] - edges)[::-1], length=float(table["front"].to_numpy().max()))

    found: list[Reading] = []
    periods = np.unique(period)
    for number in periods:
        name = file.stem if len(periods) == 1 else f"{file.stem} period {number + 1}"
        own = repairs.copy() if number == 0 else Counter[str]()
        rows = raw if len(periods) == 1 else raw.take(period == number)
        reading = make_reading(file, name, rows, dt, road, settings, own)
        _check_motion(file, reading.recording.table)
        found.append(reading)
    return tuple(found)


def some_tracks(table: pl.DataFrame, vehicle: str, clock: str) -> pl.DataFrame:
    """The rows of a hundred vehicles, sorted by vehicle and time: enough to judge units and time steps by."""
    some = table[vehicle].unique(maintain_order=True).head(100)
    return table.filter(pl.col(vehicle).is_in(some.implode())).sort(vehicle, clock)


def _time_step(file: Path, table: pl.DataFrame) -> float:
    """[s] the usual time between two rows of a vehicle."""
    tracks = some_tracks(table.select("vehicle", "clock"), "vehicle", "clock")
    steps = np.diff(tracks["clock"].to_numpy())[np.diff(tracks["vehicle"].to_numpy()) == 0]
    if not np.any(steps > 0):
        raise RecordingError(file, "no vehicle was seen at two times; check that the file was copied whole")
    return round(float(np.median(steps[steps > 0])), 6)


def _periods(
    vehicle: Int[np.ndarray, " R"],
    moment: Int[np.ndarray, " R"],
    frame: Int[np.ndarray, " R"] | None,
    dt: float,
) -> Int[np.ndarray, " R"]:
    """The recording period of every row, from 0, in the order of time.

    The frame counter starts anew in each period. Where it is not known or tells nothing, a period ends with a
    pause after which numbers of vehicles are used again.

    """
    pause = round(PAUSE / dt)
    by_counter = _clusters(moment - frame, pause) if frame is not None else np.zeros_like(moment)
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


def _check_motion(file: Path, table: pl.DataFrame) -> None:
    """Refuse speeds that no traffic has, and roads with traffic in both directions."""
    fast = float(np.quantile(table["speed"].to_numpy(), 0.99))
    if fast > FASTEST:
        raise RecordingError(
            file,
            f"1 % of the rows are faster than {fast:.0f} m/s; expected at most {FASTEST:.0f} m/s, "
            "check that the positions are in metres and the times in milliseconds",
        )
    ends = table.group_by("vehicle").agg(travel=pl.col("lon").last() - pl.col("lon").first())
    against = float(np.mean(ends["travel"].to_numpy() < -5.0))
    if against > 0.05:
        raise RecordingError(
            file,
            f"{against:.0%} of the vehicles drive against the direction of the road; expected the rows of "
            "one carriageway, choose another location",
        )


def check_unit(file: Path, what: str, values: Float[np.ndarray, " R"], low: float, high: float, unit: str) -> None:
    """Refuse a column whose median shows that it is in another unit.

    Args:
        file: named in the error.
        what: name of the quantity.
        values: in the unit that the format prescribes.
        low: smallest plausible median.
        high: largest plausible median.
        unit: the unit that the format prescribes.

    Raises:
        RecordingError: when the median is outside of low to high.

    """
    median = float(np.median(values))
    if not low <= median <= high:
        raise RecordingError(
            file,
            f"the median {what} is {median:.2f}, which cannot be {unit}; expected {low:g} to {high:g}, "
            "convert the file to this unit",
        )
