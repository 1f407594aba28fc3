"""What is known to be wrong in recorded tracks is repaired and counted. R is the number of rows."""

from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np
import polars as pl
from jaxtyping import Bool, Float, Int

from coverdrive.road import Road

LONGEST_GAP = 1.0
"""[s] longer gaps in a track are not interpolated: the track is split"""

QUICKEST, SLACK = 60.0, 5.0
"""[m/s] and [m]: positions that are farther apart are not of one motion"""

STATED, MOVING = (0.9, 1.1), 3.0
"""Ratio of a speed of positions to the one that a file states, of vehicles that move at more than so many m/s"""

MISSING, OFTEN = 0.3, 0.1
"""[m] of the way of a first step, which measured positions may miss by noise, and share of tracks: a converter's first
rows are late in more of them than chance makes so"""

MOST_OUTLIERS = 0.2
"""Share of the rows from which on they are no outliers, but in another unit"""

VERGE = 1.8
"""[m] half a lane: vehicles whose centre is farther beside the road than this do not drive on it"""


@dataclass(frozen=True, eq=False)
class RawTracks:
    """Positions as measured, of all vehicles: centres and sizes [m] at moments in units of dt."""

    vehicle: Int[np.ndarray, " R"]
    moment: Int[np.ndarray, " R"]
    lon: Float[np.ndarray, " R"]
    lat: Float[np.ndarray, " R"]
    length: Float[np.ndarray, " R"]
    width: Float[np.ndarray, " R"]
    speed: Float[np.ndarray, " R"]
    """[m/s] as the file states it: too rough to use, but it shows which vehicles of two files are the same"""
    group: Int[np.ndarray, " R"]
    """which rows must stay together in a split"""
    kind: Int[np.ndarray, " R"] = field(default_factory=lambda: np.zeros(0, dtype=np.int8))
    """number in `coverdrive.recordings.files.kinds.KINDS`; where none are given, they are unknown"""

    def __post_init__(self) -> None:
        if not len(self.kind):
            object.__setattr__(self, "kind", np.zeros(len(self.vehicle), dtype=np.int8))

    @staticmethod
    def placed(table: pl.DataFrame, lon: Float[np.ndarray, " R"], lat: Float[np.ndarray, " R"]) -> "RawTracks":
        """The rows of a table of vehicle, moment, length, width, speed, and kind if known, at places [m] on a road.

        They are of one group.
        """
        names = ("vehicle", "moment", "length", "width", "speed", "kind")
        columns = {name: table[name].to_numpy() for name in names if name in table.columns}
        return RawTracks(lon=lon, lat=lat, group=np.zeros(len(table), dtype=np.int64), **columns)

    def take(self, rows: np.ndarray) -> "RawTracks":
        """The rows selected by an index or boolean array; nothing is copied where all rows are."""
        if rows.dtype == np.bool_ and rows.all():
            return self
        return RawTracks(*(values[rows] for values in vars(self).values()))


def tidy(raw: RawTracks, dt: float, repairs: Counter[str]) -> RawTracks:
    """Rows by vehicle and moment, each moment once, none far from its neighbours on both sides, no first one too late.

    ``repairs`` gains ``rows out of order``, ``duplicated rows``, ``conflicting rows``, ``lone outliers`` and ``late
    first rows``.
    """
    return _drop_late(_drop_outliers(_drop_duplicates(_sort(raw, repairs), repairs), dt, repairs), dt, repairs)


def drop_off_road(raw: RawTracks, road: Road, repairs: Counter[str]) -> RawTracks:
    """Without the rows more than `VERGE` beside the road, which are on ramps; counted as ``rows off the road``."""
    kept = on_road(raw, road)
    repairs["rows off the road"] += int((~kept).sum())
    return raw.take(kept)


def on_road(raw: RawTracks, road: Road) -> Bool[np.ndarray, " R"]:
    """Which rows are on the road, or at most `VERGE` beside it."""
    edges = road.edges_at(raw.lon)
    return (raw.lat >= edges[:, 0] - VERGE) & (raw.lat <= edges[:, -1] + VERGE)


def _sort(raw: RawTracks, repairs: Counter[str]) -> RawTracks:
    """Sorted by vehicle and moment; rows whose time runs backwards within a vehicle are counted."""
    backwards = (np.diff(raw.vehicle) == 0) & (np.diff(raw.moment) < 0)
    repairs["rows out of order"] += int(backwards.sum())
    if np.all(np.diff(raw.vehicle) >= 0) and not backwards.any():
        return raw
    return raw.take(np.lexsort((raw.moment, raw.vehicle)))


