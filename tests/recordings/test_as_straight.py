"""Recordings on roads that hardly bend, as prediction and planning take them."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from recordings_fakes import traffic

from coverdrive.errors import DataError
from coverdrive.prediction.segments import cut_segments
from coverdrive.recordings.recording import Recording
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import LaneEdges, Road
from coverdrive.simulation.replay import cut_scenarios

EDGES = np.array([0.0, 3.6, 7.2, 10.8])
ALONG = np.array([0.0, 60.0, 80.0, 600.0])
ENDING = Road(EDGES, 600.0, changing=LaneEdges(ALONG, np.array([EDGES, EDGES, [3.6, *EDGES[1:]], [3.6, *EDGES[1:]]])))
"""The right lane ends after 70 m"""


def recorded(road: Road) -> Recording:
    """Vehicles whose positions are the same in the frame of every road, at the speeds that belong to it."""
    table = traffic()
    lon, lat, along = (table[name].to_numpy() for name in ("lon", "lat", "speed"))
    across = np.where(table["vehicle"].to_numpy() == 1, 0.2, 0.0)
    along = np.sqrt(along**2 - across**2) * road.stretch(lon, lat)
    speed, heading = np.hypot(along, across), np.arctan2(across, along)
    return Recording("curve", table.with_columns(speed=pl.Series(speed), heading=pl.Series(heading)), 0.1, road, {})


def bending(radius: float) -> Road:
    return Road(EDGES, 600.0, ReferenceLine(np.zeros(2), 0.0, np.full(601, 1 / radius), 600.0, lat=10.8))


def test_a_straight_road_stays_as_it_is():
    recording = recorded(Road(EDGES, 600.0))
    assert recording.as_straight is recording


def test_speeds_become_rates_of_lon():
    recording, straight = recorded(bending(3000)), recorded(Road(EDGES, 600.0))
    right = recording.table.filter(pl.col("lat") < 3)["speed"].to_numpy()
    assert right == pytest.approx(22 * (1 + (10.8 - 1.8) / 3000), rel=1e-5)
    found = recording.as_straight
    assert (found.road.line, found.road.changing) == (None, None)
    for name in found.table.columns:
        assert found.table[name].to_numpy() == pytest.approx(straight.table[name].to_numpy(), abs=1e-9), name


def test_a_bend_is_refused_where_one_predicts_and_drives():
    recording = recorded(bending(800))
    for use in (cut_segments, cut_scenarios):
        with pytest.raises(
            DataError, match=r"recording curve: the road bends by 43°.*choose one that bends by at most"
        ):
            use([recording])


def test_rows_on_lanes_that_are_seldom_there_are_left_out():
    table = traffic().with_columns(lat=pl.col("lat") - pl.when(pl.col("vehicle") % 3 == 0).then(0.3).otherwise(0))
    table = table.filter((pl.col("vehicle") % 3 > 0) | (pl.col("lon") < 70))
    found = Recording("ramp", table, 0.1, ENDING, {}).as_straight
    assert found.road.edges == pytest.approx([0, 3.6, 7.2])
    assert set(found.table["vehicle"]) == {1, 2, 4, 5}
    assert found.table["lat"].min() == pytest.approx(1.8)


def test_who_comes_back_to_the_road_has_another_number():
    table = traffic().filter(pl.col("vehicle") % 3 > 0)
    away = (table["vehicle"] == 4).to_numpy() * np.clip(1.5 - (table["time"] - 5).abs().to_numpy(), 0, None)
    rate = np.where(away > 0, 3.1 * np.sign(table["time"].to_numpy() - 5), 0)
    table = table.with_columns(
        lat=table["lat"] - 3.1 * away, speed=pl.Series(np.hypot(22, rate)), heading=pl.Series(np.arctan2(rate, 22))
    )
    recording = Recording("ramp", table.filter(pl.col("vehicle") > 1), 0.1, ENDING, {})
    found = recording.as_straight.table
    own = recording.table.filter(pl.col("vehicle") == 4)["identity"][0]
    assert found.filter(pl.col("identity") == own)["vehicle"].unique().sort().to_list() == [4, 6]
    assert found.group_by("vehicle").len().sort("vehicle")["len"].to_list() == [100, 47, 100, 46]


def test_no_lane_in_the_middle_may_end():
    middle = np.array([EDGES, EDGES, [0, 3.6, 3.6, 7.2], [0, 3.6, 3.6, 7.2]])
    road = Road(EDGES, 600.0, changing=LaneEdges(ALONG, middle))
    with pytest.raises(DataError, match="recording curve: a lane in the middle of the road begins or ends"):
        _ = replace(recorded(Road(EDGES, 600.0)), road=road).as_straight
