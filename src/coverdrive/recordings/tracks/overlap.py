"""Finds the vehicles that several recordings show at the same time: they count once, and a split must not put their
recordings on two sides.

Several published scenarios are cut from the same original. Their clocks, coordinates and vehicle numbers differ, but
the speeds that the files state are copies. Two tracks belong to one vehicle if their stated speeds agree wherever, at
some time offset, both exist. R is the number of rows.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import polars as pl

from coverdrive.recordings.tracks.repair import RawTracks

SPACING = 0.1
"""[s] between two samples at least: those of 25 Hz differ by less than the resolution, so that any two tracks agree"""

RUN = 8
"""Samples of a run of speeds that is looked up in the other recordings"""

STEP = 0.05
"""[m/s] resolution of the look-up; copies that differ by rounding are found by those of their runs that do not"""

LARGEST_DIFFERENCE = 0.02
"""[m/s] between two copies of a stated speed"""

LONE = 30
"""Samples for which two tracks must agree to prove an overlap alone; shorter ones must be at least two"""

SMOOTH = 3
"""Degree of polynomials in time that smooth speeds follow"""

FEW = 0.7
"""Share of rows with a new speed below which speeds are taken to be held"""

COMMON = 50
"""Runs that occur more often are not telling"""

AT_ONCE = 1_000_000
"""Rows of vehicles that are compared at once"""

SHARED = pl.Schema({f"{name}{side}": pl.Int64 for side in ("", "_b") for name in ("recording", "vehicle", "group")})
"""A vehicle in a group of one recording, and the same vehicle in one of another"""


def shared_vehicles(tracks: Sequence[RawTracks], files: Sequence[int], steps: Sequence[float]) -> pl.DataFrame:
    """The vehicles that two recordings share at the same time: recording, vehicle and group, and those ``_b`` there.

    A pair of vehicles has a row for each pair of groups that they share, which are numbered through all of the tracks.
    ``files`` are the file that each of the recordings is from: those of one file are not compared; ``steps`` the time
    [s] between their rows: those of different ones are neither.
    """
    if len(set(files)) < 2:
        return pl.DataFrame(schema=SHARED)
    every = [math.ceil(SPACING / step - 0.01) for step in steps]
    ordered = [_ordered(track) for track in tracks]
    tables = [(number, each) for number, table in enumerate(ordered) for each in (table, _without_held(table))]
    runs = pl.concat([_runs(table, number, every[number]) for number, table in tables])
    runs = runs.join(pl.DataFrame({"recording": range(len(files)), "file": files}), on="recording")
    runs = runs.filter(pl.len().over("key") <= COMMON, pl.col("file").n_unique().over("key") > 1)
    matches = (
        runs.join(runs, on="key", suffix="_b")
        .filter(pl.col("file") < pl.col("file_b"))
        .select("recording", "recording_b", "vehicle", "vehicle_b", offset=pl.col("moment_b") - pl.col("moment"))
        .unique()
        .sort("recording", "recording_b", "offset", "vehicle", "vehicle_b")
    )
    everybody = pl.concat(table.with_columns(recording=pl.lit(number)) for number, table in enumerate(ordered))
    rows = everybody.group_by("recording", "vehicle").agg(rows=pl.len())
    matches = matches.join(rows, on=("recording", "vehicle"), maintain_order="left")
    matches = matches.with_columns(pl.col("rows").cum_sum())
    part = pl.col("rows").first().over("recording", "recording_b", "offset") // AT_ONCE
    shared = [pl.DataFrame(schema=SHARED)]
    for (a, _), found in matches.with_columns(rows=part).group_by("recording", "rows", maintain_order=True):
        shared.append(_shared(ordered[int(a)], everybody, found, LONE * every[int(a)]).select(SHARED.names()))
    return pl.concat(shared, how="vertical_relaxed")


def _ordered(track: RawTracks) -> pl.DataFrame:
    """One row per vehicle and moment, sorted."""
    table = pl.DataFrame({name: getattr(track, name) for name in ("vehicle", "moment", "speed", "group")})
    return table.unique(["vehicle", "moment"], keep="first", maintain_order=True).sort("vehicle", "moment")


def _without_held(table: pl.DataFrame) -> pl.DataFrame:
    """The first rows of speeds that are held, as those of 0.2 s are in rows every 0.1 s; none where few are."""
    held = (pl.col("speed") == pl.col("speed").shift()) & (pl.col("vehicle") == pl.col("vehicle").shift())
    left = table.filter(~held.fill_null(False))
    return left if len(left) < FEW * len(table) else table.clear()


def _runs(table: pl.DataFrame, number: int, every: int) -> pl.DataFrame:
    """A key of every run of successive, mostly different speeds, with its vehicle and first moment."""
    whole = every * (RUN - 1)
    vehicle, moment = table["vehicle"].to_numpy(), table["moment"].to_numpy()
    rounded = np.rint(table["speed"].to_numpy() / STEP).astype(np.int64)
    count = max(0, len(rounded) - whole)
    factors = np.random.default_rng(0).integers(1, 2**62, RUN + 1)
    parts = [rounded[lag : lag + count] for lag in range(0, whole + 1, every)]
    end = slice(whole, whole + count)
    parts.append(moment[end] - moment[:count])
    key = sum((part * factor for part, factor in zip(parts, factors, strict=True)), np.full(count, every))
    changes = sum((part != before for before, part in pairwise(parts[:RUN])), np.zeros(count, dtype=np.int64))
    telling = (vehicle[:count] == vehicle[end]) & (changes > RUN // 2)
    runs = pl.DataFrame({"key": key, "vehicle": vehicle[:count], "moment": moment[:count]})
    return runs.filter(telling).with_columns(recording=pl.lit(number, pl.Int64))


def _shared(track: pl.DataFrame, everybody: pl.DataFrame, found: pl.DataFrame, lone: int) -> pl.DataFrame:
    """The vehicles of a recording that are found in others, with the groups of their common rows, where they prove an
    overlap.
    """
    shared = (
        found.join(track, on="vehicle")
        .with_columns(moment_b=pl.col("moment") + pl.col("offset"))
        .join(
            everybody,
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
