"""Raw rows become regular tracks, whatever their order."""

from collections import Counter

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from coverdrive.recordings.tracks.reading import regular_table
from coverdrive.recordings.tracks.repair import RawTracks, drop_off_road
from coverdrive.recordings.tracks.smoothing import SmoothingSettings
from coverdrive.road import Road

ROAD = Road.straight()


def raw_of(rows: list[tuple[int, int]]) -> RawTracks:
    """Vehicles at 1 m per moment, each on its own lateral position."""
    vehicle, moment = (np.array(column, dtype=np.int64) for column in zip(*rows, strict=True))
    size = np.full(len(rows), 4.0)
    return RawTracks(vehicle, moment, 1.0 * moment, 1.0 * vehicle, size, size / 2, 2.5 * size, 0 * vehicle)


@hypothesis_settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 60)), min_size=1, max_size=80))
def test_tracks_have_no_gaps_and_every_measured_row(rows: list[tuple[int, int]]):
    repairs: Counter[str] = Counter()
    table = regular_table(raw_of(rows), 0.1, SmoothingSettings(), repairs, ROAD)
    moment = np.rint(table["time"].to_numpy() * 10).astype(int)
    vehicle = table["vehicle"].to_numpy()
    same = np.diff(vehicle) == 0
    assert np.all(np.diff(moment)[same] == 1)
    assert np.all(np.diff(vehicle) >= 0)
    assert table["lon"].to_numpy() == pytest.approx(moment, abs=1e-6)
    assert repairs["duplicated rows"] == len(rows) - len(set(rows))
    assert repairs["conflicting rows"] == 0
    assert np.array_equal(table["seen_lat"].to_numpy(), table["lat"].to_numpy().round())
    tracks = len({vehicle for vehicle, _ in rows}) + repairs["split tracks"] - repairs["dropped tracks"]
    assert table["vehicle"].n_unique() == tracks


@hypothesis_settings(deadline=None)
@given(st.permutations([(vehicle, moment) for vehicle in (1, 2) for moment in (0, 1, 2, 3, 5, 30, 31)]))
def test_the_order_of_rows_changes_nothing(rows: list[tuple[int, int]]):
    repairs: Counter[str] = Counter()
    expected = regular_table(raw_of(sorted(rows)), 0.1, SmoothingSettings(), Counter(), ROAD)
    assert regular_table(raw_of(rows), 0.1, SmoothingSettings(), repairs, ROAD).equals(expected)
    assert (repairs["split tracks"], repairs["interpolated rows"]) == (2, 2)


@pytest.mark.parametrize("late", [0.4, 0.5, 0.8])
def test_a_first_row_of_a_later_moment_makes_no_vehicle_slow(late: float):
    """As of converters that keep every n-th row of a recording, and the first one of every vehicle."""
    raw = raw_of([(vehicle, moment) for vehicle in range(4) for moment in range(vehicle, 30)])
    starts, repairs = np.flatnonzero(np.diff(raw.moment, prepend=99) < 0), Counter[str]()
    raw.lon[starts[:3]] += late
    raw.lon[starts[3] :] = 3 + 0.05 * (raw.moment[starts[3] :] - 3) ** 2  # drives off
    raw.speed[starts[3] :] = raw.moment[starts[3] :] - 3.0
    raw.speed[starts[2] : starts[3]] = np.nan  # of which nothing is stated
    table = regular_table(raw, 0.1, SmoothingSettings(), repairs, ROAD)
    assert +repairs == {"late first rows": 2}
    assert table.filter(pl.col("vehicle") < 2)["speed"].to_numpy() == pytest.approx(10.0)
    assert table["vehicle"].value_counts(sort=True)["count"].to_list() == [28 - 1, 27 - 1, 26, 25]


def test_a_first_row_that_is_rough_or_alone_of_its_kind_is_kept():
    """Noise of positions makes some steps short, at the beginning, too."""
    raw, repairs = raw_of([(vehicle, moment) for vehicle in range(11) for moment in range(9)]), Counter[str]()
    raw.lon[0] += 0.8
    raw.lon[9:90:9] += 0.2
    regular_table(raw, 0.1, SmoothingSettings(), repairs, ROAD)
    assert +repairs == {}


def test_the_first_of_conflicting_rows_is_kept():
    raw = raw_of([(1, 0), (1, 1), (1, 2), (1, 2), (1, 3)])
    raw.lon[3] = 50.0
    repairs: Counter[str] = Counter()
    table = regular_table(raw, 0.1, SmoothingSettings(), repairs, ROAD)
    assert table["lon"].to_list() == pytest.approx([2, 3])
    assert +repairs == {"duplicated rows": 1, "conflicting rows": 1}


def test_interpolation_lies_between_the_neighbours():
    raw = raw_of([(1, 0), (1, 1), (1, 5), (1, 6)])
    raw.lat[2:] = 3.0
    table = regular_table(raw, 0.1, SmoothingSettings(window=0.1, order=1), Counter(), ROAD)
    assert len(table) == 5
    assert table["lat"][1] == pytest.approx(2.0)  # half-way from 1 m to 3 m


def test_rows_beside_the_road_are_dropped_and_counted():
    raw = raw_of([(vehicle, moment) for vehicle in (-3, -1, 5, 13) for moment in range(5)])
    repairs: Counter[str] = Counter()
    kept = drop_off_road(raw, Road.straight(3, 3.6), repairs)
    assert set(kept.vehicle) == {-1, 5}
    assert +repairs == {"rows off the road": 10}


def test_nothing_is_left_of_single_rows():
    table = regular_table(raw_of([(1, 0), (2, 5)]), 0.1, SmoothingSettings(), repairs := Counter(), ROAD)
    assert table.is_empty()
    assert table["vehicle"].dtype == pl.Int64
    assert repairs["dropped tracks"] == 2
