"""How the ego drove in every trial of a study: its speed, its least gap to another vehicle, and its comfort."""

import numpy as np
import polars as pl

from coverdrive.errors import DataError
from coverdrive.reporting.figure import Axis, Figure, Line, Mark, Panel, Points, Shapes

_COLUMNS = {
    "mean_speed": "mean speed [m/s]",
    "minimum_gap": "least gap [m]",
    "jerk_longitudinal": "jerk along the road [m/s³]",
}
_WIDTH = 0.6
"""of a box; the numbers of vehicles are 1 apart"""


def drives_figure(trials: pl.DataFrame) -> Figure:
    """Mean speed, least gap if anybody was met, and jerk of every trial, by number of uncontrolled vehicles.

    DataError if there is no trial.
    """
    if trials.is_empty():
        raise DataError("a figure of speeds and gaps needs at least one trial, got none; run some first")
    numbers = trials["vehicles"].unique().sort().to_list()
    x = Axis("uncontrolled vehicles", -0.5, len(numbers) - 0.5, ticks={k: str(each) for k, each in enumerate(numbers)})
    panels = [Panel(_marks(trials, column, numbers), x, Axis(label, low=0)) for column, label in _COLUMNS.items()]
    caption = (
        "Every trial as a dot: mean speed, least gap to another vehicle, and jerk (root mean square over the drive), "
        "with the quartiles of all trials with as many vehicles; a whisker reaches over at most one and a half boxes."
    )
    return Figure([panels], height=2.6, caption=caption)


def _marks(trials: pl.DataFrame, column: str, numbers: list[int]) -> list[Mark]:
    """A box for every number of vehicles, with one dot for each trial spread over its width."""
    marks: list[Mark] = []
    for place, number in enumerate(numbers):
        shown = trials.filter(pl.col(column).is_finite(), pl.col("vehicles") == number)
        values = shown[column].to_numpy()
        if not len(values):
            continue
        marks += _box(place, values)
        beside = place + _WIDTH * 0.7 * (np.modf(0.618 * np.arange(1, len(values) + 1))[0] - 0.5)
        names = shown["trial"].to_list() if "trial" in shown.columns else range(len(values))
        hover = [f"trial {trial}: {value:.2f}" for trial, value in zip(names, values, strict=True)]
        marks.append(Points(x=beside, y=values, size=3, opacity=0.6, hover=hover))
    return marks


def _box(place: float, values: np.ndarray) -> list[Mark]:
    """From quartile to quartile with the median, and whiskers to the last value within 1.5 times as far."""
    low, middle, high = np.quantile(values, [0.25, 0.5, 0.75])
    reach = 1.5 * (high - low)
    least, most = values[values >= low - reach].min(), values[values <= high + reach].max()
    left, right = place - _WIDTH / 2, place + _WIDTH / 2
    lines_x = [left, right, np.nan, place, place, np.nan, place, place]
    lines_y = [middle, middle, np.nan, least, low, np.nan, high, most]
    corners = np.array([(left, low), (right, low), (right, high), (left, high)])
    return [Shapes(outlines=[corners]), Line(x=lines_x, y=lines_y, width=0.9)]
