"""How long prediction and planning take in a study, against real time."""

import polars as pl
from matplotlib.figure import Figure

from coverdrive.errors import DataError
from coverdrive.report import style

_COLUMNS = {
    "planning_median": ("median step of a trial", style.BLUE, "-"),
    "planning_p99": ("99th percentile of a trial", style.ORANGE, "--"),
    "planning_maximum": ("slowest step of a trial", style.VERMILION, "-."),
}


def planning_figure(trials: pl.DataFrame, period: float) -> Figure:
    """Draw the share of trials whose steps took at most a given time.

    Args:
        trials: one row for each trial.
        period: [s] between two plans, which is the time there is.

    Raises:
        DataError: there is no trial.
    """
    if trials.is_empty():
        raise DataError("a figure of planning times needs at least one trial, got none; run some first")
    with style.style():
        figure = style.new_figure(7, 4.2)
        axes = figure.subplots()
        for column, (label, colour, line) in _COLUMNS.items():
            axes.ecdf(1e3 * trials[column].to_numpy(), color=colour, linestyle=line, linewidth=2, label=label)
        axes.axvline(1e3 * period, color=style.GREY, linestyle=":", linewidth=2, label="next plan due (real time)")
        axes.set(
            xscale="log", xlabel="prediction and planning of a step [ms]", ylabel="share of the trials", ylim=(0, 1.02)
        )
        axes.xaxis.set_major_formatter("{x:g}")
        axes.grid(True)
        figure.legend(loc="outside upper left", ncols=2)
    return figure
