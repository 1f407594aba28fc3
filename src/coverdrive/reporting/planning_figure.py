"""How long prediction and planning take in a study, against real time."""

import numpy as np
import polars as pl

from coverdrive.errors import DataError
from coverdrive.reporting import style
from coverdrive.reporting.figure import Axis, Figure, Line, Mark, Panel, Rule

_COLUMNS = {
    "planning_median": ("median step of a trial", style.BLUE),
    "planning_p99": ("99th percentile of a trial", style.ORANGE),
    "planning_maximum": ("slowest step of a trial", style.VERMILION),
}


def planning_figure(trials: pl.DataFrame, period: float) -> Figure:
    """The share of trials whose steps took at most a given time; the next plan is due after the period [s].

    DataError if there is no trial.
    """
    if trials.is_empty():
        raise DataError("a figure of planning times needs at least one trial, got none; run some first")
    due = 1e3 * period
    marks: list[Mark] = [
        _steps(1e3 * trials[column].to_numpy(), name, colour) for column, (name, colour) in _COLUMNS.items()
    ]
    marks.append(Rule(at=due, name="next plan due (real time)"))
    x, y = Axis("prediction and planning of a step [ms]", log=True), Axis("share of the trials", low=0, high=1.02)
    return Figure(
        [[Panel(marks, x, y)]],
        height=2.6,
        caption=f"The share of the trials in which prediction and planning of a step took at most so long. The next "
        f"plan is due after {due:g} ms.",
        legend_columns=2,
    )


def _steps(milliseconds: np.ndarray, name: str, colour: str) -> Line:
    """The empirical distribution; its last value is the largest time."""
    times = np.sort(milliseconds)
    return Line(
        x=np.append(times[0], times), y=np.arange(len(times) + 1) / len(times), step=True, colour=colour, name=name,
        width=1.6, hover=f"{name}: {np.median(times):.3g} ms at half of the trials, {times[-1]:.3g} ms at most",
    )  # fmt: skip
