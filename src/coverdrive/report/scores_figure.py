"""How the scores of driven and of other bases are distributed, and where the thresholds lie, on an axis of log-odds."""

import numpy as np
from jaxtyping import Float, Int
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from coverdrive.certificates.rule import Rule, Thresholds
from coverdrive.prediction.learned import Learned
from coverdrive.report import style
from coverdrive.report.score_axis import ScoreAxis

_TALLEST = 0.9
"""height of the largest bin; rows are 1 apart"""

_MARGIN = 0.15
"""[log-odds] beside what is shown"""


def scores_figure(learned: Learned, rule: Rule) -> Figure:
    """Draw one row for each base: the scores of windows that drove it, of those that did not, and its threshold.

    Args:
        learned: counts of calibration windows by score.
        rule: whose thresholds are drawn, if it has any.
    """
    bases = len(learned.driven)
    thresholds = rule.values if isinstance(rule, Thresholds) else np.empty(0)
    axis = ScoreAxis.around(learned.edges, np.stack([learned.driven, learned.others]), thresholds)
    with style.style():
        figure = style.new_figure(10, 1.6 + 0.42 * bases)
        driven, others = figure.subplots(1, 2, sharey=True)
        _draw(driven, learned.driven, axis, thresholds, style.BLUE, "base that was driven")
        _draw(others, learned.others, axis, thresholds, style.VERMILION, "bases that were not driven")
        driven.set(ylabel="base trajectory")
        driven.set_yticks(np.arange(bases), [str(base) for base in range(bases)])
        label = "threshold: possible from here on"
        figure.legend(handles=[Line2D([], [], color=style.BLACK, linewidth=2, label=label)], loc="outside upper right")
    return figure


def _draw(
    axes: Axes, counts: Int[np.ndarray, "M B"], axis: ScoreAxis, thresholds: Float[np.ndarray, " _"], colour: str,
    title: str,
) -> None:  # fmt: skip
    """Square roots of the counts, so that rare scores stay visible."""
    rows = np.arange(len(counts))
    heights = _TALLEST * np.sqrt(counts / np.maximum(counts.max(1, keepdims=True), 1))
    for row, height in zip(rows, heights, strict=True):
        axes.stairs(row + height, axis.edges, baseline=row, fill=True, color=colour, alpha=0.75)
    if len(thresholds):
        axes.vlines(axis.place(thresholds), rows, rows + _TALLEST, color=style.BLACK, linewidth=2)
    low, high = axis.limits
    axes.set(xlabel="score (scale of log-odds)", xlim=(low - _MARGIN, high + _MARGIN), ylim=(-0.15, len(counts)))
    axes.set_xticks(list(axis.ticks), list(axis.ticks.values()))
    axes.set_title(title, loc="left")
    axes.grid(True)
