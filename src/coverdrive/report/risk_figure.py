"""Risk against set size: what every method of calibration proves, what was observed, and what it costs."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from coverdrive.certificates.comparison import Compared
from coverdrive.errors import DataError
from coverdrive.report import style

_MARKERS = "osD^vP<>XpH"


def risk_figure(compared: Sequence[Compared]) -> Figure:
    """Draw the mean set size of every method against its certified and its observed miss rate.

    Args:
        compared: methods at their targets; those that refused are left out.

    Raises:
        DataError: every method refused.
    """
    shown = [each for each in compared if each.certificate is not None]
    if not shown:
        raise DataError("every method refused, so that there is nothing to draw; ask for a larger ε")
    methods = sorted({each.method for each in shown}, key=list(type(shown[0].method)).index)
    with style.style():
        figure = style.new_figure(10.5, 5.6)
        axes = figure.subplots()
        for number, method in enumerate(methods):
            _draw_method(axes, [each for each in shown if each.method is method], number)
        unit = shown[0].certificate.unit if shown[0].certificate else "window"
        axes.set(xlabel=f"missed {unit}s [%]", ylabel="mean set size [base trajectories]")
        axes.grid(True)
        figure.legend(loc="outside right upper", title="filled: certified\nopen: observed (95 %)", alignment="left")
    return figure


def _draw_method(axes: Axes, compared: Sequence[Compared], number: int) -> None:
    """Certified bounds as a line of filled markers, observed rates as open ones with their intervals."""
    marker, colour = _MARKERS[number % len(_MARKERS)], f"C{number}"
    points = [
        (each.certificate.epsilon, each.missed, each.evaluation.mean_set_size)
        for each in compared
        if each.certificate and each.evaluation and each.missed
    ]
    bounds, sizes = [100 * bound for bound, _, _ in points], [size for _, _, size in points]
    axes.plot(bounds, sizes, marker=marker, color=colour, label=compared[0].method.value)
    for _, missed, size in points:
        value, low, high = (100 * rate for rate in (missed.value, missed.low, missed.high))
        axes.plot([low, high], [size, size], color=colour, linewidth=0.8, alpha=0.7)
        axes.plot([value], [size], marker=marker, markerfacecolor="white", color=colour)
