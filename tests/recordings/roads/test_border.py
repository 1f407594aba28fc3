"""Roads along the border of a lane that ends or begins, on small networks drawn along the x axis."""

from typing import Any

import numpy as np
import pytest
from lanelet_fakes import ends, piece, side

from coverdrive.errors import DataError
from coverdrive.recordings.roads.border import lanes_along_border
from coverdrive.recordings.roads.drawn_road import TOUCHING, drawn_road
from coverdrive.road import Road


def merge(up: int = 1) -> list[Any]:
    """Main lanelets 1 to 3; a ramp, 11, leads to lanelet 12 beside the second: to its right, or to its left."""
    beside, back = ("right", "left") if up == 1 else ("left", "right")
    return [
        piece(1, 0, 100, 0.0, successor=[2]),
        piece(2, 100, 250, 0.0, successor=[3], **side(**{beside: 12})),
        piece(3, 250, 400, 0.0),
        piece(11, 0, 100, -9.5 * up, -3.5 * up, successor=[12]),
        piece(12, 100, 250, -3.5 * up, **side(**{back: 2})),
    ]


def exit_lane() -> list[Any]:
    """The same backwards: lanelet 12 begins beside the second, and 13 leaves."""
    main = merge()[:3]
    return [*main, piece(12, 100, 250, -3.5, successor=[13], **side(left=2)), piece(13, 250, 350, -3.5, -9.5)]


def test_a_lane_that_ends_leads_to_the_border_of_the_next():
    (guide, *others) = lanes_along_border(merge(), {11}, {3}) or ()
    assert ends(guide) == [[0, -9.5], [400, -3.5]]
    assert guide.right[-1].tolist() == [400, -3.5]
    assert [ends(other) for other in others] == [[[0, 0], [400, 0]]]


def test_a_lane_to_the_left_that_ends():
    (guide, *_) = lanes_along_border(merge(-1), {11}, {3}) or ()
    assert guide.left[0].tolist() == guide.right[0].tolist() == [0, 6]
    assert ends(guide) == [[0, 6], [400, 0]] and guide.right[-1].tolist() == [400, -3.5]


def test_a_lane_that_begins():
    (guide, *others) = lanes_along_border(exit_lane(), {1}, {13}) or ()
    assert ends(guide) == [[0, -3.5], [350, -9.5]] and guide.right[-1].tolist() == [350, -13]
    assert [ends(other) for other in others] == [[[0, 0], [400, 0]]]


def test_no_border_leads_to_another_road():
    assert lanes_along_border([*merge(), piece(50, 0, 400, 60.0)], {11}, {50}) is None


@pytest.mark.parametrize(
    ("lanelets", "first", "last", "there"),
    [
        (merge(), 11, 3, [(50.0, [True, False]), (150.0, [True, True]), (350.0, [False, True])]),
        (exit_lane(), 1, 13, [(50.0, [False, True]), (150.0, [True, True]), (330.0, [True, False])]),
    ],
    ids=["merge", "exit"],
)
def test_the_road_has_the_lanes_that_are_there(
    lanelets: list[Any], first: int, last: int, there: list[tuple[float, list[bool]]]
) -> None:
    road = drawn_road(lanes_along_border(lanelets, {first}, {last}) or [], TOUCHING)
    assert isinstance(road, Road)
    for lon, lanes in there:
        assert road.has_lane(lon).tolist() == lanes


def test_a_border_with_nothing_to_its_right_is_no_road():
    lanes = lanes_along_border(merge(), {1}, {3}) or []
    alone = [lanes[0]._replace(left=lanes[0].left + np.array([0.0, -3.5]), right=lanes[0].left + np.array([0, -3.5]))]
    with pytest.raises(DataError, match="0 m wide"):
        drawn_road(alone)
