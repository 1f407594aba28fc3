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
    """One row for each base: the scores of calibration windows that drove it, of others, and its threshold, if any."""
    bases = len(learned.driven)
    values = rule.values if isinstance(rule, Thresholds) else np.empty(0)
    axis = ScoreAxis.around(learned.edges, np.stack([learned.driven, learned.others]), values)
    low, high = axis.limits
    x = Axis("score (scale of log-odds)", low - _MARGIN, high + _MARGIN, ticks=axis.ticks)
    y = Axis("base trajectory", -0.15, bases, ticks={base: str(base) for base in range(bases)})
    thresholds = Points(
        x=axis.place(values), y=np.arange(len(values)) + _TALLEST / 2, marker="|", size=11, colour=style.BLACK,
        name="threshold: possible from here on",
        hover=[f"base {base}: possible from the score {value:.3g} on" for base, value in enumerate(values)],
    )  # fmt: skip
    sides = (
        (learned.driven, style.BLUE, "base that was driven"),
        (learned.others, style.ORANGE, "bases that were not driven"),
    )
    panels = [
        Panel([*_rows(counts, learned.edges, axis, colour), *[thresholds] * bool(len(values))], x, y, title)
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
    return [
        Bars(
            x=centres[bins], width=widths[bins], height=_TALLEST * np.sqrt(row[bins] / max(row.max(), 1)), base=base,
            colour=colour, opacity=0.75,
            hover=[f"base {base}, score {names[number]}\n{row[number]} windows" for number in bins],
        )
        for base, row in enumerate(counts)
        for bins in [np.flatnonzero(row)]
    ]  # fmt: skip
