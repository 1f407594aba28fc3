"""From raw positions to recordings: repaired (`coverdrive.recordings.tracks.repair`), smoothed
(`coverdrive.recordings.tracks.smoothing`), filtered (`coverdrive.recordings.tracks.filtering`), and refused where they
cannot be traffic.

R rows of raw positions become a recording's table: sorted by vehicle and time, one row per vehicle and moment, no gaps.
"""

from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl

from coverdrive.errors import DataError, RecordingError
from coverdrive.recordings.checks import MOST_IMPLAUSIBLE, Rows, implausible_vehicles, wrong_time_step
from coverdrive.recordings.recording import KIND, SCHEMA, SEEN, STATED_SPEED, Recording, each_alone
from coverdrive.recordings.tracks.filtering import least_moments, seen
from coverdrive.recordings.tracks.repair import (
    LONGEST_GAP,
    MOVING,
    STATED,
    RawTracks,
    drop_off_road,
    drop_short,
    fill_gaps,
    tidy,
)
from coverdrive.recordings.tracks.smoothing import SmoothingSettings, motion, smooth
from coverdrive.road import Road

FASTEST = 60.0
"""[m/s] hardly any vehicle drives faster, so a file in which many do is not in metres"""

MOST_BESIDE = 0.5
"""Share of the rows that may be left out because they are off the road"""

ENOUGH = 20
"""rows of vehicles that move, at the least, in which the median ratio of their speeds to the stated ones is told"""


class Reading(NamedTuple):
    """A recording, and the tracks on the road as the file holds them."""

    recording: Recording
    raw: RawTracks


def tracks_of(recording: Recording) -> RawTracks:
    """The rows that a recording's file holds, every ``file_dt``, with the speeds that it states.

    Those between two rows of the recording are where the first one of these is.
    """
    table = recording.stated_rows().filter(pl.col("stated").is_not_nan())
    names = ("vehicle", "moment", "group", "lon", "lat", "length", "width")
    return RawTracks(speed=table["stated"].to_numpy().astype(float), **{name: table[name].to_numpy() for name in names})


def regular_table(
    raw: RawTracks, dt: float, settings: SmoothingSettings, repairs: Counter[str], road: Road
) -> pl.DataFrame:
    """The table of a recording from at least one row of positions on a road.

    ``repairs`` gains what `tidy` repairs, ``interpolated rows``, ``split tracks`` (at long gaps and at jumps) and
    ``dropped tracks`` (of too few rows to have a speed), each where any. A track begins when its vehicle is seen.
    """
    least = least_moments(dt)
    tracks = drop_short(fill_gaps(tidy(raw, dt, repairs), dt, repairs), least, repairs)
    starts = np.flatnonzero(np.diff(tracks.vehicle, prepend=tracks.vehicle[:1] - 1))
    lon, lon_rate = smooth(tracks.lon, starts, dt, settings)
    lat, lat_rate = smooth(tracks.lat, starts, dt, settings)
    speed, heading = motion(lon_rate * road.stretch(lon, lat), lat_rate)
    measures = (lon, lat, speed, heading, tracks.length, tracks.width)
    columns = (tracks.vehicle, tracks.group, tracks.moment * dt, *measures)
    measured, noises = ~np.isnan(tracks.speed), (settings.position_noise, settings.acceleration_noise)
    lon, lon_rate = seen(tracks.lon, measured, starts, dt, noises)
    lat, lat_rate = seen(tracks.lat, measured, starts, dt, noises)
    columns += (lon, lat, *motion(lon_rate * road.stretch(lon, lat), lat_rate))
    columns += (tracks.kind, each_alone(pl.Series(tracks.speed)))
    schema = SCHEMA | SEEN | KIND | STATED_SPEED
    table = pl.DataFrame(dict(zip(schema, columns, strict=True)), schema=schema)
    return table.filter(pl.int_range(pl.len()).over("vehicle") >= least)


def name_of(file: Path) -> str:
    """What a recording is called: the file's name without its ending; bytes that are no UTF-8 become question marks."""
    return file.stem.encode("utf-8", "replace").decode()


def check_time_step(file: Path, dt: float, what: str) -> None:
    """Refuse a time between two rows [s] that no recording of traffic has."""
    for problem in wrong_time_step(what, dt):
        raise RecordingError(file, problem)


