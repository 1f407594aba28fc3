"""Scores with their thresholds, and planning times against real time."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from report_fakes import make_contents
from scipy.special import expit

from coverdrive.errors import DataError
from coverdrive.report.page.study import study_plots
from coverdrive.report.planning_figure import planning_figure
from coverdrive.report.scores_figure import scores_figure
from coverdrive.report.set_sizes_figure import set_sizes_figure
from coverdrive.report.speed_and_gap_figure import speed_and_gap_figure

pytestmark = pytest.mark.usefixtures("no_global_change")


def test_thresholds_are_where_the_rule_has_them() -> None:
    contents = make_contents()
    figure = scores_figure(contents.learned, contents.predictor.rule)
    for axes in figure.axes:
        lines = axes.collections[-1].get_segments()
        assert expit([line[0][0] for line in lines]) == pytest.approx(contents.predictor.rule.values)
        assert len(axes.patches) == len(contents.learned.driven)


def test_planning_times_are_in_milliseconds() -> None:
    trials = pl.DataFrame({name: [0.01, 0.02] for name in ("planning_median", "planning_p99", "planning_maximum")})
    (axes,) = planning_figure(trials, 0.1).axes
    assert np.asarray(axes.lines[0].get_xdata())[1:].tolist() == [10.0, 20.0]
    assert np.asarray(axes.lines[-1].get_xdata()).tolist() == [100.0, 100.0]
    with pytest.raises(DataError, match="at least one trial"):
        planning_figure(trials.clear(), 0.1)


def test_sizes_of_sets_are_shares_with_their_mean() -> None:
    learned = replace(make_contents().learned, set_sizes=np.array([0, 6, 3, 1]))
    (axes,) = set_sizes_figure(learned).axes
    assert [bar.get_height() for bar in axes.patches] == pytest.approx([0, 60, 30, 10])
    assert axes.lines[0].get_xdata()[0] == pytest.approx(1.5)
    assert axes.lines[0].get_label() == "mean: 1.5 of 3"


def test_every_trial_is_a_dot_of_its_speed_and_its_gap() -> None:
    trials = pl.DataFrame(
        {"vehicles": [4, 3, 4], "mean_speed": [10.0, 20.0, 30.0], "minimum_gap": [2.0, float("inf"), 1.0]}
    )
    speed, gap = speed_and_gap_figure(trials).axes
    dots = [line.get_ydata().tolist() for line in speed.lines if line.get_marker() == "."]
    assert dots == [[20.0], [10.0, 30.0]]
    assert [text.get_text() for text in speed.get_xticklabels()] == ["3", "4"]
    assert [line.get_ydata().tolist() for line in gap.lines if line.get_marker() == "."] == [[2.0, 1.0]]
    assert speed.get_ylim()[0] == gap.get_ylim()[0] == 0
    with pytest.raises(DataError, match="at least one trial"):
        speed_and_gap_figure(trials.clear())


def test_without_a_collision_the_page_shows_dots_and_counts() -> None:
    trials = make_contents().trials.with_columns(kind=pl.lit("finished"))
    figure = study_plots(trials, 0.1)[0].figure
    front, rear = (trace for trace in figure.data if trace.type == "scatter")
    for trace, bar in zip((front, rear), figure.data, strict=False):
        assert set(trace.y) == {0} and trace.marker.color == bar.marker.color == trace.error_y.color
        assert [text.strip() for text in trace.text] == ["0 of 2", "0 of 2"]


@pytest.mark.parametrize(("number", "bins"), [(2, 6), (20, 8), (100, 20), (2000, 40)])
def test_bins_of_planning_times_suit_the_number_of_trials(number: int, bins: int) -> None:
    trials = make_contents().trials.sample(number, with_replacement=True, seed=0)
    for trace in study_plots(trials, 0.1)[1].figure.data:
        assert bins + 1 <= len(trace.x) <= bins + 3
        assert 100.0 in trace.x  # no bin has times on both sides of real time
        assert sum(trace.y) == number
