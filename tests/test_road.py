"""Roads that bend, and roads whose lanes begin and end."""

import jax
import numpy as np
import pytest

from coverdrive.errors import SettingError
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import LaneEdges, Road
from shape_checks import unchecked

RADIUS = 200.0
LINE = ReferenceLine(np.array([3.0, 4.0]), 0.4, np.full(301, 1 / RADIUS), 300.0, lat=2.0)
CURVED = Road(np.arange(4) * 3.5, 300.0, LINE)

RAMP = LaneEdges(
    np.array([0.0, 100.0, 120.0, 200.0, 240.0]),
    np.array([[3.5, 3.5, 7, 10.5], [3.5, 3.5, 7, 10.5], [0, 3.5, 7, 10.5], [0, 3.5, 7, 10.5], [3.5, 3.5, 7, 10.5]]),
)
"""A lane on the right that comes between 100 m and 120 m and goes between 200 m and 240 m"""
WITH_RAMP = Road(np.arange(4) * 3.5, 300.0, changing=RAMP)


def test_a_straight_road_is_its_own_map():
    road, lon, lat = Road.straight(), np.array([-5.0, 700.0]), np.array([1.0, 9.0])
    for there in (road.to_road, road.to_map):
        assert np.array_equal(there(lon, lat), (lon, lat))
    assert np.array_equal(road.heading_to_road(lon, lat), lat)
    assert np.array_equal(road.heading_to_map(lon, lat), lat)
    assert np.array_equal(road.velocity_to_road(lon, lat, lat, lon), (lat, lon))
    assert np.array_equal(road.velocity_to_map(lon, lat, lat, lon), (lat, lon))
    assert np.array_equal(road.stretch(lon, lat), [1, 1])
    assert np.array_equal(road.curvature(lon), [0, 0])
    assert np.array_equal(road.edges_at(lon), [road.edges, road.edges])
    assert np.array_equal(road.rates(lon, lon, lat, lat), (lat, lat))
    anywhere = np.linspace(-5, 15, 201)
    assert np.array_equal(road.lane_at(0 * anywhere, anywhere), road.lane_of(anywhere))


def test_velocities_and_headings_are_those_of_the_motion():
    def at(time: float) -> tuple[np.ndarray, np.ndarray]:
        return np.array([20 + 25 * time]), np.array([1.0 + 2 * time])

    step = 1e-5
    before, now, after = (CURVED.to_map(*at(time)) for time in (1 - step, 1.0, 1 + step))
    velocity = (np.array(after) - np.array(before)) / (2 * step)
    lon, lat = at(1.0)
    assert np.stack(CURVED.to_road(*now)) == pytest.approx(np.stack(at(1.0)), abs=1e-8)
    found = CURVED.velocity_to_map(lon, lat, np.array([25.0]), np.array([2.0]))
    assert np.stack(found) == pytest.approx(velocity, abs=1e-4)
    rates = CURVED.velocity_to_road(lon, lat, *velocity)
    assert np.ravel(rates) == pytest.approx([25.0, 2.0], abs=1e-4)
    heading = np.arctan2(velocity[1], velocity[0])
    along = 25 * (1 - (lat - 2.0) / RADIUS)
    assert CURVED.heading_to_road(lon, heading) == pytest.approx(np.arctan2(2.0, along), abs=1e-6)
    assert CURVED.heading_to_map(lon, CURVED.heading_to_road(lon, heading)) == pytest.approx(heading)
    speed, turned = CURVED.rates(lon, lat, np.hypot(*velocity), CURVED.heading_to_road(lon, heading))
    assert np.ravel([speed * np.cos(turned), speed * np.sin(turned)]) == pytest.approx([25.0, 2.0], abs=1e-4)


def test_who_stands_keeps_a_heading():
    lon, lat, heading = np.full(3, 40.0), np.array([1.0, 2.0, 9.0]), np.array([0.7, np.pi / 2, -3.0])
    speed, turned = CURVED.rates(lon, lat, np.zeros(3), heading)
    assert (speed == 0).all()
    assert turned == pytest.approx(CURVED.rates(lon, lat, np.ones(3), heading)[1])
    assert np.ravel(CURVED.bodies_to_map(lon, lat, turned)[1]) == pytest.approx(CURVED.heading_to_map(lon, heading))


def test_lanes_begin_and_end():
    lon = np.array([50.0, 105.0, 150.0, 215.0, 235.0, 280.0])
    there = [False, False, True, True, False, False]
    assert WITH_RAMP.has_lane(lon)[:, 0].tolist() == there
    assert WITH_RAMP.has_lane(lon)[:, 1:].all()
    assert WITH_RAMP.edges_at(np.array(110.0)) == pytest.approx([1.75, 3.5, 7.0, 10.5])
    assert WITH_RAMP.lane_at(lon, np.full(6, 1.0)).tolist() == [0 if each else 1 for each in there]
    assert WITH_RAMP.lane_at(lon, np.full(6, 8.0)).tolist() == [2] * 6
    assert WITH_RAMP.lane_at(lon, np.full(6, 30.0)).tolist() == [2] * 6


def test_mirrored_roads():
    lon, lat = np.linspace(0, 300, 31), np.linspace(0, 10, 31)
    x, y = CURVED.to_map(lon, lat)
    assert np.stack(CURVED.mirrored().to_map(lon, -lat)) == pytest.approx(np.stack([x, -y]), abs=1e-9)
    assert WITH_RAMP.mirrored().edges_at(lon) == pytest.approx(-WITH_RAMP.edges_at(lon)[:, ::-1])
    assert (WITH_RAMP.side, WITH_RAMP.mirrored().side) == ("right", "left")


@pytest.mark.parametrize("edges", [[0.0, 3.6], (0.0, 3.6)])
def test_bare_numbers_are_refused_where_they_are_given(edges):
    with unchecked(), pytest.raises(SettingError, match=r"expected an array, as np\.array\(.0\.0, 3\.6"):
        Road(edges, 100.0)


def test_roads_are_trees_of_arrays():
    leaves, kind = jax.tree.flatten(CURVED)
    assert jax.tree.unflatten(kind, leaves).line.to_road(3.0, 4.0) == pytest.approx((0.0, 2.0))
    assert len(jax.tree.leaves(Road.straight())) == 2
