"""The lines on roads whose lanes begin and end."""

import numpy as np

from coverdrive.road import Road
from coverdrive.road_markings import across, drawn_edges, markings
from ramp_road import RAMP


def test_edges_are_drawn_where_there_are_lanes_on_both_sides():
    drawn = drawn_edges(RAMP, np.array([50.0, 105.0, 150.0, 235.0, 290.0]))
    assert drawn[:, [0, 3]].all() and drawn[:, 2].all()
    assert drawn[:, 1].tolist() == [False, False, True, False, False]
    assert drawn_edges(Road.straight(), np.zeros(2)).all()


def test_lines_follow_the_edges_borders_first():
    lines = markings(RAMP, -20.0, 320.0)
    assert [line.outer for line in lines] == [True, True, False, False]
    right, left, beside, between = (line.points for line in lines)
    assert right.tolist() == [[-20, 3.5], [0, 3.5], [100, 3.5], [120, 0], [200, 0], [240, 3.5], [320, 3.5]]
    assert set(left[:, 1]) == {10.5} and set(between[:, 1]) == {7.0}
    assert beside.tolist() == [[120, 3.5], [200, 3.5]]
    assert [line.points.tolist() for line in markings(Road.straight(2), 5.0, 9.0)] == [
        [[5, 0], [9, 0]],
        [[5, 7.2], [9, 7.2]],
        [[5, 3.6], [9, 3.6]],
    ]
    assert across(RAMP) == (0.0, 10.5)
