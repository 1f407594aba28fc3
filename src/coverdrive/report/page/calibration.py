"""Calibration on the page: scores and thresholds, set sizes, losses, and all methods side by side."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import plotly.graph_objects as go

from coverdrive.certificates.comparison import Compared
from coverdrive.certificates.rule import Thresholds
from coverdrive.prediction.learned import Learned
from coverdrive.prediction.predictor import Predictor
from coverdrive.report import style
from coverdrive.report.page.methods import methods_plot
from coverdrive.report.page.plots import Plot, plot
from coverdrive.report.score_axis import ScoreAxis


def calibration_plots(predictor: Predictor, learned: Learned, compared: Sequence[Compared]) -> list[Plot]:
    """How scores separate, where the thresholds lie, and what they cost."""
    rule = predictor.rule
    thresholds = rule.values if isinstance(rule, Thresholds) else np.empty(0)
    plots = [
        _scores("driven", learned, learned.driven, thresholds, style.BLUE,
                "Scores of the base that a calibration vehicle drove. The bars are the thresholds: a base is possible "
                "from its threshold on, so that what lies left of it is missed."),
        _scores("others", learned, learned.others, thresholds, style.VERMILION,
                "Scores of the bases that it did not drive. What lies right of the thresholds makes the sets larger."),
        _set_sizes(learned),
        _losses(learned),
    ]  # fmt: skip
    return [methods_plot(compared), *plots] if any(each.certificate for each in compared) else plots


def _scores(name: str, learned: Learned, counts: np.ndarray, thresholds: np.ndarray, colour: str, caption: str) -> Plot:
    """One row for each base: how its scores are distributed, and its threshold."""
    axis = ScoreAxis.around(learned.edges, np.stack([learned.driven, learned.others]), thresholds)
    shown = slice(axis.first, axis.last + 1)
    share = counts / np.maximum(counts.sum(1, keepdims=True), 1)
    bases = [str(base) for base in range(len(counts))]
    bins = [f"{low:.3g} to {high:.3g}" for low, high in pairwise(learned.edges)]
    heat = go.Heatmap(
        x=axis.edges[axis.first : axis.last + 2].round(3),
        y=bases,
        z=np.where(counts > 0, np.sqrt(share), np.nan).round(3)[:, shown],
        customdata=counts[:, shown],
        text=[bins[shown]] * len(bases),
        colorscale=[[0, _fade(colour, 0.10)], [1, _fade(colour, 1.0)]],
        showscale=False,
        ygap=3,
        hovertemplate="base %{y}, score %{text}<br>%{customdata} windows<extra></extra>",
        hoverongaps=False,
    )
    marks = go.Scatter(
        x=axis.place(thresholds).round(3), y=bases, mode="markers", customdata=thresholds,
        marker={"symbol": "line-ns", "size": 15, "line": {"width": 3, "color": style.GREEN}},
        hovertemplate="base %{y}: possible from the score %{customdata:.3g} on<extra></extra>",
    )  # fmt: skip
    low, high = axis.limits
    return plot(
        f"scores-{name}", [heat, marks], caption, x="score (scale of log-odds)", y="base trajectory", showlegend=False,
        height=140 + 26 * len(bases), xaxis_range=[low - 0.15, high + 0.15], xaxis_tickvals=list(axis.ticks),
        xaxis_ticktext=list(axis.ticks.values()), yaxis_type="category",
    )  # fmt: skip


def _set_sizes(learned: Learned) -> Plot:
    sizes = np.arange(len(learned.set_sizes))
    bars = go.Bar(
        x=sizes, y=(100 * learned.set_sizes / learned.set_sizes.sum()).round(3), marker={"color": style.BLUE},
        hovertemplate="%{x} possible bases: %{y:.1f} % of the windows<extra></extra>",
    )  # fmt: skip
    return plot(
        "set-sizes", [bars], f"How many of the {len(sizes) - 1} base trajectories are possible, on unseen scenes.",
        x="size of the predicted set", y="test windows [%]", bargap=0.15,
    )  # fmt: skip


def _losses(learned: Learned) -> Plot:
    line = go.Scatter(
        x=np.arange(1, len(learned.losses) + 1), y=learned.losses.round(5), mode="lines+markers",
        line={"color": style.BLUE}, hovertemplate="epoch %{x}: %{y:.4g}<extra></extra>",
    )  # fmt: skip
    return plot("losses", [line], "Mean training loss of every epoch.", x="epoch", y="loss", yaxis_type="log")


def _fade(colour: str, opacity: float) -> str:
    red, green, blue = (int(colour[at : at + 2], 16) for at in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity})"
