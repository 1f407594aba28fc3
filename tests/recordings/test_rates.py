"""Recordings on roads that bend and whose lanes end are predicted and replayed in the frame of their road."""

import numpy as np
import polars as pl
import pytest
from recordings_fakes import traffic

from coverdrive.prediction.data.segments import SegmentSettings, cut_segments
from coverdrive.prediction.learning.affordance import FEATURES
from coverdrive.prediction.learning.samples import make_features
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import LaneEdges, Road
from coverdrive.simulation.traffic.replay import cut_scenarios

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


def test_rates_of_a_straight_road_are_the_table():
    recording = recorded(Road(EDGES, 600.0))
    assert recording.rates is recording.table


@pytest.mark.parametrize("radius", [150, -150, 3000])
def test_rates_are_those_of_lon_and_lat(radius: float):
    recording, straight = recorded(bending(radius)), recorded(Road(EDGES, 600.0))
    right = recording.table.filter(pl.col("lat") < 3)["speed"].to_numpy()
    assert right == pytest.approx(22 * (1 + (10.8 - 1.8) / radius), rel=1e-3)
    for name in SCHEMA:
        assert recording.rates[name].to_numpy() == pytest.approx(straight.table[name].to_numpy(), abs=1e-9), name
    table, road = recording.table, recording.road
    lon, lat, speed, heading = (table[name].to_numpy() for name in ("lon", "lat", "speed", "heading"))
    on_map = road.heading_to_map(lon, heading)
    velocity = road.velocity_to_road(lon, lat, speed * np.cos(on_map), speed * np.sin(on_map))
    speed, heading = (recording.rates[name].to_numpy() for name in ("speed", "heading"))
    assert np.stack([speed * np.cos(heading), speed * np.sin(heading)]) == pytest.approx(np.stack(velocity), abs=1e-9)


def test_segments_features_scenes_and_scenarios_are_the_same_on_every_bend():
    bent, straight = recorded(bending(150)), recorded(Road(EDGES, 600.0))
    one, other = (cut_segments([each], SegmentSettings(stride=2.0)) for each in (bent, straight))
    assert one.points == pytest.approx(other.points, abs=1e-8) and len(one) > 10
    assert one.speed == pytest.approx(other.speed) and one.heading == pytest.approx(other.heading, abs=1e-9)
    assert make_features([bent], one) == pytest.approx(make_features([straight], other), abs=1e-4)
    assert bent.scene_at(2.0).states == pytest.approx(straight.scene_at(2.0).states)
    assert cut_scenarios([bent])[0].states == pytest.approx(cut_scenarios([straight])[0].states, abs=1e-9)
    assert cut_scenarios([bent])[0].road is bent.road


def test_who_is_on_a_lane_that_ends_is_kept_and_a_neighbour_while_it_is_there():
    table = traffic().filter((pl.col("vehicle") % 3 > 0) | (pl.col("lon") < 70))
    recording = Recording("ramp", table, 0.1, ENDING, {})
    segments = cut_segments([recording], SegmentSettings(horizon=1.0, stride=0.1))
    features = make_features([recording], segments)
    lon, lat = (table[name].to_numpy()[segments.row] for name in ("lon", "lat"))
    on_ramp, beside = lat < 3.6, (lat > 3.6) & (lat < 7.2)
    assert on_ramp.any() and beside.any()
    assert np.abs(features[on_ramp, FEATURES.index("distance to lane centre")]).max() < 0.1
    no_lane = features[:, FEATURES.index("right front clearance")] == 0
    assert no_lane[beside & (lon > 75)].all() and not no_lane[beside & (lon < 65)].any()
