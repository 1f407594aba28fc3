"""Scores with their thresholds, and planning times against real time."""

import numpy as np
import polars as pl
import pytest
from report_fakes import make_contents
from scipy.special import expit

from coverdrive.errors import DataError
from coverdrive.report.planning_figure import planning_figure
from coverdrive.report.scores_figure import scores_figure

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
