"""How fast the own car drove in every trial of a study, and how close it came to another vehicle."""

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from coverdrive.errors import DataError
from coverdrive.report import style

_COLUMNS = {"mean_speed": "mean speed of the own car [m/s]", "minimum_gap": "least gap to another vehicle [m]"}
_WIDTH = 0.6
"""of a box; the numbers of vehicles are 1 apart"""


def speed_and_gap_figure(trials: pl.DataFrame) -> Figure:
    """Draw mean speed and least gap of every trial, by number of uncontrolled vehicles.

    Args:
        trials: one row for each trial; a gap that is not finite, because nobody was met, is left out.

    Raises:
        DataError: there is no trial.
    """
    if trials.is_empty():
        raise DataError("a figure of speeds and gaps needs at least one trial, got none; run some first")
    with style.style():
        figure = style.new_figure(10, 4.2)
        for axes, (column, label) in zip(figure.subplots(1, 2), _COLUMNS.items(), strict=True):
            _draw(axes, trials.filter(pl.col(column).is_finite()), column)
            axes.set(xlabel="uncontrolled vehicles", ylabel=label)
            axes.set_ylim(bottom=0)
            axes.grid(True, axis="y")
    return figure


def _draw(axes: Axes, trials: pl.DataFrame, column: str) -> None:
    """A box for every number of vehicles, with one dot for each trial spread over its width."""
    numbers = trials["vehicles"].unique().sort().to_list()
    groups = [trials.filter(pl.col("vehicles") == number)[column].to_numpy() for number in numbers]
    axes.boxplot(
        groups, positions=range(len(groups)), widths=_WIDTH, showfliers=False, patch_artist=True, manage_ticks=False,
        boxprops={"facecolor": f"{style.SKY}22", "edgecolor": style.BLUE}, medianprops={"color": style.BLUE},
        whiskerprops={"color": style.BLUE}, capprops={"color": style.BLUE},
    )  # fmt: skip
    for place, values in enumerate(groups):
        beside = place + _WIDTH * 0.7 * (np.modf(0.618 * np.arange(1, len(values) + 1))[0] - 0.5)
        axes.plot(beside, values, ".", color=style.BLUE, alpha=0.6, markersize=5)
    axes.set_xticks(range(len(groups)), [str(number) for number in numbers])
