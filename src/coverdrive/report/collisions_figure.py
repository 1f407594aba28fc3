"""Collisions by number of uncontrolled vehicles, with exact intervals (paper, Fig. 4a)."""

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from coverdrive.errors import DataError
from coverdrive.report import style
from coverdrive.simulation.statistics import PAPER, PAPER_TRIALS, collision_table

_KINDS = {
    "frontal_or_side": ("frontal or side", style.BLUE),
    "rear_end": ("rear-end", style.ORANGE),
}
"""columns of the table: name and colour"""

_WIDTH = 0.36
"""of a bar; the numbers of vehicles are 1 apart"""

_APART = 1.6
"""from the last number of vehicles to all trials together"""


def collisions_figure(results: pl.DataFrame, confidence: float = 0.95) -> Figure:
    """Draw how often the own car collides, for every number of vehicles and for all trials together.

    Args:
        results: one row per trial, with the columns ``vehicles`` and ``kind``.
        confidence: coverage of the Clopper–Pearson intervals, in (0, 1).

    Raises:
        DataError: there is no trial.
        CertificateError: confidence outside (0, 1).
    """
    if results.is_empty():
        raise DataError("a figure of collisions needs at least one trial, got none; run some first")
    table = collision_table(results, confidence)
    place = np.arange(table.height, dtype=float)
    place[-1] = place[-2] + _APART
    with style.style():
        figure = style.new_figure(9, 5.2)
        axes = figure.subplots()
        bars = [_draw_bars(axes, table, kind, place + (side - 0.5) * _WIDTH) for side, kind in enumerate(_KINDS)]
        lines = [_draw_paper(axes, kind) for kind in _KINDS]
        numbers = [*table["vehicles"].drop_nulls().to_list(), "all"]
        labels = [f"{number}\n{trials} trials" for number, trials in zip(numbers, table["trials"], strict=True)]
        axes.set_xticks(place, labels)
        axes.tick_params(axis="x", length=0)
        axes.set(xlabel="uncontrolled vehicles", ylabel="collisions per 100 trials")
        axes.set_ylim(0, 1.1 * max(100 * float(high) for kind in _KINDS for high in table[f"{kind}_high"]))
        axes.axvline(float(place[-1]) - _APART / 2, color=style.MARKING, linewidth=0.8)
        axes.grid(True, axis="y")
        title = f"number of collisions, and {100 * confidence:g} % Clopper–Pearson interval of their rate"
        figure.legend(handles=[*bars, *lines], loc="outside upper left", ncols=2, title=title, alignment="left")
    return figure


def _draw_bars(axes: Axes, table: pl.DataFrame, kind: str, place: np.ndarray) -> BarContainer:
    """Rates, intervals and counts of one kind of collision."""
    name, colour = _KINDS[kind]
    rate, low, high = (100 * table[f"{kind}_{part}"].to_numpy() for part in ("rate", "low", "high"))
    whiskers = np.maximum(np.stack([rate - low, high - rate]), 0)
    bars = axes.bar(place, rate, _WIDTH, color=colour, label=name)
    axes.errorbar(place, rate, whiskers, fmt="none", ecolor=style.BLACK, elinewidth=1.2, capsize=4)
    for at, top, count in zip(place, high, table[kind], strict=True):
        axes.annotate(
            str(count), (at, top), xytext=(0, 4), textcoords="offset points", ha="center", fontsize=10,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},
        )  # fmt: skip
    return bars


def _draw_paper(axes: Axes, kind: str) -> Line2D:
    """The paper's total over all numbers of vehicles."""
    (name, colour), paper = _KINDS[kind], PAPER[kind]
    label = f"paper, all trials, {name}: {paper} of {PAPER_TRIALS}"
    rate = 100 * paper / PAPER_TRIALS
    return axes.axhline(rate, color=colour, linestyle=(0, (1, 1.5)), linewidth=2, zorder=0.9, label=label)
