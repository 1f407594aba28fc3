"""Which trials are worth a look."""

import polars as pl

from coverdrive.simulation.notable import liveliest, notable

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


def test_order_is_liveliest_collisions_near_misses() -> None:
    assert notable(TRIALS, 9) == [3, 1, 2, 0, 4]
    assert notable(TRIALS, 3) == [3, 1, 2]
    assert notable(TRIALS, 0) == []


def test_nothing_is_named_twice() -> None:
    assert notable(TRIALS.filter(pl.col("trial") == 1), 9) == [1]
