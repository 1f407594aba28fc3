"""Lane edges from what vehicles do."""

import numpy as np
import pytest

from coverdrive.recordings.roads.lanes import edges_from_lanes, edges_from_width


def test_edges_lie_between_the_medians():
    right = np.concatenate([np.full(100, 2.0), np.full(100, 5.0), np.full(100, 9.0)])
    edges = edges_from_lanes(right, np.repeat([1, 2, 3], 100))
    assert edges == pytest.approx([0.5, 3.5, 7.0, 11.0])


def test_names_of_lanes_have_no_meaning():
    right = np.concatenate([np.full(100, 9.0), np.full(100, 5.0), np.full(100, 2.0)])
    assert edges_from_lanes(right, np.repeat([1, 2, 3], 100)) == pytest.approx([0.5, 3.5, 7.0, 11.0])


def test_rare_lanes_and_doubled_lanes_are_left_out():
    right = np.concatenate([np.full(500, 2.0), np.full(490, 5.5), np.full(15, 6.5), np.full(5, 12.0)])
    lane = np.repeat([1, 2, 6, 7], [500, 490, 15, 5])
    assert edges_from_lanes(right, lane) == pytest.approx([0.25, 3.75, 7.25])
    frequent = np.concatenate([right, np.full(300, 6.5)])
    assert len(edges_from_lanes(frequent, np.concatenate([lane, np.full(300, 6)]))) == 3


def test_one_lane_has_the_usual_width():
    assert edges_from_lanes(np.full(10, 2.0), np.ones(10, dtype=int)) == pytest.approx([2 - 1.8288, 2 + 1.8288])


def test_lanes_without_names_are_12_ft_wide():
    right = np.concatenate([np.full(100, 1.8), np.full(100, 5.4)])
    assert edges_from_width(right) == pytest.approx([0, 3.6576, 7.3152])
    assert len(edges_from_width(np.append(right, 100.0))) == 3  # one row far away is no lane
