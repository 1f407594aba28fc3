"""Every run that two files have in common is found, and no other."""

from itertools import pairwise

import numpy as np
import polars as pl
import pytest

from coverdrive.recordings.tracks.runs import COMMON, RUN, STEP, same_runs, same_runs_as_known


def table_of(speeds: np.ndarray, first_moment: int = 0) -> pl.DataFrame:
    """A recording of speeds (vehicles, moments) [m/s]."""
    vehicles, moments = speeds.shape
    vehicle = np.repeat(np.arange(vehicles), moments)
    moment = np.tile(first_moment + np.arange(moments), vehicles)
    return pl.DataFrame({"vehicle": vehicle, "moment": moment, "speed": speeds.ravel()})


def wavy(seed: int, vehicles: int, moments: int) -> np.ndarray:
    """Speeds (vehicles, moments) [m/s] of three values, each unlike the one before."""
    return STEP * (np.cumsum(np.random.default_rng(seed).integers(1, 3, (vehicles, moments)), axis=1) % 3)


def pairs_of(tables: list[pl.DataFrame], files: list[int], every: int = 1) -> list[tuple[int, int]]:
    found = [pair for pairs in same_runs(tables, files, [every] * len(tables)) for pair in pairs.T.tolist()]
    return sorted(map(tuple, found))


def slowly(tables: list[pl.DataFrame], files: list[int], every: int) -> list[tuple[int, int]]:
    """As `pairs_of`, by comparing each run with each."""
    rows = [(file, *row) for file, table in zip(files, tables, strict=True) for row in table.iter_rows()]
    runs = dict[int, tuple[int, ...]]()
    for first in range(len(rows) - every * (RUN - 1)):
        samples = rows[first : first + every * RUN : every]
        speeds = tuple(round(speed / STEP) for *_, speed in samples)
        changes = sum(one != then for one, then in pairwise(speeds))
        if changes > RUN // 2 and samples[0][:2] == samples[-1][:2]:
            runs[first] = speeds
    often = {speeds: list(runs.values()).count(speeds) for speeds in runs.values()}
    return [
        (one, other)
        for one, speeds in runs.items()
        for other, same in runs.items()
        if speeds == same and rows[one][0] < rows[other][0] and often[speeds] <= COMMON
    ]


def test_all_equal_runs_of_two_files_are_paired_and_only_they():
    tables = [table_of(wavy(seed, 6, 60), 100 * seed) for seed in range(4)]
    for every in (1, 3):
        expected = slowly(tables, [0, 0, 1, 2], every)
        assert len(expected) > 30 and pairs_of(tables, [0, 0, 1, 2], every) == sorted(expected)


def test_the_first_row_is_of_the_first_file_whatever_their_order():
    tables = [table_of(wavy(0, 1, RUN)), table_of(wavy(0, 1, RUN))]
    assert pairs_of(tables, [0, 1]) == [(0, RUN)] and pairs_of(tables, [1, 0]) == [(RUN, 0)]


def test_runs_that_occur_often_are_not_told():
    one = wavy(0, 1, RUN)
    for count, found in ((COMMON, COMMON - 1), (COMMON + 1, 0)):
        tables = [table_of(one), table_of(np.repeat(one, count - 1, axis=0))]
        assert len(pairs_of(tables, [0, 1])) == found


@pytest.mark.parametrize("copies", [1, 3, COMMON])
def test_each_table_is_compared_with_the_known_ones_as_if_it_was_given_alone(copies: int):
    """Runs that occur often in all of those that are given are told, too."""
    known = [table_of(wavy(seed, 6, 60)) for seed in range(2)]
    new = [table_of(wavy(seed, 6, 60)) for seed in (2, 3)] * copies + [table_of(np.repeat(wavy(4, 1, 60), 60, axis=0))]
    rows, expected = sum(map(len, known)), list[tuple[int, int]]()
    for number, each in enumerate(new):
        before = sum(map(len, new[:number]))
        expected += [(one, other + before) for one, other in pairs_of([*known, each], [0, 0, 1])]
    found = [pair for pairs in same_runs_as_known([*known, *new], 2, [1] * (2 + len(new))) for pair in pairs.T.tolist()]
    assert len(expected) > 10 * copies and sorted(map(tuple, found)) == sorted(expected)
    assert all(one < rows <= other for one, other in expected)


def test_samples_across_missing_rows_are_another_run():
    whole = table_of(wavy(0, 1, RUN + 1))
    lacking = whole.filter(pl.col("moment") != 3)
    assert pairs_of([whole, whole], [0, 1]) and not pairs_of([whole, lacking], [0, 1])
    assert pairs_of([lacking, lacking], [0, 1]) == [(0, RUN)]


def test_held_speeds_are_told_without_their_repetitions():
    held = np.repeat(wavy(1, 1, 12), 3, axis=1)
    assert pairs_of([table_of(held), table_of(held)], [0, 1], every=1)


def test_nothing_is_found_where_there_is_nothing():
    empty = table_of(np.zeros((0, 0))).cast({"speed": pl.Float64, "vehicle": pl.Int64, "moment": pl.Int64})
    assert not pairs_of([empty, empty], [0, 1]) and not pairs_of([empty, table_of(wavy(0, 1, RUN))], [0, 1])
