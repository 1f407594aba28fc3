"""Scores with their thresholds, set sizes, losses, planning times against real time, and how the ego drove."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from report_fakes import make_contents
from scipy.special import expit

from coverdrive.reporting.figures.learned import losses_figure, scores_figure, set_sizes_figure
from coverdrive.reporting.figures.study import drives_figure, planning_figure
from coverdrive.reporting.plotting.figure import Bars, Line, Panel, Points, Rule


def marks_of(panel: Panel, kind: type) -> list:
    return [mark for mark in panel.marks if isinstance(mark, kind)]


def test_thresholds_are_where_the_rule_has_them_and_every_bin_has_a_bar() -> None:
    contents = make_contents()
    learned, values = contents.learned, contents.predictor.rule.values
    figure = scores_figure(learned, contents.predictor.rule)
    for panel, counts in zip(figure.panels, (learned.driven, learned.others), strict=True):
        (thresholds,) = marks_of(panel, Points)
        assert expit(thresholds.x) == pytest.approx(values)
        rows = marks_of(panel, Bars)
        assert [row.base for row in rows] == list(range(len(counts)))
        for row, bins in zip(rows, counts, strict=True):
            assert [int(hover.split("\n")[1].split()[0]) for hover in row.hover] == bins[bins > 0].tolist()
            assert max(row.height) < 1


def test_planning_times_are_in_milliseconds() -> None:
    trials = pl.DataFrame({name: [0.02, 0.01] for name in ("planning_median", "planning_p99", "planning_maximum")})
    (panel,) = planning_figure(trials, 0.1).panels
    curves = marks_of(panel, Line)
    assert len(curves) == 3
    assert list(curves[0].x)[1:] == [10.0, 20.0] and list(curves[0].y) == [0, 0.5, 1] and curves[0].step
    (due,) = marks_of(panel, Rule)
    assert due.at == 100.0
    assert panel.scales[0].log and panel.scales[0].high > 100.0


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


def test_every_trial_is_a_dot_of_its_speed_its_gap_and_its_jerk() -> None:
    trials = pl.DataFrame(
        {
            "vehicles": [4, 3, 4], "trial": [5, 6, 7], "mean_speed": [10.0, 20.0, 30.0],
            "minimum_gap": [2.0, float("inf"), 1.0], "jerk_longitudinal": [1.0, 2.0, 3.0],
        }
    )  # fmt: skip
    speed, gap, jerk = drives_figure(trials).panels
    assert [list(points.y) for points in marks_of(speed, Points)] == [[20.0], [10.0, 30.0]]
    assert [points.hover for points in marks_of(speed, Points)] == [
        ["trial 6: 20.00"],
        ["trial 5: 10.00", "trial 7: 30.00"],
    ]
    assert list(speed.x.ticks.values()) == ["3", "4"]
    assert [list(points.y) for points in marks_of(gap, Points)] == [[2.0, 1.0]]
    assert [list(points.y) for points in marks_of(jerk, Points)] == [[2.0], [1.0, 3.0]]
    assert all(panel.scales[1].low == 0 for panel in (speed, gap, jerk))


def drawn(values: list[float]) -> list:
    trials = pl.DataFrame(
        {"vehicles": [3] * len(values), "mean_speed": values, "minimum_gap": values, "jerk_longitudinal": values}
    )
    return list(drives_figure(trials).panels[0].marks)


def test_boxes_are_the_quartiles() -> None:
    box, line, _ = drawn([1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 100.0])
    assert (box.outlines[0][:, 1].min(), box.outlines[0][:, 1].max()) == (2.0, 4.0)
    whiskers = np.array(line.y)
    assert whiskers[0] == 3.0 and np.nanmin(whiskers) == 1.0 and np.nanmax(whiskers) == 4.5


def test_a_few_values_have_no_box_and_no_whisker_ends_inside_of_one() -> None:
    assert [type(mark) for mark in drawn([1.0] * 7)] == [Points]
    box, line, _ = drawn([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 9.0, 9.0])
    top = box.outlines[0][:, 1].max()
    assert 1.0 < top < 9.0 and line.y[-1] == top
