"""Figures of trajectory bases: one as in the paper (Fig. 1), and the sizes of several, against ε.

M base trajectories of T points. The tube of a base is the ellipses of radius ε, or where it is cut, boxes; the
ellipses, within which a segment has to stay besides, are then dashed.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.optimize import isotonic_regression

from coverdrive.errors import DataError
from coverdrive.percentages import percent
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.cover.basis_study import StudiedBasis
from coverdrive.reporting.plotting import style
from coverdrive.reporting.plotting.figure import Axis, Band, Bars, Figure, Line, Mark, Panel, Points, Shapes, Texts

MOST = 24
"""labels that find room beside a plot"""

_CURVE = 31
"""points of a drawn trajectory: the spline that the vehicles follow, not only the samples"""

_TURN = np.linspace(0, 2 * np.pi, 49)[:-1]
_CIRCLE = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=-1)
_SQUARE = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])

_LABELS_APART = 0.055
"""of the height of a plot"""


def basis_figure(
    basis: Basis,
    share: Float[np.ndarray, " M"],
    segments: Float[np.ndarray, "N T 2"] | None = None,
) -> Figure:
    """A basis from above, over time, and how common its trajectories are; `most_telling` is drawn with its tube.

    Args:
        basis: M base trajectories.
        share: of the data that each of them stands for.
        segments: recorded segments [m]; of those within ε of that one, the farthest from it is drawn.
    """
    base = most_telling(basis, share)
    example = None if segments is None else farthest_inside(basis, base, segments)
    times = np.linspace(0, basis.horizon, _CURVE)
    curves, half = basis.rollout(times)[0], tube_of(basis, times)
    labelled = np.sort(np.argsort(-share, kind="stable")[:MOST])  # all, or the most common

    def panel(
        lines: Float[np.ndarray, "M n 2"], tube: list[Mark], more: list[Mark], example: Float[np.ndarray, "T 2"] | None,
        ends: Float[np.ndarray, "M 2"], x: Axis, y: Axis,
    ) -> Panel:  # fmt: skip
        name = f"base trajectory {base} ({percent(float(share[base]), 2)} of the segments)"
        marks = [*_trajectories(lines, share), *tube, _named(lines[base], name, width=2), *more]
        if example is not None:
            name = "a recorded segment that it stands for"
            marks.append(_named(example, name, width=1.6, dashed=True, colour=style.VERMILION))
        anchors = ["end" if lon < 0 else "start" for lon in ends[labelled, 0]]
        text = [str(each) for each in labelled]
        labels = Texts(x=ends[labelled, 0], y=ends[labelled, 1], text=text, anchor=anchors, colour=style.BLACK)
        return Panel([*marks, labels], x, y)

    def over_time(component: int, label: str) -> Panel:
        values = curves[..., component]
        low, high = values[base] - half[:, component], values[base] + half[:, component]
        ends = _with_time(basis.horizon, values[:, -1])
        ends[labelled, 1] = spread(ends[labelled, 1], _LABELS_APART * (np.ptp(values) or 1.0))
        recorded = None if example is None else _with_time(basis.times, example[:, component])
        band = Band(x=times, low=low, high=high, colour=style.SKY, opacity=0.25)
        x = Axis("time [s]", 0, 1.06 * basis.horizon)
        return panel(_with_time(times, values), [band], [], recorded, ends, x, Axis(label))

    dots = Points(x=basis.points[base][:, 0], y=basis.points[base][:, 1], size=3)
    x, y = Axis("deviation from constant velocity along the road [m]"), Axis("to the left [m]")
    plane = panel(curves, _tube(basis, base), [dots], example, basis.points[:, -1], x, y)
    return Figure(
        [[plane], [over_time(0, "along the road [m]"), over_time(1, "to the left [m]")], [_shares(share)]],
        height=6.2,
        heights=(1.3, 1, 0.7),
        caption=f"{len(basis)} base trajectories of {basis.horizon:g} s as deviations from constant velocity, the "
        f"darker and thicker the more common. {_explained(basis, base)}. Below, the share of the training segments "
        "that each of them stands for.",
        legend_columns=2,
    )


def most_telling(basis: Basis, share: Float[np.ndarray, " M"]) -> int:
    """The most common base trajectory that ends over twice its tolerance away; if none does, the most common."""
    last = np.linalg.norm(basis.scaled(basis.points)[:, -1], axis=-1)
    return int(np.argmax(share + (last > 2 * basis.radius)))


def tube_of(basis: Basis, times: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 2"]:
    """Half extents [m] along lon and lat of the tube around a base: of its ellipses, or where it is cut, its boxes."""
    return basis.tolerance(basis.radius, times) if basis.reach is None else basis.radius * basis.tube(times)


def farthest_inside(basis: Basis, base: int, segments: Float[np.ndarray, "N T 2"]) -> Float[np.ndarray, "T 2"] | None:
    """The segment farthest from a base trajectory among those that it covers, or None if it covers none."""
    distance = basis.distance(segments)[:, base]
    covered = distance <= basis.radius
    return segments[np.argmax(np.where(covered, distance, -1))] if covered.any() else None


def spread(values: Float[np.ndarray, " N"], apart: float) -> Float[np.ndarray, " N"]:
    """Places at least ``apart`` from each other, in the order of the values and as near to them as can be."""
    order = np.argsort(values, kind="stable")
    room = apart * np.arange(len(values))
    places = np.empty(len(values))
    places[order] = isotonic_regression(values[order] - room).x + room
    return places


def _explained(basis: Basis, base: int) -> str:
    """What is drawn around a base."""
    first, last = (
        "{:.2g} m × {:.2g} m".format(*half) for half in tube_of(basis, np.array([basis.step, basis.horizon]))
    )
    extents = f"{first} after {basis.step:g} s, {last} after {basis.horizon:g} s"
    if basis.reach is None:
        return f"The ellipses around base {base} are its tube (half axes along × across the road: {extents})"
    return (
        f"The boxes around base {base} are its tube (half extents along × across the road: {extents}); what it stands "
        f"for also stays within the dashed ellipses of ε = {basis.radius:g}"
    )


def _tube(basis: Basis, base: int) -> list[Mark]:
    """Ellipses or boxes around every sample; ellipses that a box is cut from are dashed."""
    rings = basis.points[base][:, None] + basis.tolerance(basis.radius, basis.times)[:, None] * _CIRCLE
    name, ellipses = f"its tube every {basis.step:g} s", f"ellipses of ε = {basis.radius:g}"
    if basis.reach is None:
        return [Shapes(outlines=list(rings), colour=style.SKY, name=f"{name}: {ellipses}")]
    boxes = basis.points[base][:, None] + tube_of(basis, basis.times)[:, None] * _SQUARE
    return [
        Shapes(outlines=list(rings), filled=False, dashed=True, width=0.6, colour=style.SKY, name=f"the {ellipses}"),
        Shapes(outlines=list(boxes), colour=style.SKY, name=f"{name}, cut to boxes"),
    ]


def _with_time(
    times: Float[np.ndarray, " n"] | float, values: Float[np.ndarray, "*m n"]
) -> Float[np.ndarray, "*m n 2"]:
    return np.stack(np.broadcast_arrays(times, values), axis=-1)


def _named(
    points: Float[np.ndarray, "n 2"], name: str, width: float, dashed: bool = False, colour: str = style.BLUE
) -> Line:
    return Line(x=points[:, 0], y=points[:, 1], width=width, dashed=dashed, colour=colour, name=name, hover=name)


def _trajectories(curves: Float[np.ndarray, "M n 2"], share: Float[np.ndarray, " M"]) -> list[Line]:
    """Lines as dark and thick as they are common on a scale of logarithms, the most common on top."""
    lowest = share[share > 0].min(initial=1.0)
    logarithm = np.log(np.maximum(share, lowest) / lowest)
    common = (logarithm / max(logarithm.max(), 1e-3)).tolist()
    return [
        Line(
            x=curves[base, :, 0], y=curves[base, :, 1], colour=style.BLACK, width=0.6 + 1.8 * common[base],
            opacity=0.25 + 0.65 * common[base],
            hover=f"base {base}\n{percent(float(share[base]))} of the training segments",
        )
        for base in np.argsort(share)
    ]  # fmt: skip


def _shares(share: Float[np.ndarray, " M"]) -> Panel:
    order = np.argsort(-share)
    shown = {float(place): str(base) for place, base in enumerate(order)} if len(order) <= 40 else None
    hover = [f"base {base}: {percent(float(share[base]))} of the training segments" for base in order]
    bars = Bars(x=np.arange(len(order)), height=100 * share[order], width=0.75, hover=hover)
    text = [percent(float(share[base]), 2) for base in order] if shown else []
    words = Texts(x=np.arange(len(text)), y=100 * share[order][: len(text)], text=text, anchor="middle", above=2)
    label = "base trajectory" if shown else "base trajectories, the most common first"
    return Panel([bars, words], Axis(label, -0.7, len(order) - 0.3, ticks=shown), Axis("training segments [%]", low=0))


def size_figure(studied: Sequence[StudiedBasis]) -> Figure:
    """The sizes of bases of several ε, by ascending ε; DataError if there is none."""
    if not studied:
        raise DataError("a figure of the size of bases needs at least one basis, got none; name an ε")
    epsilons = {each.basis.radius: f"{each.basis.radius:g}" for each in studied}
    size = Panel(_sizes(studied), Axis("radius ε of the cover [m across the road]", log=True, ticks=epsilons),
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
