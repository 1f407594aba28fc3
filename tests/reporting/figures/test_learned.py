"""Scores with their thresholds on an axis of log-odds, set sizes and losses."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_fakes import make_contents, marks_of

from coverdrive.certificates.rule import Thresholds
from coverdrive.prediction.fits.learned import EDGES
from coverdrive.reporting.figures.learned import losses_figure, scores_figure, set_sizes_figure
from coverdrive.reporting.plotting.figure import Axis, Bars, Points

ONE = make_contents(bases=1).learned


def counts_at(*scores: float) -> np.ndarray:
    return np.histogram(np.array(scores), EDGES)[0][None]


def drawn(scores: list[float], thresholds: list[float]) -> tuple[Axis, np.ndarray]:
    """The axis of scores of one base, and the places of its thresholds."""
    panel = scores_figure(
        replace(ONE, driven=counts_at(*scores), others=counts_at()), Thresholds.at(np.array(thresholds), 0.5)
    ).panels[0]
    return panel.x, np.concatenate([np.empty(0), *(each.x for each in marks_of(panel, Points))])


def test_bins_are_from_zero_to_one_and_of_equal_log_odds() -> None:
    assert EDGES[[0, 1, -2, -1]] == pytest.approx([0, 1e-6, 0.999, 1])
    odds = EDGES[1:-1] / (1 - EDGES[1:-1])
    assert odds[1:] / odds[:-1] == pytest.approx(odds[1] / odds[0])
    assert counts_at(0.0, 1.0).sum() == 2


def test_places_by_hand() -> None:
    axis, places = drawn([0.0, 1.0], [0.5, 0.2, 0.8])
    half, low, high = places
    assert low - half == pytest.approx(half - high, abs=0.1)
    assert (axis.low, axis.high) == (-0.5, len(EDGES) - 0.5)
    assert list(axis.ticks.values()) == ["0", "10⁻⁵", "10⁻⁴", "0.001", "0.01", "0.1", "0.5", "0.9", "0.99", "1"]


def test_only_what_is_there_is_shown() -> None:
    axis, (low, high) = drawn([0.02, 0.88], [0.02, 0.88])
    assert axis.low <= low < high <= axis.high
    assert list(axis.ticks.values()) == ["0.1", "0.5"]


def test_a_threshold_of_zero_is_at_the_end() -> None:
    axis, places = drawn([0.5], [0.0])
    assert places.tolist() == [0] == [place for place, text in axis.ticks.items() if text == "0"]


@given(st.lists(st.floats(0, 1), min_size=1, max_size=9), st.lists(st.floats(0, 1), max_size=3))
def test_every_score_is_within_the_axis_and_in_order(scores: list[float], marks: list[float]) -> None:
    axis, places = drawn(scores, np.sort([*scores, *marks]).tolist())
    assert (np.diff(places) >= 0).all()
    assert axis.low <= places[0] <= places[-1] <= axis.high


def test_thresholds_are_where_the_rule_has_them_and_every_bin_has_a_bar() -> None:
    contents = make_contents()
    learned, values = contents.learned, contents.predictor.rule.values
    figure = scores_figure(learned, contents.predictor.rule)
    for panel, counts in zip(figure.panels, (learned.driven, learned.others), strict=True):
        (thresholds,) = marks_of(panel, Points)
        assert np.interp(thresholds.x, np.arange(len(learned.edges)), learned.edges) == pytest.approx(values)
        rows = marks_of(panel, Bars)
        assert [row.base for row in rows] == list(range(len(counts)))
        for row, bins in zip(rows, counts, strict=True):
            assert [int(hover.split("\n")[1].split()[0]) for hover in row.hover] == bins[bins > 0].tolist()
            assert max(row.height) < 1


def test_sizes_of_sets_are_shares_with_their_mean() -> None:
    learned = replace(make_contents().learned, set_sizes=np.array([0, 6, 3, 1]))
    bars, mean = set_sizes_figure(learned).panels[0].marks
    assert bars.height == pytest.approx([0, 60, 30, 10])
    assert bars.hover[1] == "1 possible bases: 60 % of the windows"
    assert mean.at == pytest.approx(1.5)
    assert mean.name == "mean: 1.5 of 3"


def test_losses_have_their_epochs() -> None:
    learned = replace(make_contents().learned, losses=np.array([3.0, 1.0]))
    _, points = losses_figure(learned).panels[0].marks
    assert (list(points.x), list(points.y), list(points.hover)) == ([1, 2], [3, 1], ["epoch 1: 3", "epoch 2: 1"])


def test_losses_below_zero_are_drawn() -> None:
    """The logarithm of areas may be; an axis of logarithms would end before it."""
    learned, losses = make_contents().learned, np.array([0.4, -0.2, -0.6])
    logarithmic = [losses_figure(replace(learned, losses=each)).panels[0].y.log for each in (losses, losses + 1)]
    assert logarithmic == [False, True]
