"""The axis of scores: where scores, thresholds and ticks are."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coverdrive.prediction.fits.learned import EDGES
from coverdrive.reporting.figures.learned import ScoreAxis

NO_MARKS = np.empty(0)


def counts_at(*scores: float) -> np.ndarray:
    return np.histogram(np.array(scores), EDGES)[0][None]


def test_bins_are_from_zero_to_one_and_of_equal_log_odds() -> None:
    assert EDGES[[0, 1, -2, -1]] == pytest.approx([0, 1e-6, 0.999, 1])
    odds = EDGES[1:-1] / (1 - EDGES[1:-1])
    assert odds[1:] / odds[:-1] == pytest.approx(odds[1] / odds[0])
    assert counts_at(0.0, 1.0).sum() == 2


def test_places_by_hand() -> None:
    axis = ScoreAxis.around(EDGES, counts_at(0.0, 1.0), NO_MARKS)
    assert axis.place(np.array([0.5, 0.2, 0.8])) == pytest.approx([0, -np.log(4), np.log(4)])
    assert axis.place(np.array([0.0, 1.0])).tolist() == list(axis.limits)
    assert list(axis.ticks.values()) == ["0", "10⁻⁵", "10⁻⁴", "0.001", "0.01", "0.1", "0.5", "0.9", "0.99", "1"]


def test_only_what_is_there_is_shown() -> None:
    axis = ScoreAxis.around(EDGES, counts_at(0.02, 0.88), NO_MARKS)
    low, high = axis.place(np.array([0.02, 0.88]))
    assert axis.limits[0] <= low < high <= axis.limits[1]
    assert list(axis.ticks.values()) == ["0.1", "0.5"]


def test_a_threshold_of_zero_is_at_the_end() -> None:
    axis = ScoreAxis.around(EDGES, counts_at(0.5), np.zeros(1))
    assert axis.place(np.zeros(1)).tolist() == [axis.limits[0]]
    assert axis.ticks[axis.limits[0]] == "0"


def test_bins_of_equal_width_are_drawn_too() -> None:
    edges = np.linspace(0, 1, 51)
    axis = ScoreAxis.around(edges, np.ones((2, 50), dtype=int), NO_MARKS)
    assert (np.diff(axis.edges) > 0).all()
    assert list(axis.ticks.values()) == ["0", "0.1", "0.5", "0.9", "1"]


@given(st.lists(st.floats(0, 1), min_size=1, max_size=9), st.lists(st.floats(0, 1), max_size=3))
def test_every_score_is_within_the_axis_and_in_order(scores: list[float], marks: list[float]) -> None:
    axis = ScoreAxis.around(EDGES, counts_at(*scores), np.array(marks))
    places = axis.place(np.sort([*scores, *marks]))
    assert (np.diff(places) >= 0).all()
    assert axis.limits[0] - 1e-9 <= places[0] <= places[-1] <= axis.limits[1] + 1e-9
