"""Risk against set size: what every method of calibration bounds, what was observed, and what it costs."""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.comparison import Compared
from coverdrive.errors import DataError
from coverdrive.report import style
from coverdrive.report.claim import legend
from coverdrive.report.risk_axis import beyond, risk_limit

_MARKERS = "osD^v*pHPXd"
_LARGE, _SMALL = 9, 4.5
"""[point] marks of bounds, and of what was observed"""
_LEGEND = (
    "large: bound, with confidence if filled,\nonly on average over calibrations if hollow;\n"
    "with a dot: each base or group of bases\nby itself. Small: observed (95 %).\nAn arrow: beyond the edge"
)


def risk_figure(compared: Sequence[Compared]) -> Figure:
    """Draw the mean set size of every method against the bound on its miss rate and the observed one.

    Args:
        compared: methods at their targets; those that refused are left out.

    Raises:
        DataError: every method refused.
    """
    shown = [each for each in compared if each.certificate is not None]
    if not shown:
        raise DataError("every method refused, so that there is nothing to draw; ask for a larger ε")
    methods = sorted({each.method for each in shown}, key=list(type(shown[0].method)).index)
    limit = risk_limit(shown)
    with style.style():
        figure = style.new_figure(11.5, 5.6)
        axes = figure.subplots()
        for number, method in enumerate(methods):
            _draw_method(axes, [each for each in shown if each.method is method], number, limit)
        unit = shown[0].certificate.unit if shown[0].certificate else "window"
        axes.set(xlabel=f"missed {unit}s [%]", ylabel="mean set size [base trajectories]", xlim=(0, limit))
        axes.grid(True)
        figure.legend(loc="outside right upper", title=_LEGEND, alignment="left")
    return figure


def _draw_method(axes: Axes, compared: Sequence[Compared], number: int, limit: float) -> None:
    """Bounds as large marks, observed rates as small ones with intervals; what is beyond the edge as arrows."""
    marker, colour = _MARKERS[number % len(_MARKERS)], style.CYCLE[number % len(style.CYCLE)]
    axes.plot(
        [], [], marker=marker, markersize=_LARGE, color=colour, linestyle="none", label=legend(compared),
        markerfacecolor=_filling(compared[0].certificate, colour),
    )  # fmt: skip
    for each in compared:
        if not (each.certificate and each.evaluation and each.missed):
            continue
        size, bound = each.evaluation.mean_set_size, 100 * each.certificate.epsilon
        value, low, high = (100 * rate for rate in (each.missed.value, each.missed.low, each.missed.high))
        axes.plot([low, high], [size, size], color=colour, linewidth=0.8, alpha=0.7)
        _mark(axes, value, size, limit, marker=marker, markersize=_SMALL, color=colour)
        filling = _filling(each.certificate, colour)
        _mark(axes, bound, size, limit, marker=marker, markersize=_LARGE, color=colour, markerfacecolor=filling)
        if each.certificate.groups > 1 and bound <= limit:
            dot = style.PAPER if filling == colour else colour
            axes.plot([bound], [size], marker=".", markersize=5, color=dot, linestyle="none")
        if bound > limit:
            axes.annotate(
                beyond(each, limit), (limit, size), xytext=(-8, 5), textcoords="offset points", color=colour,
                ha="right", fontsize=9,
            )  # fmt: skip


def _mark(axes: Axes, value: float, size: float, limit: float, **look: Any) -> None:
    """One mark, or an arrow at the edge."""
    if value > limit:
        look |= {"marker": ">", "clip_on": False}
    axes.plot([min(value, limit)], [size], linestyle="none", **look)


def _filling(certificate: Certificate | None, colour: str) -> str:
    """None if the bound holds on average only."""
    return style.PAPER if certificate is not None and certificate.confidence is None else colour
