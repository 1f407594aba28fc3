"""Collisions by number of vehicles, with their intervals."""

import numpy as np
import polars as pl
import pytest
from scipy.stats import binomtest

from coverdrive.errors import CertificateError, DataError
from coverdrive.report.collisions_figure import collisions_figure
from coverdrive.report.style import save

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
    (axes,) = figure.axes
    heights = [bar.get_height() for bar in axes.patches]
    assert heights == pytest.approx([0, 7.5, 100 * 3 / 90, 2, 5, 100 * 3 / 90])
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["0\n50 trials", "4\n40 trials", "all\n90 trials"]
    assert [text.get_text() for text in axes.texts] == ["0", "3", "3", "1", "2", "3"]
    whiskers = [np.array(segment)[:, 1] for each in axes.collections for segment in each.get_segments()]
    expected = [(0, 50), (3, 40), (3, 90), (1, 50), (2, 40), (3, 90)]
    for whisker, (count, trials) in zip(whiskers, expected, strict=True):
        interval = binomtest(count, trials).proportion_ci(0.95, method="exact")
        assert whisker == pytest.approx([100 * interval.low, 100 * interval.high], abs=1e-6)
    assert axes.get_ylim()[0] == 0
    assert axes.get_ylim()[1] > max(whisker[1] for whisker in whiskers)
    png, pdf = save(figure, tmp_path / "collisions")
    assert png.stat().st_size > 10_000
    assert pdf.read_bytes().startswith(b"%PDF-")


def test_the_papers_totals_are_the_reference():
    figure = collisions_figure(results((3, 10, 0, 0)), confidence=0.9)
    lines = {line.get_label(): line.get_ydata()[0] for line in figure.axes[0].lines}
    assert lines["paper, all trials, frontal or side: 7 of 1000"] == pytest.approx(0.7)
    assert lines["paper, all trials, rear-end: 20 of 1000"] == pytest.approx(2.0)
    assert "90 %" in figure.legends[0].get_title().get_text()
    assert len(figure.legends[0].get_texts()) == 4


def test_certain_collisions_can_be_drawn(tmp_path):
    save(collisions_figure(results((3, 1, 1, 0), (7, 3, 0, 3))), tmp_path / "certain")


def test_no_trials_and_impossible_confidence_are_refused():
    with pytest.raises(DataError, match="at least one trial"):
        collisions_figure(pl.DataFrame(schema={"vehicles": pl.Int64, "kind": pl.String}))
    with pytest.raises(CertificateError):
        collisions_figure(results((3, 10, 0, 0)), confidence=1.0)
