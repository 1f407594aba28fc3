"""Size of the basis against ε with its lower bounds, and how much the most common base trajectories stand for."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter, NullFormatter

from coverdrive.errors import DataError
from coverdrive.prediction.cover.basis_study import StudiedBasis
from coverdrive.report import style


def size_figure(studied: Sequence[StudiedBasis]) -> Figure:
    """Draw the sizes of bases of several ε.

    Args:
        studied: at least one basis, by ascending ε.

    Raises:
        DataError: there is no basis.
    """
    if not studied:
        raise DataError("a figure of the size of bases needs at least one basis, got none; name an ε")
    with style.style():
        figure = style.new_figure(10.5, 4.6)
        size, mass = figure.subplots(1, 2)
        _draw_size(size, studied)
        _draw_mass(mass, studied)
    return figure


def _draw_size(axes: Axes, studied: Sequence[StudiedBasis]) -> None:
    epsilon = [each.basis.radius for each in studied]
    size = [len(each.basis) for each in studied]
    among = [each.among_segments for each in studied if each.among_segments is not None]
    anywhere = [each.anywhere for each in studied]
    of_segments = len(among) == len(studied)
    lowest, label = (among, "greedy cover") if of_segments else (anywhere, "cover, free centres")
    axes.fill_between(epsilon, lowest, size, color=style.SKY, alpha=0.2, linewidth=0)
    axes.plot(epsilon, size, color=style.BLUE, marker="o", label=label)
    if of_segments:
        axes.plot(epsilon, among, color=style.VERMILION, marker="^", label="lower bound, bases are segments")
    axes.plot(epsilon, anywhere, color=style.GREY, marker="v", linestyle="--", label="lower bound, any bases")
    axes.set(xscale="log", yscale="log", xlabel="radius ε of the cover", ylabel="base trajectories M")
    axes.set_xticks(epsilon, [f"{each:g}" for each in epsilon])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_major_formatter(LogFormatter())
    axes.yaxis.set_minor_formatter(LogFormatter(labelOnlyBase=False, minor_thresholds=(2, 0.4)))
    for x, y in zip(epsilon, size, strict=True):
        axes.annotate(str(y), (x, y), xytext=(5, 5), textcoords="offset points", fontsize=10)
    axes.grid(True)
    axes.legend(loc="lower left")


def _draw_mass(axes: Axes, studied: Sequence[StudiedBasis]) -> None:
    for number, each in enumerate(studied):
        count = np.arange(1, len(each.basis) + 1)
        colour = style.CYCLE[number % len(style.CYCLE)]
        label = f"ε = {each.basis.radius:g} (M = {len(each.basis)})"
        axes.plot(count, 100 * each.cumulative, color=colour, marker=".", label=label)
    axes.set(xscale="log", xlabel="most common base trajectories", ylabel="segments nearest to them [%]", ylim=(0, 102))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.grid(True)
    axes.legend(loc="lower right")
