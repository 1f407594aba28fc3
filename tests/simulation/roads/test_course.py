import numpy as np
import pytest

from coverdrive.road import LaneEdges, Road
from coverdrive.simulation.roads.course import AHEAD, COMFORT, Course
from coverdrive.simulation.roads.settings import RoadSettings


def test_a_straight_road_asks_for_nothing() -> None:
    course = Course(Road.straight())
    assert np.array_equal(course.ends, [[-np.inf] * 3, [np.inf] * 3])
    assert not course.way_out.any()
    assert np.isinf(course.speed_at(np.array([0.0, 500.0]))).all()


def test_the_lane_of_a_ramp_ends_where_it_begins_to_narrow() -> None:
    course = Course(RoadSettings(ramp=400.0).road_of(1000.0))
    assert course.ends[0].tolist() == [-np.inf] * 4
    assert course.ends[1][0] == pytest.approx(400.0, abs=10.0)
    assert np.isinf(course.ends[1][1:]).all()
    assert course.way_out.tolist() == [1, 0, 0, 0]


def test_lanes_that_begin_and_two_that_end() -> None:
    """The two lanes to the left end one after the other; the rightmost one begins."""
    lat = np.array(
        [[3.6, 3.6, 7.2, 10.8, 14.4], [0, 3.6, 7.2, 10.8, 14.4], [0, 3.6, 7.2, 10.8, 10.8], [0, 3.6, 7.2, 7.2, 7.2]]
    )
    lon = np.array([100.0, 110.0, 300.0, 500.0])
    edges = np.arange(5) * 3.6
    road = Road(edges, 1000.0, changing=LaneEdges(lon, lat))
    course = Course(road)
    assert course.ends[0] == pytest.approx([110.0, -np.inf, -np.inf, -np.inf], abs=3.0)
    assert np.isinf(course.ends[1][:2]).all()
    assert 300 < course.ends[1][2] < 330 and course.ends[1][3] < 140
    assert course.way_out.tolist() == [0, 0, -1, -1]
    through = course.through.edges_at(np.array([0.0, 600.0]))
    assert through == pytest.approx(np.array([[3.6, 3.6, 7.2], [0.0, 3.6, 7.2]]))
    assert Course(road.mirrored()).way_out.tolist() == [1, 1, 0, 0]


def test_bends_and_limits_allow_speeds_that_are_braked_to_in_time() -> None:
    bend = ((500.0, 0.0), (501.0, 0.005), (700.0, 0.005), (701.0, 0.0))
    course = Course(RoadSettings(curvature=bend, speed_limit=30.0).road_of(1000.0))
    inside = np.sqrt(COMFORT * 200)
    lon = np.array([0.0, 400.0, 600.0, 690.0, 720.0])
    before = np.sqrt(inside**2 + 2 * AHEAD * 100.0)
    assert course.speed_at(lon) == pytest.approx([30.0, before, inside, inside, 30.0], rel=0.01)
