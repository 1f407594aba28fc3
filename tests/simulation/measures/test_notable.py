"""Which trials are worth a look."""

import polars as pl

from coverdrive.simulation.measures.notable import liveliest, notable

TRIALS = pl.DataFrame(
    {
        "trial": [0, 1, 2, 3, 4],
        "kind": ["finished", "side", "finished", "finished", "finished"],
        "time": [20.0, 3.0, 20.0, 20.0, 20.0],
        "lane_changes": [0, 9, 1, 2, 0],
        "overtakes": [0, 9, 1, 2, 0],
        "minimum_gap": [0.8, 0.0, 0.3, 5.0, 5.0],
        "minimum_time_to_collision": [9.0, 0.0, 9.0, 9.0, 0.5],
    }
)


def test_the_liveliest_lasts_longest_first() -> None:
    assert liveliest(TRIALS) == 3


def test_collisions_come_first_then_near_misses_and_the_liveliest_last() -> None:
    assert notable(TRIALS, 9) == [1, 2, 0, 4, 3]
    assert notable(TRIALS, 3) == [1, 2, 3]
    assert notable(TRIALS, 1) == [1]
    assert notable(TRIALS, 0) == []


def test_without_danger_the_least_gap_comes_first() -> None:
    calm = TRIALS.filter(pl.col("trial") != 1).with_columns(
        minimum_gap=pl.Series([7.0, 3.0, 5.0, 5.0]), minimum_time_to_collision=9.0
    )
    assert notable(calm, 9) == [2, 3]
    assert notable(calm, 1) == [2]


def test_a_lively_collision_leaves_its_place_to_another_danger() -> None:
    assert notable(TRIALS.with_columns(lane_changes=pl.Series([9, 0, 0, 0, 0])), 3) == [1, 2, 0]


def test_nothing_is_named_twice() -> None:
    assert notable(TRIALS.filter(pl.col("trial") == 1), 9) == [1]
