"""Finds the runs of stated speeds that vehicles of different files have in common.

A run is looked up by a key of its rounded speeds. Sorted by key, equal ones stand beside each other, so that no more is
held at once than one pair per run. R is the number of rows, M that of pairs.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import polars as pl
from jaxtyping import Int

from coverdrive.progress import done

RUN = 8
"""Samples of a run of speeds that is looked up in the other recordings"""

STEP = 0.05
"""[m/s] resolution of the look-up; copies that differ by rounding are found by those of their runs that do not"""

FEW = 0.7
"""Share of rows with a new speed below which speeds are taken to be held"""

COMMON = 50
"""Runs that occur more often are not telling"""


def same_runs(
    tables: Sequence[pl.DataFrame], files: Sequence[int], every: Sequence[int]
) -> Iterator[Int[np.ndarray, "2 M"]]:
    """Pairs of the rows with which equal runs of two files begin, some at a time; the first one is of the first file.

    Args:
        tables: vehicle, moment and speed [m/s] of the recordings, sorted by vehicle and moment; their rows are numbered
            through all of them.
        files: the file of each.
        every: rows of each from one sample to the next.
    """
    runs = _runs_of_several(tables, files, every)
    key, file, row = (runs[name].to_numpy() for name in ("key", "file", "row"))
    one = np.arange(len(runs))
    for later in range(1, COMMON):
        one = one[one < len(runs) - later]
        one = one[key[one] == key[one + later]]
        if not len(one):
            return
        differ = one[file[one] != file[one + later]]
        yield np.stack([row[differ], row[differ + later]]).astype(np.int64)


def same_runs_as_known(
    tables: Sequence[pl.DataFrame], known: int, every: Sequence[int]
) -> Iterator[Int[np.ndarray, "2 M"]]:
    """As `same_runs` of all known tables, which are the first ones, as one file and each other one alone as another."""
    runs = list(_runs_of_each(tables, every))
    old = pl.concat(runs[:known]).sort("key")
    new = pl.concat(each.with_columns(own=pl.len().over("key")) for each in runs[known:]).sort("key")
    begin, end = (old["key"].search_sorted(new["key"], side).to_numpy() for side in ("left", "right"))
    few = end - begin + new["own"].to_numpy() <= COMMON
    for later in range(COMMON):
        both = np.flatnonzero(few & (begin + later < end))
        rows = old["row"].to_numpy()[begin[both] + later], new["row"].to_numpy()[both]
        yield np.stack(rows).astype(np.int64)


def _runs_of_several(tables: Sequence[pl.DataFrame], files: Sequence[int], every: Sequence[int]) -> pl.DataFrame:
    """The telling runs that occur in several files, sorted by key and file: key, file, and row of the first sample."""
    of_each = zip(_runs_of_each(tables, every), files, strict=True)
    runs = [each.with_columns(file=pl.lit(file, pl.Int32)) for each, file in of_each]
    several = pl.col("file").min().over("key") < pl.col("file").max().over("key")
    return pl.concat(runs).filter(pl.len().over("key") <= COMMON, several).sort("key", "file")


def _runs_of_each(tables: Sequence[pl.DataFrame], every: Sequence[int]) -> Iterator[pl.DataFrame]:
    """The telling runs of each table: key, and row of the first sample, numbered through all of them."""
    before = 0
    for number, (table, step) in enumerate(zip(tables, every, strict=True), start=1):
        numbered = table.with_row_index("row", before)
        yield pl.concat(_runs(part, step) for part in (numbered, _without_held(numbered)))
        before += len(table)
        done(number, 2 * len(tables))  # what the runs have in common is the other half


def _without_held(table: pl.DataFrame) -> pl.DataFrame:
    """The first rows of speeds that are held, as those of 0.2 s are in rows every 0.1 s; none where few are."""
    held = (pl.col("speed") == pl.col("speed").shift()) & (pl.col("vehicle") == pl.col("vehicle").shift())
    left = table.filter(~held.fill_null(False))
    return left if len(left) < FEW * len(table) else table.clear()


def _runs(table: pl.DataFrame, every: int) -> pl.DataFrame:
    """A key of every run of successive, mostly different speeds, with the row of its first."""
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
    return pl.DataFrame({"key": key[telling], "row": table["row"].to_numpy()[:count][telling]})
