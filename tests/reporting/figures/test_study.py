"""What a study found: collisions with their intervals, how the ego drove, and planning times against real time."""

import numpy as np
import polars as pl
import pytest
from report_fakes import marks_of
from scipy.stats import binomtest

from coverdrive.reporting.figures.study import collisions_figure, drives_figure, planning_figure
from coverdrive.reporting.plotting.drawing import save
from coverdrive.reporting.plotting.figure import Bars, Line, Points, Rule, Texts

pytestmark = pytest.mark.usefixtures("no_global_change")


def results(*counts: tuple[int, int, int, int]) -> pl.DataFrame:
    """Trials from (vehicles, trials, frontal or side, rear-end)."""
    rows = []
    for vehicles, trials, front, rear in counts:
        kinds = ["frontal", "side"] * front
        kinds = [*kinds[:front], *["rear-end"] * rear, *["finished"] * (trials - front - rear)]
        rows += [{"vehicles": vehicles, "kind": kind} for kind in kinds]
    return pl.DataFrame(rows)


def test_bars_whiskers_and_labels(tmp_path):
    figure = collisions_figure(results((0, 50, 0, 1), (4, 40, 3, 2)))
    heights = [height for bars in marks_of(figure.panels[0], Bars) for height in bars.height]
    assert heights == pytest.approx([0, 7.5, 100 * 3 / 90, 2, 5, 100 * 3 / 90])
    assert list(figure.panels[0].x.ticks.values()) == ["0 (50)", "4 (40)", "all (90)"]
    assert [text for texts in marks_of(figure.panels[0], Texts) for text in texts.text] == [
        "0",
        "3",
        "3",
        "1",
        "2",
        "3",
    ]
    rates = marks_of(figure.panels[0], Points)
    assert [value for points in rates for value in points.y] == pytest.approx(heights)
    whiskers = [ends for points in rates for ends in zip(points.low, points.high, strict=True)]
    expected = [(0, 50), (3, 40), (3, 90), (1, 50), (2, 40), (3, 90)]
    for whisker, (count, trials) in zip(whiskers, expected, strict=True):
        interval = binomtest(count, trials).proportion_ci(0.95, method="exact")
        assert whisker == pytest.approx((100 * interval.low, 100 * interval.high), abs=1e-6)
    _, y = figure.panels[0].scales
    assert y.low == 0 and y.high > max(high for _, high in whiskers)
    png, pdf = save(figure, tmp_path / "collisions")
    assert png.stat().st_size > 10_000
    assert pdf.read_bytes().startswith(b"%PDF-")


def test_the_papers_totals_are_the_reference():
    figure = collisions_figure(results((3, 10, 0, 0)))
    lines = {rule.name: rule.at for rule in marks_of(figure.panels[0], Rule) if rule.name}
    assert lines["paper, frontal or side: 7 of 1000"] == pytest.approx(0.7)
    assert lines["paper, rear-end: 20 of 1000"] == pytest.approx(2.0)
    assert "95 %" in figure.caption
    assert len(figure.named) == 4


def test_without_a_collision_there_are_marks_intervals_and_counts():
    """Of the colour of their kind, as where there are collisions."""
    figure = collisions_figure(results((3, 2, 0, 0)))
    for points, bars, texts in zip(*(marks_of(figure.panels[0], kind) for kind in (Points, Bars, Texts)), strict=True):
        assert set(points.y) == {0} and points.colour == bars.colour == texts.colour
        assert points.name == bars.name == texts.name  # shown and hidden together
        assert list(texts.text) == ["0"] and all(each.startswith("0 of 2 ") for each in points.hover)
        assert points.hover[0].endswith(" collision: 0 % (0–85 %)")
        assert min(points.high) > 50


def test_rates_of_a_few_trials_are_not_told_apart_by_number_of_vehicles():
    few, enough = (collisions_figure(results((3, 20, 0, 1), (4, trials, 0, 0))) for trials in (19, 20))
    assert list(few.panels[0].x.ticks.values()) == ["all (39)"]
    assert list(enough.panels[0].x.ticks.values()) == ["3 (20)", "4 (20)", "all (40)"]
    assert "by number" in enough.caption and "by number" not in few.caption


def test_certain_collisions_can_be_drawn(tmp_path):
    save(collisions_figure(results((3, 1, 1, 0), (7, 3, 0, 3))), tmp_path / "certain")


def test_planning_times_are_in_milliseconds() -> None:
    trials = pl.DataFrame({name: [0.02, 0.01] for name in ("planning_median", "planning_p99", "planning_maximum")})
    (panel,) = planning_figure(trials, 0.1).panels
    curves = marks_of(panel, Line)
    assert len(curves) == 3
    assert list(curves[0].x)[1:] == [10.0, 20.0] and list(curves[0].y) == [0, 0.5, 1] and curves[0].step
    (due,) = marks_of(panel, Rule)
    assert due.at == 100.0
    assert panel.scales[0].log and panel.scales[0].high > 100.0


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


def test_replays_have_no_whiskers(tmp_path):
    figure = collisions_figure(results((4, 40, 3, 2)), replayed=True)
    for points, texts, name in zip(
        marks_of(figure.panels[0], Points), marks_of(figure.panels[0], Texts), ("frontal or side", "rear-end"),
        strict=True,
    ):  # fmt: skip
        assert points.low is points.high is None and list(texts.y) == list(points.y)
        assert points.hover == [f"{texts.text[0]} of 40 with a {name} collision: {points.y[0]:.3g} %"]
    assert "95 %" not in figure.caption and "replays of recorded scenes depend on each other" in figure.caption
    assert save(figure, tmp_path / "collisions")[0].exists()