def _drop_duplicates(raw: RawTracks, repairs: Counter[str]) -> RawTracks:
    """The first row of every vehicle and moment; of the others, those 1 cm or more away from it conflict."""
    first = np.ones(len(raw.vehicle), dtype=bool)
    first[1:] = (np.diff(raw.vehicle) != 0) | (np.diff(raw.moment) != 0)
    kept = np.flatnonzero(first)[np.cumsum(first) - 1]
    away = np.hypot(raw.lon - raw.lon[kept], raw.lat - raw.lat[kept])
    repairs["duplicated rows"] += int((~first).sum())
    repairs["conflicting rows"] += int((away >= 0.01).sum())
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
    if lone.mean() > MOST_OUTLIERS:
        return raw
    repairs["lone outliers"] += int(lone.sum())
    return raw.take(~lone)


def _drop_late(raw: RawTracks, dt: float, repairs: Counter[str]) -> RawTracks:
    """Without first rows that are of a moment after the one that they are said to be of.

    Where a converter takes every n-th row of a recording, and the first one of every vehicle, that is nearer to its
    next one than it should be by the stated speeds, with which the step after that agrees.
    """
    starts = np.flatnonzero(np.diff(raw.vehicle, prepend=raw.vehicle[:1] - 1))
    longer = starts[np.diff(np.append(starts, len(raw.vehicle))) > 2]
    rows = longer[:, None] + np.arange(3)
    way = np.hypot(np.diff(raw.lon[rows]), np.diff(raw.lat[rows]))
    speed, taken = np.abs(raw.speed[rows]), dt * np.diff(raw.moment[rows])
    stated = taken * (speed[:, 1:] + speed[:, :-1]) / 2
    agrees = (way >= STATED[0] * stated) & (way <= STATED[1] * stated) & (stated > MOVING * taken)
    late = longer[agrees[:, 1] & (way[:, 0] < np.minimum(STATED[0] * stated[:, 0], stated[:, 0] - MISSING))]
    if len(late) < OFTEN * len(starts):
        return raw
    repairs["late first rows"] += len(late)
    return raw.take(~np.isin(np.arange(len(raw.vehicle)), late))


def fill_gaps(raw: RawTracks, dt: float, repairs: Counter[str]) -> RawTracks:
    """Gaps up to `LONGEST_GAP` filled by linear interpolation; after a longer one, or a jump, another number.

    Rows that were filled in state no speed (NaN).
    """
    same = np.diff(raw.vehicle) == 0
    step = np.diff(raw.moment)
    jumps = _jumps(raw, dt)
    if not np.any(same & (step > 1)) and not jumps.any():
        return raw
    split = same & (step * dt > LONGEST_GAP + dt / 2) | jumps
    part = np.concatenate([[0], np.cumsum(split)])
    renamed = part - np.maximum.accumulate(np.concatenate([[0], np.where(same, 0, part[1:])])) > 0
    vehicle = np.where(renamed, raw.vehicle.max(initial=0) + part, raw.vehicle)

    copies = np.append(np.where(same & ~split, step, 1), 1)
    left = np.repeat(np.arange(len(copies)), copies)
    offset = np.arange(len(left)) - np.repeat(np.cumsum(copies) - copies, copies)
    right = np.minimum(left + (offset > 0), len(copies) - 1)
    share = offset / copies[left]
    repairs["interpolated rows"] += int((offset > 0).sum())
    repairs["split tracks"] += int(split.sum())
    filled = replace(
        raw.take(left),
        vehicle=vehicle[left],
        moment=raw.moment[left] + offset,
        lon=(1 - share) * raw.lon[left] + share * raw.lon[right],
        lat=(1 - share) * raw.lat[left] + share * raw.lat[right],
        speed=np.where(offset > 0, np.nan, raw.speed[left]),
    )
    return filled.take(np.argsort(filled.vehicle, kind="stable"))


def drop_short(raw: RawTracks, most: int, repairs: Counter[str]) -> RawTracks:
    """Without tracks of at most so many rows, which have no speed."""
    _, inverse, count = np.unique(raw.vehicle, return_inverse=True, return_counts=True)
    repairs["dropped tracks"] += int((count <= most).sum())
    return raw.take(count[inverse] > most)