def make_reading(
    file: Path,
    name: str,
    raw: RawTracks,
    dt: float,
    road: Road,
    settings: SmoothingSettings,
    repairs: Counter[str],
    notes: dict[str, str],
) -> Reading:
    """A recording from raw positions as `tidy` returns them, repaired and smoothed.

    ``notes`` are the recording's. ``repairs`` gains ``rows off the road``, what `regular_table` repairs, and
    ``implausible vehicles``, which jump, speed or drive backwards.
    """
    kept = drop_off_road(raw, road, repairs)
    if len(kept.vehicle) < MOST_BESIDE * len(raw.vehicle):
        problem = f"only {len(kept.vehicle)} of {len(raw.vehicle)} rows are on the {road.lanes} lanes that were found, "
        problem += f"{road.edges[-1]:.1f} m wide; expected a road that most vehicles drive on"
        raise RecordingError(file, f"{problem}, choose another file")
    _check_stated_speeds(file, kept, dt, road)
    table = regular_table(kept, dt, settings, repairs, road)
    if table.is_empty():
        problem = f"no vehicle is on the road in more than {least_moments(dt)} successive rows, at {1 / dt:.3g} Hz"
        raise RecordingError(file, f"{problem}; choose another file, or one of more rows a second")
    _check_fast(file, table)
    table = drop_implausible(table, dt, road, repairs)
    try:
        return Reading(Recording(name, table, dt, road, dict(+repairs), notes), kept)
    except DataError as error:
        raise RecordingError(file, str(error)) from error


def _check_stated_speeds(file: Path, raw: RawTracks, dt: float, road: Road) -> None:
    """Refuse positions, times and speeds of different units."""
    seconds = np.diff(raw.moment) * dt
    usable = (np.diff(raw.vehicle) == 0) & (seconds <= LONGEST_GAP)
    along = np.diff(raw.lon) * road.stretch(raw.lon, raw.lat)[1:] / np.maximum(seconds, dt)
    steps = pl.DataFrame({"vehicle": raw.vehicle[1:], "moved": along, "stated": raw.speed[1:]}).filter(usable)
    usual = steps.group_by("vehicle").agg(pl.col("moved", "stated").median(), rows=pl.len())
    moving = usual.filter((pl.col("moved").abs() > MOVING) | (pl.col("stated").abs() > MOVING))
    if moving["rows"].sum() < ENOUGH:
        return
    moved, stated = moving["moved"].to_numpy(), moving["stated"].to_numpy()
    with np.errstate(divide="ignore"):
        ratio = float(np.median(np.repeat(moved / stated, moving["rows"].to_numpy())))
    if not STATED[0] <= ratio <= STATED[1]:
        found = f"the median ratio of the speeds of the positions to the speeds that the file states is {ratio:.3g}"
        hint = f"check the units of positions and speeds, and the time step of {dt:g} s"
        raise RecordingError(file, f"{found}; expected 1: {hint}")


def _check_fast(file: Path, table: pl.DataFrame) -> None:
    """Refuse a recording of which many rows are faster than traffic."""
    fast = float(np.quantile(table["speed"].to_numpy(), 0.99))
    if fast > FASTEST:
        problem = f"1 % of the rows are faster than {fast:.0f} m/s; expected at most {FASTEST:.0f} m/s"
        hint = "check that the positions are in metres, and the unit of the times"
        raise RecordingError(file, f"{problem}, {hint}")


def drop_implausible(table: pl.DataFrame, dt: float, road: Road, repairs: Counter[str]) -> pl.DataFrame:
    """Without the vehicles that move as none does, unless they are many: then the recording is none of traffic.

    ``repairs`` gains ``doubled vehicles`` and ``implausible vehicles``.
    """
    doubled = Rows(table, dt, road).doubled
    repairs["doubled vehicles"] += len(doubled)
    table = table.filter(~pl.col("vehicle").is_in(doubled.tolist())) if len(doubled) else table
    wrong = implausible_vehicles(table, dt, road)
    if not 0 < len(wrong) <= MOST_IMPLAUSIBLE * table["vehicle"].n_unique():
        return table
    repairs["implausible vehicles"] += len(wrong)
    return table.filter(~pl.col("vehicle").is_in(wrong.tolist()))
