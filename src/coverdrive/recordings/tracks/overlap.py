"""Finds the vehicles that several recordings show at the same time: they count once, and a split must not put their
recordings on two sides.

Several published scenarios are cut from the same original. Their clocks, coordinates and vehicle numbers differ, but
the speeds that the files state are copies. Two tracks belong to one vehicle if their stated speeds agree wherever, at
some time offset, both exist. R is the number of rows, M that of pairs.
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import polars as pl
from jaxtyping import Bool, Float, Int

from coverdrive.progress import done
from coverdrive.recordings.tracks.repair import RawTracks
from coverdrive.recordings.tracks.runs import same_runs, same_runs_as_known

SPACING = 0.1
"""[s] between two samples at least: those of 25 Hz differ by less than the resolution, so that any two tracks agree"""

LARGEST_DIFFERENCE = 0.02
"""[m/s] between two copies of a stated speed"""

LONE = 30
"""Samples for which two tracks must agree to prove an overlap alone; shorter ones must be at least two"""

SMOOTH = 3
"""Degree of polynomials in time that smooth speeds follow"""

LOOKED_AT = (0.0, 1.0, 0.5, 0.25, 0.75)
"""Shares of the common time of two vehicles after which their speeds are compared before all of them are"""

AT_ONCE = 1_000_000
"""Rows of vehicles that are compared at once"""

SHARED = pl.Schema({f"{name}{side}": pl.Int64 for side in ("", "_b") for name in ("recording", "vehicle", "group")})
"""A vehicle in a group of one recording, and the same vehicle in one of another"""


class _Rows(NamedTuple):
    """The rows of all recordings, sorted by recording, vehicle and moment."""

    moment: Int[np.ndarray, " R"]
    speed: Float[np.ndarray, " R"]
    """[m/s]"""
    first: Int[np.ndarray, " R"]
    """The first row of the vehicle of each row"""
    last: Int[np.ndarray, " R"]


def shared_vehicles(
    tracks: Sequence[RawTracks], files: Sequence[int], steps: Sequence[float], known: int = 0
) -> pl.DataFrame:
    """The vehicles that two recordings share at the same time: recording, vehicle and group, and those ``_b`` there.

    A pair of vehicles has a row for each pair of groups that they share, which are numbered through all of the tracks.
    ``files`` are the file that each of the recordings is from: those of one file are not compared; ``steps`` the time
    [s] between their rows: those of different ones are neither. If the first ones are ``known``, each other one is
    compared with these alone, whatever it is given with.
    """
    if len(set(files)) < 2:
        return pl.DataFrame(schema=SHARED)
    every = [math.ceil(SPACING / step - 0.01) for step in steps]
    ordered = [_ordered(track) for track in tracks]
    everybody = pl.concat(table.with_columns(recording=pl.lit(number)) for number, table in enumerate(ordered))
    pairs = same_runs_as_known(ordered, known, every) if known else same_runs(ordered, files, every)
    matches = _found(everybody, pairs)
    others = everybody.join(
        matches, left_on=("recording", "vehicle"), right_on=("recording_b", "vehicle_b"), how="semi"
    )
    rows = everybody.group_by("recording", "vehicle").agg(rows=pl.len())
    matches = matches.join(rows, on=("recording", "vehicle"), maintain_order="left")
    matches = matches.with_columns(pl.col("rows").cum_sum())
    part = pl.col("rows").first().over("recording", "recording_b", "offset") // AT_ONCE
    shared = [pl.DataFrame(schema=SHARED)]
    for (a, _), found in matches.with_columns(rows=part).group_by("recording", "rows", maintain_order=True):
        shared.append(_shared(ordered[int(a)], others, found, LONE * every[int(a)]).select(SHARED.names()))
        done(len(tracks) + int(a) + 1, 2 * len(tracks))  # the first half are their runs
    return pl.concat(shared, how="vertical_relaxed")


def _ordered(track: RawTracks) -> pl.DataFrame:
    """One row per vehicle and moment, sorted."""
    table = pl.DataFrame({name: getattr(track, name) for name in ("vehicle", "moment", "speed", "group")})
    return table.unique(["vehicle", "moment"], keep="first", maintain_order=True).sort("vehicle", "moment")


def _found(everybody: pl.DataFrame, pairs: Iterator[Int[np.ndarray, "2 M"]]) -> pl.DataFrame:
    """The pairs of vehicles that share a run, which begins with a pair of rows, and at what offset they do.

    Those that differ where they are looked at first, as most do whose runs are equal by chance, are left out.
    """
    rows, left = _rows(everybody), [np.zeros((2, 0), dtype=np.int64)]
    for pair in pairs:
        for share in LOOKED_AT:
            pair = pair[:, ~_differ(rows, *pair, share)]
        left.append(pair)
    first, second = np.concatenate(left, axis=1)
    named = everybody.select("recording", "vehicle", "moment")
    found = pl.concat([named[first], named[second].select(pl.all().name.suffix("_b"))], how="horizontal")
    order = ("recording", "recording_b", "offset", "vehicle", "vehicle_b")
    return found.with_columns(offset=pl.col("moment_b") - pl.col("moment")).select(order).unique().sort(order)


def _rows(everybody: pl.DataFrame) -> _Rows:
    track = everybody.select(pl.struct("recording", "vehicle").rle_id()).to_series().to_numpy()
    border = np.flatnonzero(np.diff(track, prepend=-1, append=-1))
    moment, speed = everybody["moment"].to_numpy(), everybody["speed"].to_numpy()
    return _Rows(moment, speed, border[track], border[track + 1] - 1)


def _differ(rows: _Rows, a: Int[np.ndarray, " M"], b: Int[np.ndarray, " M"], share: float) -> Bool[np.ndarray, " M"]:
    """Whether the vehicles of pairs of rows, which are put at one moment, differ after a share of their common time.

    They do not where either has no row, nor where one lacks rows on the way there.
    """
    since = np.maximum(rows.moment[rows.first[a]] - rows.moment[a], rows.moment[rows.first[b]] - rows.moment[b])
    until = np.minimum(rows.moment[rows.last[a]] - rows.moment[a], rows.moment[rows.last[b]] - rows.moment[b])
    lag = since + np.rint(share * (until - since)).astype(np.int64)
    there = np.ones(len(a), dtype=np.bool_)
    speeds = list[Float[np.ndarray, " M"]]()
    for row in (a, b):
        at = np.clip(row + lag, rows.first[row], rows.last[row])
        there &= rows.moment[at] == rows.moment[row] + lag
        speeds.append(rows.speed[at])
    return there & (np.abs(speeds[0] - speeds[1]) > LARGEST_DIFFERENCE)


def _shared(track: pl.DataFrame, others: pl.DataFrame, found: pl.DataFrame, lone: int) -> pl.DataFrame:
    """The vehicles of a recording that are found in others, whose rows are given, with the groups of their common rows,
    where they prove an overlap.
    """
    shared = (
        found.join(track, on="vehicle")
        .with_columns(moment_b=pl.col("moment") + pl.col("offset"))
        .join(
            others,
            left_on=("recording_b", "vehicle_b", "moment_b"),
            right_on=("recording", "vehicle", "moment"),
            suffix="_b",
        )
    )
    overlap, pair = ("recording_b", "offset"), pl.struct("vehicle", "vehicle_b")
    agree = (pl.col("speed") - pl.col("speed_b")).abs().max().over(*overlap, "vehicle", "vehicle_b")
    shared = shared.filter(agree <= LARGEST_DIFFERENCE).with_columns(pairs=pair.n_unique().over(overlap))
    alone = shared.filter(pl.col("pairs") == 1, pl.len().over(overlap) >= lone)  # all rows are those of one pair
    telling = [rows for _, rows in alone.group_by(overlap, maintain_order=True) if _fluctuates(rows)]
    return pl.concat([shared.filter(pl.col("pairs") > 1), *telling]).unique(SHARED.names(), maintain_order=True)


def _fluctuates(shared: pl.DataFrame) -> bool:
    """Whether speeds leave every smooth curve by more than two copies differ: vehicles that roll out look alike."""
    moment, speed = shared["moment"].to_numpy(), shared["speed"].to_numpy()
    smooth = np.polynomial.Polynomial.fit(moment, speed, SMOOTH)
    return float(np.abs(smooth(moment) - speed).max()) > LARGEST_DIFFERENCE
