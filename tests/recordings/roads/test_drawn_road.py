"""Roads from drawn lanes, on an arc whose every offset is known."""

import numpy as np
import pytest

from coverdrive.errors import DataError
from coverdrive.recordings.roads.drawn_road import DrawnLane, drawn_road
from coverdrive.road import Road

RADIUS = 400.0


def bound(start: float, end: float, *left: float) -> np.ndarray:
    """Points on the map between two positions [m], whose offsets to the left [m] change evenly between those given."""
    at = np.linspace(start, end, 60)
    offset = np.interp(at, np.linspace(start, end, len(left)), left) if left[1:] else np.full(60, left[0])
    angle = at / RADIUS
    return np.stack([(RADIUS - offset) * np.sin(angle), RADIUS - (RADIUS - offset) * np.cos(angle)], axis=-1)


def lane(start: float, end: float, left: float) -> DrawnLane:
    return DrawnLane(bound(start, end, left), bound(start, end, left - 3.5))


MAIN = [lane(0, 300, 0.0), lane(0, 300, -3.5)]
LON = np.arange(10.0, 300.0, 10.0)


def there(road: Road) -> list[list[float]]:
    """First and last of the positions at which each lane is there, from right to left."""
    return [[LON[seen].min(), LON[seen].max()] for seen in road.has_lane(LON).T]


def test_two_lanes():
    road = drawn_road(MAIN)
    assert road.edges == pytest.approx([0, 3.5, 7.0], abs=0.02)
    assert road.line is not None
    assert road.line.lat == pytest.approx(7.0, abs=0.1)
    assert road.length == pytest.approx(300, abs=0.3)
    x, y = bound(100, 200, -5.25).T
    lon, lat = road.to_road(x, y)
    assert lon == pytest.approx(np.linspace(100, 200, 60), abs=0.2)
    assert lat == pytest.approx(1.75, abs=0.1)


def test_a_ramp_comes_and_goes():
    ramp = DrawnLane(
        bound(40, 260, -27, -7, -7, -7, -7, -7, -17), bound(40, 260, -30.5, -10.5, -10.5, -10.5, -10.5, -10.5, -20)
    )
    road = drawn_road([*MAIN, ramp])
    assert road.edges == pytest.approx([0, 3.5, 7.0, 10.5], abs=0.05)
    (start, end), *others = there(road)
    assert start == pytest.approx(75, abs=10)
    assert end == pytest.approx(225, abs=10)
    assert others == [[10, 290], [10, 290]]
    assert road.edges_at(np.array([20.0])) == pytest.approx(np.array([[3.5, 3.5, 7.0, 10.5]]), abs=0.3)


def test_a_lane_narrows_until_it_is_gone():
    drop = DrawnLane(bound(0, 200, 3.5, 3.5, 0.0), bound(0, 200, 0.0))
    road = drawn_road([*MAIN, drop])
    assert road.has_lane(LON)[:, :2].all()
    # from 3.5 m at 100 m to nothing at 200 m: it is 2 m wide at 143 m
    assert there(road)[2] == [10, 140]
    assert road.edges_at(np.array([150.0]))[0, -1] == pytest.approx(7 + 1.75, abs=0.1)


def test_usual_widths_where_a_lane_in_the_middle_is_short():
    middle = DrawnLane(bound(200, 280, -3.5), bound(200, 280, -3.5, -7.0, -7.0, -3.5))
    aside = bound(0, 300, *[-3.5] * 8, -7.0, -7.0, -3.5)
    road = drawn_road([MAIN[0], middle, DrawnLane(aside, aside + bound(0, 300, -3.5) - bound(0, 300, 0.0))])
    assert np.mean(road.has_lane(LON)[:, 1]) < 0.2
    assert np.diff(road.edges) == pytest.approx([3.5, 3.5, 3.5], abs=0.05)
    assert road.edges_at(np.array([50.0]))[0, -1] == pytest.approx(road.edges[-1], abs=0.05)


def test_usual_widths_where_a_lane_is_wider_beside_a_ramp():
    wide = DrawnLane(MAIN[1].left, bound(0, 300, -7.0, -7.0, -7.0, -7.0, -8.0, -8.0))
    road = drawn_road([MAIN[0], wide, lane(250, 300, -8.0)])
    assert np.diff(road.edges) == pytest.approx([3.5, 3.5, 3.5], abs=0.1)


def test_one_lane_after_another_lies_in_one_column():
    road = drawn_road([*MAIN, lane(0, 85, 3.5), lane(155, 300, 3.5)])
    assert road.lanes == 3
    assert LON[road.has_lane(LON)[:, 2]].tolist() == [*range(10, 90, 10), *range(160, 300, 10)]


def test_other_carriageways_are_no_part_of_it():
    oncoming = DrawnLane(bound(0, 300, 0.0)[::-1], bound(0, 300, 3.5)[::-1])
    beyond = lane(0, 300, -12.0)
    crossing = DrawnLane(np.array([[100.0, -50], [100, 50]]), np.array([[103.5, -50], [103.5, 50]]))
    for other in (oncoming, beyond, crossing):
        assert drawn_road([*MAIN, other]).edges == pytest.approx(drawn_road(MAIN).edges)


@pytest.mark.parametrize(
    ("lanes", "problem"),
    [
        ([DrawnLane(MAIN[0].right, MAIN[0].left)], "the lane that leads the road is -3.5 m wide"),
        ([DrawnLane(MAIN[0].left, MAIN[0].right[::-1])], "the lane that leads the road is"),
        ([DrawnLane(np.zeros((4, 2)), MAIN[0].right)], "not between 1 m and"),
        ([DrawnLane(MAIN[0].left * 1e6, MAIN[0].right)], "not between 1 m and"),
    ],
)
def test_what_is_no_road_is_refused(lanes: list[DrawnLane], problem: str):
    with pytest.raises(DataError, match=problem):
        drawn_road(lanes)


def test_a_lane_far_away_costs_nothing():
    away = DrawnLane(MAIN[1].left * 1e6, MAIN[1].right * 1e6)
    assert drawn_road([*MAIN, away]).edges == pytest.approx(drawn_road(MAIN).edges)


def test_lanes_in_any_order():
    third, fourth = lane(0, 300, -7.0), lane(0, 300, 3.5)
    for others in ([MAIN[1], third, fourth], [fourth, third, MAIN[1]]):
        assert drawn_road([MAIN[0], *others]).edges == pytest.approx([0, 3.5, 7, 10.5, 14], abs=0.05)


def test_lanes_around_centre_lines():
    lanes = [DrawnLane.around(bound(0, 300, left - 1.75), 3.5) for left in (0.0, -3.5)]
    assert drawn_road(lanes).edges == pytest.approx([0, 3.5, 7.0], abs=0.02)
    assert np.abs(lanes[0].left - MAIN[0].left).max() < 0.05
