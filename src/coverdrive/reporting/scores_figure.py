"""How the scores of driven and of other bases are distributed, and where the thresholds lie, on an axis of log-odds."""

from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from coverdrive.certificates.rule import Rule, Thresholds
from coverdrive.prediction.learned import Learned
from coverdrive.reporting import style
from coverdrive.reporting.figure import Axis, Bars, Figure, Mark, Panel, Points
from coverdrive.reporting.score_axis import ScoreAxis

_TALLEST = 0.9
"""height of the largest bin; rows are 1 apart"""

_MARGIN = 0.15
"""[log-odds] beside what is shown"""


def scores_figure(learned: Learned, rule: Rule) -> Figure:
    """One row for each base: the scores of windows that drove it, of those that did not, and its threshold.

    Args:
        learned: counts of calibration windows by score.
        rule: whose thresholds are drawn, if it has any.
    """
    bases = len(learned.driven)
    thresholds = rule.values if isinstance(rule, Thresholds) else np.empty(0)
    axis = ScoreAxis.around(learned.edges, np.stack([learned.driven, learned.others]), thresholds)
    low, high = axis.limits
    x = Axis("score (scale of log-odds)", low - _MARGIN, high + _MARGIN, ticks=axis.ticks)
    y = Axis("base trajectory", -0.15, bases, ticks={base: str(base) for base in range(bases)})
    sides = (
        (learned.driven, style.BLUE, "base that was driven"),
        (learned.others, style.ORANGE, "bases that were not driven"),
    )
    panels = [
        Panel([*_rows(counts, learned.edges, axis, colour), *_thresholds(thresholds, axis)], x, y, title)
        for counts, colour, title in sides
    ]
    return Figure(
        [panels],
        height=1.1 + 0.2 * bases,
        caption="Scores of every base in the calibration windows that drove it, and in those that did not (roots of "
        "the counts, so that rare scores stay visible). A base is possible from its threshold on: what lies left of it "
        "is missed in the left panel, and what lies right of it makes the sets larger in the right one.",
    )


def _rows(counts: Int[np.ndarray, "M B"], edges: Float[np.ndarray, " _"], axis: ScoreAxis, colour: str) -> list[Mark]:
    """Square roots of the counts of every bin that is not empty."""
    centres, widths = (axis.edges[1:] + axis.edges[:-1]) / 2, np.diff(axis.edges)
    names = [f"{low:.3g} to {high:.3g}" for low, high in pairwise(edges)]
    rows: list[Mark] = []
    for base, row in enumerate(counts):
        bins = np.flatnonzero(row)
        hover = [f"base {base}, score {names[number]}\n{row[number]} windows" for number in bins]
        heights = _TALLEST * np.sqrt(row[bins] / max(row.max(), 1))
        rows.append(
            Bars(
                x=centres[bins], width=widths[bins], height=heights, base=base, colour=colour, opacity=0.75, hover=hover
            )
        )
    return rows


def _thresholds(values: Float[np.ndarray, " _"], axis: ScoreAxis) -> list[Mark]:
    if not len(values):
        return []
    hover = [f"base {base}: possible from the score {value:.3g} on" for base, value in enumerate(values)]
    places = np.arange(len(values)) + _TALLEST / 2
    return [
        Points(x=axis.place(values), y=places, marker="|", size=11, colour=style.BLACK,
               name="threshold: possible from here on", hover=hover)
    ]  # fmt: skip
