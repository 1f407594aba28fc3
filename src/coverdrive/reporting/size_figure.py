"""Size of the basis against ε with its lower bounds, and how much the most common base trajectories stand for."""

from collections.abc import Sequence

import numpy as np

from coverdrive.errors import DataError
from coverdrive.prediction.cover.basis_study import StudiedBasis
from coverdrive.reporting import style
from coverdrive.reporting.figure import Axis, Band, Figure, Line, Mark, Panel, Points, Texts


def size_figure(studied: Sequence[StudiedBasis]) -> Figure:
    """The sizes of bases of several ε, by ascending ε; DataError if there is none."""
    if not studied:
        raise DataError("a figure of the size of bases needs at least one basis, got none; name an ε")
    epsilons = {each.basis.radius: f"{each.basis.radius:g}" for each in studied}
    size = Panel(_sizes(studied), Axis("radius ε of the cover", log=True, ticks=epsilons),
                 Axis("base trajectories M", log=True))  # fmt: skip
    mass = Panel(_masses(studied), Axis("most common base trajectories", log=True),
                 Axis("segments nearest to them [%]", 0, 102))  # fmt: skip
    return Figure([[size, mass]], height=3.2)


def _sizes(studied: Sequence[StudiedBasis]) -> list[Mark]:
    epsilon = [each.basis.radius for each in studied]
    size = [len(each.basis) for each in studied]
    among = [each.among_segments for each in studied]
    curves = [
        (size, "greedy cover", style.BLUE, "o"),
        (among, "lower bound, bases are segments", style.VERMILION, "^"),
        ([each.anywhere for each in studied], "lower bound, any bases", style.GREY, "v"),
    ]
    marks: list[Mark] = [Band(x=epsilon, low=among, high=size, colour=style.SKY, opacity=0.2)]
    for values, label, colour, marker in curves:
        marks += [Line(x=epsilon, y=values, colour=colour), Points(x=epsilon, y=values, colour=colour, marker=marker,
                                                                   name=label)]  # fmt: skip
    return [*marks, Texts(x=epsilon, y=size, text=[str(each) for each in size], above=3)]


def _masses(studied: Sequence[StudiedBasis]) -> list[Mark]:
    return [
        Points(
            x=np.arange(1, len(each.basis) + 1), y=100 * each.cumulative, colour=style.CYCLE[number % len(style.CYCLE)],
            size=2.5, name=f"ε = {each.basis.radius:g} (M = {len(each.basis)})",
        )
        for number, each in enumerate(studied)
    ]  # fmt: skip
