"""What a predictor learned: the distribution of its scores, the sizes of its sets, and how its loss fell.

Scores are on an axis of the bins in which they were counted, which have equal log-odds, log(y / (1 − y)), because
networks score near 0 and near 1, and thresholds lie near 0. The first bin has all that is nearer to 0, the last one all
that is nearer to 1. Only bins from the first to the last in which something is are shown. E edges of B = E − 1 bins.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from coverdrive.certificates.rule import Rule as Sets
from coverdrive.certificates.rule import Thresholds
from coverdrive.percentages import percent
from coverdrive.prediction.certifying.occupied import Occupied
from coverdrive.prediction.fits.learned import Learned
from coverdrive.reporting.plotting import style
from coverdrive.reporting.plotting.figure import Axis, Bars, Figure, Line, Mark, Panel, Points, Rule

_TALLEST = 0.9
"""height of the largest bin; rows are 1 apart"""

_TICKS = {0.0: "0", 1e-5: "10⁻⁵", 1e-4: "10⁻⁴", 1e-3: "0.001", 0.01: "0.01", 0.1: "0.1", 0.5: "0.5", 0.9: "0.9",
          0.99: "0.99", 1.0: "1"}  # fmt: skip


def scores_figure(learned: Learned, rule: Sets) -> Figure:
    """One row for each base: the scores of calibration windows that drove it, of others, and its threshold, if any."""
    bases, edges = len(learned.driven), learned.edges
    values = rule.values if isinstance(rule, Thresholds) else np.empty(0)
    places = np.interp(values, edges, np.arange(len(edges)))
    filled = np.flatnonzero((learned.driven + learned.others).sum(0))
    shown = [*filled, *places.astype(int)] or [0]
    low, high = min(shown), min(max(shown) + 1, len(edges) - 1)
    ticks = {float(np.interp(score, edges, np.arange(len(edges)))): text for score, text in _TICKS.items()}
    x = Axis(
        "score (scale of log-odds)", low - 0.5, high + 0.5,
        ticks={place: text for place, text in ticks.items() if low <= place <= high},
    )  # fmt: skip
    y = Axis("base trajectory", -0.15, bases, ticks={base: str(base) for base in range(bases)})
    thresholds = Points(
        x=places, y=np.arange(len(values)) + _TALLEST / 2, marker="|", size=11, colour=style.BLACK,
        name="threshold: possible from here on",
        hover=[f"base {base}: possible from the score {value:.3g} on" for base, value in enumerate(values)],
    )  # fmt: skip
    sides = (
        (learned.driven, style.BLUE, "base that was driven"),
        (learned.others, style.ORANGE, "bases that were not driven"),
    )
    panels = [
        Panel([*_rows(counts, edges, colour), *[thresholds] * bool(len(values))], x, y, title)
        for counts, colour, title in sides
    ]
    return Figure(
        [panels],
        height=1.1 + 0.2 * bases,
        caption="Scores of every base in the calibration windows that drove it, and in those that did not (roots of "
        "the counts, so that rare scores stay visible). A base is possible from its threshold on: what lies left of it "
        "is missed in the left panel, and what lies right of it makes the sets larger in the right one.",
    )


def _rows(counts: Int[np.ndarray, "M B"], edges: Float[np.ndarray, " _"], colour: str) -> Iterator[Mark]:
    """Square roots of the counts of every bin that is not empty."""
    names = [f"{low:.3g} to {high:.3g}" for low, high in pairwise(edges)]
    for base, row in enumerate(counts):
        bins = np.flatnonzero(row)
        yield Bars(
            x=bins + 0.5, width=1.0, height=_TALLEST * np.sqrt(row[bins] / max(row.max(), 1)), base=base,
            colour=colour, opacity=0.75,
            hover=[f"base {base}, score {names[number]}\n{row[number]} windows" for number in bins],
        )  # fmt: skip


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
