"""All methods of calibration on the page: what each bounds, what was observed, and how large its sets are."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.comparison import Compared
from coverdrive.numbers import at_most, percent
from coverdrive.report import style
from coverdrive.report.claim import legend, strength, whose
from coverdrive.report.page.plots import Plot, plot
from coverdrive.report.risk_axis import beyond, risk_limit

_SYMBOLS = ("circle", "square", "diamond", "triangle-up", "triangle-down", "star", "pentagon", "hexagon", "cross", "x",
            "diamond-tall")  # fmt: skip
_CAPTION = (
    "Every method of calibration on the same scores. Large marks are bounds: filled, with confidence; hollow, only on "
    "average over calibrations, so that this one may miss more; with a dot, for each base or group of bases by itself, "
    "so that more of all {unit}s may be missed. Small marks: what was missed on unseen scenes, with its 95 % interval. "
    "Left is safer, low is more useful. A click on a name hides it."
)
_CUT = " An arrow at the right edge stands for what is beyond it."
_ARROW = "triangle-right"


def methods_plot(compared: Sequence[Compared]) -> Plot:
    """Bounds and observed misses of every method against the mean size of its sets.

    Args:
        compared: methods at their targets, of which one at least did not refuse.
    """
    shown = [each for each in compared if each.certificate]
    limit = risk_limit(shown)
    traces: list[go.Scatter] = []
    for number, method in enumerate(dict.fromkeys(each.method for each in shown)):
        colour, symbol = style.CYCLE[number % len(style.CYCLE)], _SYMBOLS[number % len(_SYMBOLS)]
        points = [each for each in shown if each.method is method]
        traces += [_bounds(points, colour, symbol, limit), _observed(points, colour, symbol, limit)]
    unit = next(each.certificate.unit for each in shown if each.certificate)
    cut = any(beyond(each, limit) for each in shown)
    return plot(
        "methods", traces, _CAPTION.format(unit=unit) + _CUT * cut, x=f"missed {unit}s [%]",
        y="mean set size [base trajectories]", wide=True, height=560, xaxis_range=[0, limit], legend_font_size=11.5,
    )  # fmt: skip


def _bounds(points: list[Compared], colour: str, symbol: str, limit: float) -> go.Scatter:
    certificates = [each.certificate for each in points if each.certificate]
    bounds = np.array([100 * each.epsilon for each in certificates])
    far = bounds > limit
    name = legend(points)
    looks: dict[str, Any] = {
        "symbol": [
            _ARROW if is_far else _symbol(symbol, each) for is_far, each in zip(far, certificates, strict=True)
        ],
        "color": colour, "size": 12,
        "line": {
            "width": [1.8 if _edge(each, colour) == colour else 0.9 for each in certificates],
            "color": [_edge(each, colour) for each in certificates],
        },
    }  # fmt: skip
    return go.Scatter(
        x=np.minimum(bounds, limit).round(4), y=_sizes(points), mode="markers+text", name=name, legendgroup=name,
        marker=looks, cliponaxis=False, textposition="top left", textfont={"color": colour},
        text=[f"{beyond(each, limit)} " if is_far else "" for is_far, each in zip(far, points, strict=True)],
        customdata=[_said(each) for each in certificates],
        hovertemplate=f"<b>{points[0].method.value}</b><br>%{{customdata}}<br>%{{y:.2f}} possible bases<extra></extra>",
    )  # fmt: skip


def _said(certificate: Certificate) -> str:
    """The bound in words, in two lines."""
    return f"at most {at_most(certificate.epsilon, 3)} of {whose(certificate)} missed,<br>{strength(certificate)}"


def _symbol(symbol: str, certificate: Certificate) -> str:
    """Hollow if the bound holds on average, with a dot if it is about each base by itself."""
    hollow, dot = "-open" * (certificate.confidence is None), "-dot" * (certificate.groups > 1)
    return symbol + hollow + dot


def _edge(certificate: Certificate, colour: str) -> str:
    """Of a mark and its dot, which has to stand out from a filled one."""
    return style.PAPER if certificate.confidence is not None and certificate.groups > 1 else colour


def _observed(points: list[Compared], colour: str, symbol: str, limit: float) -> go.Scatter:
    rates = [each.missed for each in points if each.missed]
    values, low, high = (
        np.array([100 * part for part in parts])
        for parts in zip(*((rate.value, rate.low, rate.high) for rate in rates), strict=True)
    )
    drawn, far = np.minimum(values, limit), values > limit
    return go.Scatter(
        x=drawn.round(4), y=_sizes(points), mode="markers", legendgroup=legend(points), showlegend=False,
        marker={"symbol": [_ARROW if is_far else symbol for is_far in far], "color": colour, "size": 6},
        error_x={
            "type": "data", "symmetric": False, "thickness": 1, "width": 3, "color": colour,
            "array": (high - drawn).round(4), "arrayminus": np.maximum(drawn - low, 0).round(4),
        },
        cliponaxis=False,
        customdata=[f"{percent(rate.value)} missed on unseen scenes ({rate.count} of {rate.total})" for rate in rates],
        hovertemplate=f"<b>{points[0].method.value}</b><br>%{{customdata}}<br>%{{y:.2f}} possible bases<extra></extra>",
    )  # fmt: skip


def _sizes(points: list[Compared]) -> list[float]:
    return [round(each.evaluation.mean_set_size, 4) for each in points if each.evaluation]
