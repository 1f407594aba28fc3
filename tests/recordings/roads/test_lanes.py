"""Lane edges from what vehicles do."""

import numpy as np
import pytest

from coverdrive.recordings.roads.lanes import edges_from_lanes, edges_from_tracks, edges_from_width


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


@pytest.mark.parametrize("few", [0, 1])
def test_lanes_that_nobody_or_few_drive_in_are_filled_in(few: int):
    right = np.concatenate([np.full(100, 1.8), np.full(few, 5.4), np.full(100, 9.0), np.full(100, 12.6)])
    lane = np.repeat([1, 2, 3, 4], [100, few, 100, 100])
    expected = pytest.approx([0, 3.6, 7.2, 10.8, 14.4])
    assert edges_from_lanes(right, lane) == expected
    assert edges_from_lanes(right, -lane) == expected
    assert edges_from_tracks(right) == pytest.approx([0, 3.6, 7.2, 10.8, 14.4], abs=0.01)


@pytest.mark.parametrize(("way", "lanes"), [(8.6, 3), (8.0, 2), (10.8, 3), (14.0, 4), (5.0, 1)])
def test_as_many_lanes_are_filled_in_as_are_as_wide_as_lanes(way: float, lanes: int):
    """If that leaves a choice as many as the numbers say, here three, and else such as are usual."""
    right, lane = np.repeat([2.0, 2 + way], 100), np.repeat([4, 1], 100)
    assert np.diff(edges_from_lanes(right, lane)) == pytest.approx(way / lanes)


@pytest.mark.parametrize(
    ("way", "usual", "lanes"), [(5.6, 3.6, 1), (5.9, 3.6, 1), (6.1, 3.6, 2), (5.7, 2.9, 2), (5.9, 3.3, 1)]
)
def test_no_narrow_lanes_are_filled_in_beside_wide_ones(way: float, usual: float, lanes: int):
    right = np.repeat([2.0, 2 + usual, 2 + usual + way], 100)
    edges = edges_from_lanes(right, np.repeat([1, 2, 4], 100))
    assert edges is not None and len(edges) == 3 + lanes


def test_lanes_too_far_apart_for_their_numbers_are_refused():
    right = np.repeat([1.8, 12.6], 100)
    assert edges_from_lanes(right, np.repeat([1, 2], 100)) is None
    assert edges_from_lanes(right, np.repeat([1, 3], 100)) is not None


def test_one_lane_has_the_usual_width():
    assert edges_from_lanes(np.full(10, 2.0), np.ones(10, dtype=int)) == pytest.approx([2 - 1.8288, 2 + 1.8288])


def test_lanes_without_names_are_12_ft_wide():
    right = np.concatenate([np.full(100, 1.8), np.full(100, 5.4)])
    assert edges_from_width(right) == pytest.approx([0, 3.6576, 7.3152])
    assert len(edges_from_width(np.append(right, 100.0))) == 3  # one row far away is no lane
