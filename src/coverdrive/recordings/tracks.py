"""From raw positions to regular tracks: what is wrong in a file is repaired and counted, or refused.

R rows of raw positions, in the order of the file, become a recording's table: sorted by vehicle and time, one row
per vehicle and moment, without gaps, smoothed (`coverdrive.recordings.smoothing`).
"""

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl
from jaxtyping import Float, Int

from coverdrive.errors import RecordingError
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.recordings.smoothing import SmoothingSettings, motion, smooth
from coverdrive.road import Road

LONGEST_GAP = 1.0
"""[s] longer gaps in a track are not interpolated: the track is split"""


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
        repairs: gains ``rows out of order``, ``duplicated rows``, ``conflicting rows``,
            ``interpolated rows``, ``split tracks`` and ``dropped tracks`` (of a single row), each where any;
            with causal smoothing ``rows without a past``, which are left out, and no interpolated ones.

    """
    longest = dt if settings.causal else LONGEST_GAP
    tracks = _drop_single(_fill_gaps(_drop_duplicates(_sort(raw, repairs), repairs), dt, longest, repairs), repairs)
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
        repairs: what has been repaired so far; gains ``rows off the road`` and what `regular_table` repairs.

    Raises:
        RecordingError: when no vehicle is left.

    """
    kept = drop_off_road(raw, road, repairs)
    table = regular_table(kept, dt, settings, repairs)
    if table.is_empty():
        long_enough = f"for {settings.past:g} s without a gap" if settings.causal else "at two successive times"
        raise RecordingError(file, f"no vehicle is on the road {long_enough}; choose another file")
    return Reading(Recording(name, table, dt, road, dict(repairs), settings.causal), kept)


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


def _fill_gaps(raw: RawTracks, dt: float, longest: float, repairs: Counter[str]) -> RawTracks:
    """Gaps filled by linear interpolation; after one above the longest [s] the vehicle goes on under a new number."""
    same = np.diff(raw.vehicle) == 0
    step = np.diff(raw.moment)
    if not np.any(same & (step > 1)):
        return raw
    split = same & (step * dt > longest + dt / 2)
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
