"""What a predictor learned: the distribution of its scores, the sizes of its sets, and how its loss fell.

Scores are on an axis of log-odds, log(y / (1 − y)), because networks score near 0 and near 1, and thresholds lie near
0. Scores of the first bin, 0 among them, share a cell at the left end of the axis, and those of the last, 1 among them,
at the right end; an end is shown only if something is there. E edges of B = E − 1 bins.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, Shaped
from scipy.special import logit

from coverdrive.certificates.rule import Rule as Sets
from coverdrive.certificates.rule import Thresholds
from coverdrive.numbers import percent
from coverdrive.prediction.certifying.occupied import Occupied
from coverdrive.prediction.fits.learned import Learned
from coverdrive.reporting.plotting import style
from coverdrive.reporting.plotting.figure import Axis, Bars, Figure, Line, Mark, Panel, Points, Rule

_TALLEST = 0.9
"""height of the largest bin; rows are 1 apart"""

_MARGIN = 0.15
"""[log-odds] beside what is shown"""

_END = 0.7
"""log-odds that the cell at an end takes"""

_TICKS = {1e-6: "10⁻⁶", 1e-5: "10⁻⁵", 1e-4: "10⁻⁴", 1e-3: "0.001", 0.01: "0.01", 0.1: "0.1", 0.5: "0.5", 0.9: "0.9",
          0.99: "0.99"}  # fmt: skip

_APART = 1.4
"""log-odds between the tick of an end and the next at least"""


class ScoreAxis(NamedTuple):
    """Where scores are drawn on an axis that is as long as it needs to be."""

    edges: Float[np.ndarray, " E"]
    """[log-odds] of the bins, those of the scores 0 and 1 at the ends of the axis"""
    first: int
    """bin that is shown"""
    last: int
    """bin that is shown"""

    @staticmethod
    def around(
        edges: Float[np.ndarray, " E"], counts: Shaped[np.ndarray, "*rows B"], marks: Float[np.ndarray, " _"]
    ) -> "ScoreAxis":
        """The axis that shows every bin of scores, from 0 to 1, with a count in any row, and every mark in [0, 1]."""
        filled = counts.reshape(-1, len(edges) - 1).sum(0) > 0
        filled[np.searchsorted(edges[1:-1], marks, side="right")] = True
        shown = np.flatnonzero(filled) if filled.any() else np.arange(len(filled))
        inner = logit(edges[1:-1])
        return ScoreAxis(np.concatenate([[inner[0] - _END], inner, [inner[-1] + _END]]), int(shown[0]), int(shown[-1]))

    def place(self, scores: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        """Where scores in [0, 1] are drawn [log-odds]; what is beyond an end is drawn at it."""
        return np.clip(logit(scores), self.edges[0], self.edges[-1])

    @property
    def limits(self) -> tuple[float, float]:
        """Ends of what is shown [log-odds]."""
        return float(self.edges[self.first]), float(self.edges[self.last + 1])

    @property
    def ticks(self) -> dict[float, str]:
        """What stands where [log-odds], from left to right."""
        low, high = self.limits
        ends = {low: "0"} if self.first == 0 else {}
        ends |= {high: "1"} if self.last == len(self.edges) - 2 else {}
        inner = {float(logit(score)): text for score, text in _TICKS.items() if low <= logit(score) <= high}
        apart = {place: text for place, text in inner.items() if all(abs(place - end) > _APART for end in ends)}
        return dict(sorted((ends | apart).items()))


def scores_figure(learned: Learned, rule: Sets) -> Figure:
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


def set_sizes_figure(learned: Learned) -> Figure:
    """The share of test windows by the number of possible base trajectories."""
    counts = learned.set_sizes
    sizes, share = np.arange(len(counts)), counts / max(counts.sum(), 1)
    mean = float(sizes @ share)
    hover = [f"{size} possible bases: {percent(each)} of the windows" for size, each in zip(sizes, share, strict=True)]
    marks = [
        Bars(x=sizes, height=100 * share, width=0.85, hover=hover),
        Rule(at=mean, colour=style.VERMILION, name=f"mean: {mean:.1f} of {sizes[-1]}"),
    ]
    x = Axis("size of the predicted set [base trajectories]", -0.6, len(counts) - 0.4)
    return Figure(
        [[Panel(marks, x, Axis("test windows [%]", low=0))]],
        height=2.6,
        caption=f"How many of the {sizes[-1]} base trajectories are possible, on scenes kept out of training.",
    )


def losses_figure(learned: Learned) -> Figure:
    """The mean training loss of every epoch."""
    epochs = np.arange(1, len(learned.losses) + 1)
    hover = [f"epoch {epoch}: {loss:.4g}" for epoch, loss in zip(epochs, learned.losses, strict=True)]
    marks = [Line(x=epochs, y=learned.losses), Points(x=epochs, y=learned.losses, size=2.5, hover=hover)]
    panel = Panel(marks, Axis("epoch"), Axis("loss", log=bool(np.min(learned.losses) > 0)))  # that of boxes may be less
    return Figure([[panel]], height=2.6, caption="Mean training loss of every epoch.")


def areas_figure(occupied: Occupied) -> Figure:
    """The mean area of predicted sets over time, and that of the trivial predictor with the same claim."""
    lines = [("predicted sets", occupied.areas, style.BLUE)]
    if occupied.baseline:
        lines.append(("constant velocity, one conformal box", occupied.baseline, style.ORANGE))
    marks: list[Mark] = []
    for name, areas, colour in lines:
        hover = [f"{name}\n{area:.1f} m² after {time:g} s" for time, area in zip(occupied.seconds, areas, strict=True)]
        marks.append(Line(x=np.array(occupied.seconds), y=np.array(areas), colour=colour, name=name))
        marks.append(Points(x=np.array(occupied.seconds), y=np.array(areas), colour=colour, size=2.5, hover=hover))
    x, y = Axis("time [s]", 0, 1.06 * occupied.seconds[-1]), Axis("occupied area [m²]", low=0)
    return Figure(
        [[Panel(marks, x, y)]],
        height=2.6,
        caption="How large an area the centre of a vehicle may be in, on average over windows kept out of training.",
    )
