"""From raw positions to regular tracks: what is wrong in a file is repaired and counted, or refused.

R rows of raw positions, in the order of the file, become a recording's table: sorted by vehicle and time, one row
per vehicle and moment, without gaps, smoothed (`coverdrive.recordings.smoothing`).
"""

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl
from jaxtyping import Bool, Float, Int

from coverdrive.errors import DataError, RecordingError
from coverdrive.recordings.checks import TIME_STEPS, implausible_vehicles
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.recordings.smoothing import SmoothingSettings, motion, smooth
from coverdrive.road import Road

LONGEST_GAP = 1.0
"""[s] longer gaps in a track are not interpolated: the track is split"""

QUICKEST, SLACK = 60.0, 5.0
"""[m/s] and [m]: positions that are farther apart are not of one motion"""

FASTEST = 60.0
"""[m/s] hardly any vehicle drives faster, so a file in which many do is not in metres"""

MOST_IMPLAUSIBLE, MOST_BESIDE = 0.2, 0.5
"""Share of the vehicles (and rows) that may be left out because of their motion, and of the rows because they are off
the road"""

STATED = (0.8, 1.25)
"""Median ratio of the speed of the positions to the one that a file states"""

VERGE = 1.8
"""[m] half a lane: vehicles whose centre is farther beside the road than this do not drive on it"""


