"""Which trials are worth a look."""

import numpy as np
import polars as pl
import pytest

from coverdrive.recordings.recording import IDENTITY, SCHEMA, Recording
from coverdrive.road import Road
from coverdrive.simulation.measures.notable import liveliest, notable, recorded_near_misses

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


@pytest.mark.parametrize(
    ("lon", "lat", "speed", "near"),
    [
        ((50.0, 50.0, 150.0), (1.8, 4.5, 1.8), (20.0, 20.0, 20.0), 2),  # 0.9 m beside
        ((50.0, 50.0, 150.0), (1.8, 4.7, 1.8), (20.0, 20.0, 20.0), 0),  # 1.1 m
        (
            (50.0, 55.7, 150.0),
            (1.8, 1.8, 1.8),
            (20.0, 20.0, 20.0),
            2,
        ),  # 0.9 m behind: both came near
        ((50.0, 55.4, 150.0), (1.8, 4.3, 1.8), (20.0, 20.0, 20.0), 2),  # 0.9 m from corner to corner
        ((50.0, 55.6, 150.0), (1.8, 4.4, 1.8), (20.0, 20.0, 20.0), 0),  # 1.1 m
        ((50.0, 70.0, 150.0), (1.8, 1.8, 5.4), (40.0, 20.0, 20.0), 2),  # 0.8 s at the start, then in contact
        ((50.0, 75.2, 150.0), (1.8, 1.8, 5.4), (30.0, 20.0, 20.0), 0),  # 2 s
    ],
)
def test_recorded_vehicles_came_as_near(lon: tuple, lat: tuple, speed: tuple, near: int) -> None:
    """Three vehicles of 4.8 by 1.8 m, seen for 0.4 s."""
    moment = np.arange(4)
    columns = {
        "vehicle": np.repeat([1, 2, 3], 4), "group": np.zeros(12, int), "time": np.tile(0.1 * moment, 3),
        "lon": (np.array(lon)[:, None] + 0.1 * np.array(speed)[:, None] * moment).ravel(), "lat": np.repeat(lat, 4),
        "speed": np.repeat(speed, 4), "heading": np.zeros(12), "length": np.full(12, 4.8), "width": np.full(12, 1.8),
    }  # fmt: skip
    recording = Recording("made", pl.DataFrame(columns, schema=SCHEMA), 0.1, Road.straight(2), {})
    assert recorded_near_misses([recording]) == pytest.approx({"share": near / 3, "seconds": 0.4})


def test_a_vehicle_that_several_recordings_show_counts_once_where_it_is_seen_longest() -> None:
    """Two vehicles beside each other, and a third one alone; then the first two again, for longer and far apart."""

    def recording(name: str, lon: list[float], lat: list[float], identity: list[int], rows: int) -> Recording:
        count, moment = len(lon), np.arange(rows)
        columns = {
            "vehicle": np.repeat(np.arange(count), rows), "group": np.zeros(count * rows, int),
            "time": np.tile(0.1 * moment, count), "lon": (np.array(lon)[:, None] + 2.0 * moment).ravel(),
            "lat": np.repeat(lat, rows), "speed": np.full(count * rows, 20.0), "heading": np.zeros(count * rows),
            "length": np.full(count * rows, 4.8), "width": np.full(count * rows, 1.8),
            "identity": np.repeat(identity, rows),
        }  # fmt: skip
        return Recording(name, pl.DataFrame(columns, schema=SCHEMA | IDENTITY), 0.1, Road.straight(2), {})

    near = recording("near", [50.0, 50.0, 150.0], [1.8, 4.5, 1.8], [7, 8, 9], 4)
    apart = recording("apart", [50.0, 150.0], [1.8, 1.8], [8, 7], 8)
    assert recorded_near_misses([near]) == pytest.approx({"share": 2 / 3, "seconds": 0.4})
    assert recorded_near_misses([near, near]) == recorded_near_misses([near])
    assert recorded_near_misses([near, apart]) == pytest.approx({"share": 0.0, "seconds": 2.0 / 3})
