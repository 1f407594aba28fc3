"""Collisions by number of uncontrolled vehicles, with exact intervals (paper, Fig. 4a)."""

import numpy as np
import polars as pl

from coverdrive.errors import DataError
from coverdrive.reporting import style
from coverdrive.reporting.figure import Axis, Bars, Figure, Mark, Panel, Points, Rule, Texts
from coverdrive.simulation.statistics import PAPER, PAPER_TRIALS, collision_table

_KINDS = {"frontal_or_side": ("frontal or side", style.BLUE, "o"), "rear_end": ("rear-end", style.VERMILION, "s")}
"""columns of the table: name, colour and marker"""

_WIDTH = 0.36
"""of a bar; the numbers of vehicles are 1 apart"""

_APART = 1.6
"""from the last number of vehicles to all trials together"""


def collisions_figure(results: pl.DataFrame, confidence: float = 0.95) -> Figure:
    """How often the ego collides, for every number of vehicles and for all trials together.

    Args:
        results: one row per trial, with the columns ``vehicles`` and ``kind``; DataError if there is none.
        confidence: of the Clopper–Pearson intervals, in (0, 1), else CertificateError.
    """
    if results.is_empty():
        raise DataError("a figure of collisions needs at least one trial, got none; run some first")
    table = collision_table(results, confidence)
    place = np.arange(table.height, dtype=float)
    place[-1] = place[-2] + _APART
    numbers = [*table["vehicles"].drop_nulls().to_list(), "all"]
    ticks = {float(at): f"{n} ({trials})" for at, n, trials in zip(place, numbers, table["trials"], strict=True)}
    marks: list[Mark] = [Rule(at=float(place[-1]) - _APART / 2, colour=style.MARKING, width=0.6, dashed=False)]
    for side, kind in enumerate(_KINDS):
        marks += _marks(table, kind, place + (side - 0.5) * _WIDTH)
    x = Axis("uncontrolled vehicles (number of trials)", -0.6, float(place[-1]) + 0.6, ticks=ticks)
    return Figure(
        [[Panel(marks, x, Axis("collisions per 100 trials", low=0))]],
        height=3.1,
        caption="Collisions by number of uncontrolled vehicles (number of trials in brackets): the rate as a mark, its "
        f"{100 * confidence:g} % Clopper–Pearson interval, and the number of collisions above it. Dashed: the paper's "
        f"rates over all its {PAPER_TRIALS} trials.",
        legend_columns=2,
    )


def _marks(table: pl.DataFrame, kind: str, place: np.ndarray) -> list[Mark]:
    """Rates, intervals and counts of one kind of collision, and the paper's total over all numbers of vehicles."""
    name, colour, marker = _KINDS[kind]
    rate, low, high = (100 * table[f"{kind}_{part}"].to_numpy() for part in ("rate", "low", "high"))
    counts = table[kind].to_list()
    hover = [
        f"{count} of {total} with a {name} collision: {value:.3g} % ({least:.2g}–{most:.3g} %)"
        for count, total, value, least, most in zip(counts, table["trials"], rate, low, high, strict=True)
    ]
    paper = f"paper, {name}: {PAPER[kind]} of {PAPER_TRIALS}"
    return [
        Bars(x=place, height=rate, width=_WIDTH, colour=colour, opacity=0.35),
        Points(x=place, y=rate, marker=marker, low=low, high=high, colour=colour, name=name, hover=hover),
        Texts(x=place, y=high, text=[str(count) for count in counts], anchor="middle", above=2, colour=colour),
        Rule(at=100 * PAPER[kind] / PAPER_TRIALS, axis="y", colour=colour, name=paper),
    ]