@dataclass(frozen=True, eq=False)
class RawTracks:
    """Positions as measured, of all vehicles."""

    vehicle: Int[np.ndarray, " R"]
    moment: Int[np.ndarray, " R"]
    """time in units of dt"""
    lon: Float[np.ndarray, " R"]
    """[m] centre along the road"""
    lat: Float[np.ndarray, " R"]
    """[m] centre to the left"""
    length: Float[np.ndarray, " R"]
    """[m]"""
    width: Float[np.ndarray, " R"]
    """[m]"""
    speed: Float[np.ndarray, " R"]
    """[m/s] as the file states it: too rough to use, but it shows which vehicles of two files are the same"""
    group: Int[np.ndarray, " R"]
    """which rows must stay together in a split"""

    def take(self, rows: np.ndarray) -> "RawTracks":
        """The rows selected by an index or boolean array; nothing is copied where all rows are."""
        if rows.dtype == np.bool_ and rows.all():
            return self
        return RawTracks(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


@dataclass(frozen=True, eq=False)
class Reading:
    """A recording together with what it was made from."""

    recording: Recording
    raw: RawTracks
    """the tracks on the road as the file holds them"""


def regular_table(raw: RawTracks, dt: float, settings: SmoothingSettings, repairs: Counter[str]) -> pl.DataFrame:
    """The table of a recording; what had to be repaired is counted into ``repairs``.

    Args:
        raw: positions on the time grid, at least one row.
        dt: [s] between two moments.
        settings: how positions are smoothed.
        repairs: gains what `tidy` repairs, ``interpolated rows``, ``split tracks`` (at long gaps and at jumps) and
            ``dropped tracks`` (of a single row), each where any; with causal smoothing ``rows without a past``,
            which are left out, and no interpolated ones.

    """
    longest = dt if settings.causal else LONGEST_GAP
    tracks = _drop_single(_fill_gaps(tidy(raw, dt, repairs), dt, longest, repairs), repairs)
    starts = np.flatnonzero(np.diff(tracks.vehicle, prepend=tracks.vehicle[:1] - 1))
    lon, lon_rate = smooth(tracks.lon, starts, dt, settings)
    lat, lat_rate = smooth(tracks.lat, starts, dt, settings)
    speed, heading = motion(lon_rate, lat_rate, settings)
    known = ~np.isnan(lon_rate)
    _count(repairs, "rows without a past", int((~known).sum()))
    return pl.DataFrame(
        {
            "vehicle": tracks.vehicle,
            "group": tracks.group,
            "time": tracks.moment * dt,
            "lon": lon,
            "lat": lat,
            "speed": speed,
            "heading": heading,
            "length": tracks.length,
            "width": tracks.width,
        },
        schema=SCHEMA,
    ).filter(known)


def name_of(file: Path) -> str:
    """What a recording is called: the file's name without its ending; bytes that are no UTF-8 become question marks."""
    return file.stem.encode("utf-8", "replace").decode()


def tidy(raw: RawTracks, dt: float, repairs: Counter[str]) -> RawTracks:
    """Rows by vehicle and moment, each moment once, and none far from its neighbours on both sides.

    Args:
        raw: positions on the time grid.
        dt: [s] between two moments.
        repairs: gains ``rows out of order``, ``duplicated rows``, ``conflicting rows`` and ``lone outliers``.

    """
    return _drop_outliers(_drop_duplicates(_sort(raw, repairs), repairs), dt, repairs)


def check_time_step(file: Path, dt: float, what: str) -> None:
    """Refuse a time between two rows [s] that no recording of traffic has."""
    if not TIME_STEPS[0] <= dt <= TIME_STEPS[1]:
        raise RecordingError(
            file, f"{what} is {dt:g} s; expected {TIME_STEPS[0]} to {TIME_STEPS[1]:g} s, check its unit"
        )


def make_reading(
    file: Path, name: str, raw: RawTracks, dt: float, road: Road, settings: SmoothingSettings, repairs: Counter[str]
) -> Reading:
    """A recording from raw positions, repaired and smoothed.

    Args:
        file: named in errors.
        name: of the recording.
        raw: positions on the time grid.
        dt: [s] between two moments.
        road: whose right edge is at lat = 0.
        settings: how positions are smoothed.
        repairs: what has been repaired so far; gains ``rows off the road``, what `regular_table` repairs, and
            ``implausible vehicles``, which jump, speed or drive backwards.

    Raises:
        RecordingError: when no vehicle is left, or what is left cannot be traffic.

    """
    kept = drop_off_road(raw, road, repairs)
    if len(kept.vehicle) < MOST_BESIDE * len(raw.vehicle):
        raise RecordingError(
            file,
            f"only {len(kept.vehicle)} of {len(raw.vehicle)} rows are on the {road.lanes} lanes that were found, "
            f"{road.edges[-1]:.1f} m wide; expected a straight road that most vehicles drive on, choose another file",
        )
    _check_stated_speeds(file, kept, dt)
    table = regular_table(kept, dt, settings, repairs)
    if table.is_empty():
        long_enough = f"for {settings.past:g} s without a gap" if settings.causal else "at two successive times"
        raise RecordingError(file, f"no vehicle is on the road {long_enough}; choose another file")
    table = _drop_implausible(file, table, dt, road, repairs)
    try:
        return Reading(Recording(name, table, dt, road, dict(repairs), settings.causal), kept)
    except DataError as error:
        raise RecordingError(file, str(error)) from error


def _check_stated_speeds(file: Path, raw: RawTracks, dt: float) -> None:
    """Refuse positions, times and speeds of different units."""
    order = np.lexsort((raw.moment, raw.vehicle)) if np.any(np.diff(raw.vehicle) < 0) else np.arange(len(raw.vehicle))
    order = order[:100_000]
    seconds = np.diff(raw.moment[order]) * dt
    usable = (np.diff(raw.vehicle[order]) == 0) & (seconds > 0) & (seconds <= LONGEST_GAP) & (raw.speed[order][1:] > 3)
    if usable.sum() < 20:
        return
    way = np.hypot(np.diff(raw.lon[order]), np.diff(raw.lat[order]))[usable]
    ratio = float(np.median(way / seconds[usable] / raw.speed[order][1:][usable]))
    if not STATED[0] <= ratio <= STATED[1]:
        raise RecordingError(
            file,
            f"the median ratio of the speeds of the positions to the speeds that the file states is {ratio:.3g}; "
            f"expected 1: check the units of positions and speeds, and the time step of {dt:g} s",
        )


def _drop_implausible(file: Path, table: pl.DataFrame, dt: float, road: Road, repairs: Counter[str]) -> pl.DataFrame:
    """Without the vehicles that move as none does, unless they are many: then the recording is refused."""
    fast = float(np.quantile(table["speed"].to_numpy(), 0.99))
    if fast > FASTEST:
        raise RecordingError(
            file,
            f"1 % of the rows are faster than {fast:.0f} m/s; expected at most {FASTEST:.0f} m/s, "
            "check that the positions are in metres and the times in milliseconds",
        )
    wrong = implausible_vehicles(table, dt, road)
    if not 0 < len(wrong) <= MOST_IMPLAUSIBLE * table["vehicle"].n_unique():
        return table
    repairs["implausible vehicles"] += len(wrong)
    return table.filter(~pl.col("vehicle").is_in(wrong.tolist()))


def drop_off_road(raw: RawTracks, road: Road, repairs: Counter[str]) -> RawTracks:
    """Without the rows more than `VERGE` beside the road, which are on ramps; counted as ``rows off the road``."""
    on_road = (raw.lat >= road.edges[0] - VERGE) & (raw.lat <= road.edges[-1] + VERGE)
    _count(repairs, "rows off the road", int((~on_road).sum()))
    return raw.take(on_road)


def _count(repairs: Counter[str], kind: str, number: int) -> None:
    if number:
        repairs[kind] += number


def _sort(raw: RawTracks, repairs: Counter[str]) -> RawTracks:
    """Sorted by vehicle and moment; rows whose time runs backwards within a vehicle are counted."""
    backwards = (np.diff(raw.vehicle) == 0) & (np.diff(raw.moment) < 0)
    _count(repairs, "rows out of order", int(backwards.sum()))
    if np.all(np.diff(raw.vehicle) >= 0) and not backwards.any():
        return raw
    return raw.take(np.lexsort((raw.moment, raw.vehicle)))


def _drop_duplicates(raw: RawTracks, repairs: Counter[str]) -> RawTracks:
    """The first row of every vehicle and moment; of the others, those 1 cm or more away from it conflict."""
    first = np.ones(len(raw.vehicle), dtype=bool)
    first[1:] = (np.diff(raw.vehicle) != 0) | (np.diff(raw.moment) != 0)
    kept = np.flatnonzero(first)[np.cumsum(first) - 1]
    away = np.hypot(raw.lon - raw.lon[kept], raw.lat - raw.lat[kept])
    _count(repairs, "duplicated rows", int((~first).sum()))
    _count(repairs, "conflicting rows", int((away >= 0.01).sum()))
    return raw.take(first)


def _jumps(raw: RawTracks, dt: float) -> Bool[np.ndarray, " steps"]:
    """Whether the next row of a vehicle is farther away than it can have driven."""
    way = np.hypot(np.diff(raw.lon), np.diff(raw.lat))
    return (np.diff(raw.vehicle) == 0) & (way > QUICKEST * dt * np.diff(raw.moment) + SLACK)


def _drop_outliers(raw: RawTracks, dt: float, repairs: Counter[str]) -> RawTracks:
    """Without rows that are far from the row before and the row after, where there are such rows."""
    jumps = _jumps(raw, dt)
    if not jumps.any():
        return raw
    last = np.append(np.diff(raw.vehicle) != 0, True)
    before, after = np.insert(jumps | last[:-1], 0, True), np.append(jumps, False) | last
    lone = before & after & (np.insert(jumps, 0, False) | np.append(jumps, False))
    if lone.mean() > MOST_IMPLAUSIBLE:
        return raw  # not outliers, but another unit
    _count(repairs, "lone outliers", int(lone.sum()))
    return raw.take(~lone)


def _fill_gaps(raw: RawTracks, dt: float, longest: float, repairs: Counter[str]) -> RawTracks:
    """Short gaps filled by linear interpolation; after a longer one, or a jump, the vehicle gets a new number."""
    same = np.diff(raw.vehicle) == 0
    step = np.diff(raw.moment)
    jumps = _jumps(raw, dt)
    if not np.any(same & (step > 1)) and not jumps.any():
        return raw
    split = same & (step * dt > longest + dt / 2) | jumps
    part = np.concatenate([[0], np.cumsum(split)])
    renamed = part - np.maximum.accumulate(np.concatenate([[0], np.where(same, 0, part[1:])])) > 0
    vehicle = np.where(renamed, raw.vehicle.max(initial=0) + part, raw.vehicle)

    copies = np.append(np.where(same & ~split, step, 1), 1)
    left = np.repeat(np.arange(len(copies)), copies)
    offset = np.arange(len(left)) - np.repeat(np.cumsum(copies) - copies, copies)
    right = np.minimum(left + (offset > 0), len(copies) - 1)
    share = offset / copies[left]
    _count(repairs, "interpolated rows", int((offset > 0).sum()))
    _count(repairs, "split tracks", int(split.sum()))
    filled = replace(
        raw.take(left),
        vehicle=vehicle[left],
        moment=raw.moment[left] + offset,
        lon=(1 - share) * raw.lon[left] + share * raw.lon[right],
        lat=(1 - share) * raw.lat[left] + share * raw.lat[right],
    )
    return filled.take(np.argsort(filled.vehicle, kind="stable"))


def _drop_single(raw: RawTracks, repairs: Counter[str]) -> RawTracks:
    """Without tracks of one row, which have no speed."""
    _, inverse, count = np.unique(raw.vehicle, return_inverse=True, return_counts=True)
    _count(repairs, "dropped tracks", int((count == 1).sum()))
    return raw.take(count[inverse] > 1)
