"""Collisions by number of vehicles, with their intervals."""

import polars as pl
import pytest
from scipy.stats import binomtest

from coverdrive.reporting.figures.study import collisions_figure
from coverdrive.reporting.plotting.drawing import save
from coverdrive.reporting.plotting.figure import Bars, Figure, Points, Rule, Texts

pytestmark = pytest.mark.usefixtures("no_global_change")


def results(*counts: tuple[int, int, int, int]) -> pl.DataFrame:
    """Trials from (vehicles, trials, frontal or side, rear-end)."""
    rows = []
    for vehicles, trials, front, rear in counts:
        kinds = ["frontal", "side"] * front
        kinds = [*kinds[:front], *["rear-end"] * rear, *["finished"] * (trials - front - rear)]
        rows += [{"vehicles": vehicles, "kind": kind} for kind in kinds]
    return pl.DataFrame(rows)


def marks_of(figure: Figure, kind: type) -> list:
    return [mark for mark in figure.panels[0].marks if isinstance(mark, kind)]


def test_bars_whiskers_and_labels(tmp_path):
    figure = collisions_figure(results((0, 50, 0, 1), (4, 40, 3, 2)))
    heights = [height for bars in marks_of(figure, Bars) for height in bars.height]
    assert heights == pytest.approx([0, 7.5, 100 * 3 / 90, 2, 5, 100 * 3 / 90])
    assert list(figure.panels[0].x.ticks.values()) == ["0 (50)", "4 (40)", "all (90)"]
    assert [text for texts in marks_of(figure, Texts) for text in texts.text] == ["0", "3", "3", "1", "2", "3"]
    rates = marks_of(figure, Points)
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
    lines = {rule.name: rule.at for rule in marks_of(figure, Rule) if rule.name}
    assert lines["paper, frontal or side: 7 of 1000"] == pytest.approx(0.7)
    assert lines["paper, rear-end: 20 of 1000"] == pytest.approx(2.0)
    assert "95 %" in figure.caption
    assert len(figure.named) == 4


def test_without_a_collision_there_are_marks_intervals_and_counts():
    """Of the colour of their kind, as where there are collisions."""
    figure = collisions_figure(results((3, 2, 0, 0)))
    for points, bars, texts in zip(*(marks_of(figure, kind) for kind in (Points, Bars, Texts)), strict=True):
        assert set(points.y) == {0} and points.colour == bars.colour == texts.colour
        assert list(texts.text) == ["0"] and all(each.startswith("0 of 2 ") for each in points.hover)
        assert min(points.high) > 50


def test_rates_of_a_few_trials_are_not_told_apart_by_number_of_vehicles():
    few, enough = (collisions_figure(results((3, 20, 0, 1), (4, trials, 0, 0))) for trials in (19, 20))
    assert list(few.panels[0].x.ticks.values()) == ["all (39)"]
    assert list(enough.panels[0].x.ticks.values()) == ["3 (20)", "4 (20)", "all (40)"]
    assert "by number" in enough.caption and "by number" not in few.caption


def test_certain_collisions_can_be_drawn(tmp_path):
    save(collisions_figure(results((3, 1, 1, 0), (7, 3, 0, 3))), tmp_path / "certain")
