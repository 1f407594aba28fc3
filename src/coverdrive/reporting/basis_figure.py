"""The trajectory basis as a figure (paper, Fig. 1).

All base trajectories as deviations from constant velocity, the darker and thicker the more common, with their numbers;
one of them with its tube at every sample, and a recorded segment that stays within all of it. The tube is the ellipses
of radius ε, or where it is cut, boxes; the ellipses, within which a segment has to stay besides, are then dashed.
M base trajectories of T points.
"""

import numpy as np
from jaxtyping import Float

from coverdrive.errors import DataError
from coverdrive.numbers import percent
from coverdrive.prediction.cover.basis import Basis
from coverdrive.reporting import style
from coverdrive.reporting.figure import Axis, Band, Bars, Figure, Line, Mark, Panel, Points, Shapes, Texts
from coverdrive.reporting.labels import labelled, spread

_THINNEST, _THICKEST = 0.6, 2.4
"""[point] line widths of the rarest and the most common base trajectory"""

_PALEST, _DARKEST = 0.25, 0.9
"""opacity of them"""

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
    highlighted: int | None = None,
) -> Figure:
    """A basis from above, over time, and how common its trajectories are.

    Args:
        basis: M base trajectories.
        share: of the data that each of them stands for.
        segments: recorded segments [m]; of those within ε of the highlighted base trajectory, the farthest from it
            is drawn.
        highlighted: index of the base trajectory that is drawn with its ellipses; if left out, the most common one
            that ends more than twice its own tolerance away from constant velocity.

    Raises:
        DataError: the shares or the index do not belong to the basis.
    """
    if share.shape != (len(basis),) or not (highlighted is None or 0 <= highlighted < len(basis)):
        raise DataError(
            f"a basis of {len(basis)} trajectories needs as many shares, and an index from 0 to {len(basis) - 1}; "
            f"got shares of shape {share.shape} and the index {highlighted}"
        )
    base = most_telling(basis, share) if highlighted is None else highlighted
    example = None if segments is None else farthest_inside(basis, base, segments)
    over_time = [_over_time(basis, share, base, example, component) for component in (0, 1)]
    return Figure(
        [[_plane(basis, share, base, example)], over_time, [_shares(share)]],
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
    moves = last > 2 * basis.radius
    return int(np.argmax(share + moves))


def tube_of(basis: Basis, times: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 2"]:
    """Half extents [m] along lon and lat of the tube around a base: of its ellipses, or where it is cut, its boxes."""
    if basis.reach is None:
        return basis.tolerance(basis.radius, times)
    return basis.radius * basis.tube(times)


def farthest_inside(basis: Basis, base: int, segments: Float[np.ndarray, "N T 2"]) -> Float[np.ndarray, "T 2"] | None:
    """The segment farthest from a base trajectory among those that it covers, or None if it covers none."""
    distance = basis.distance(segments)[:, base]
    covered = distance <= basis.radius
    return segments[np.argmax(np.where(covered, distance, -1))] if covered.any() else None


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


def _plane(basis: Basis, share: Float[np.ndarray, " M"], base: int, example: Float[np.ndarray, "T 2"] | None) -> Panel:
    """All base trajectories, lon against lat; one with its tube and an example inside it."""
    curves = basis.rollout(np.linspace(0, basis.horizon, _CURVE))[0]
    marks = [*_trajectories(curves, share), *_tube(basis, base), *_highlighted(curves[base], base, share)]
    marks.append(Points(x=basis.points[base][:, 0], y=basis.points[base][:, 1], size=3))
    if example is not None:
        marks.append(_recorded(example))
    marks.append(_labels(share, basis.points[:, -1]))
    return Panel(marks, Axis("deviation from constant velocity along the road [m]"), Axis("to the left [m]"))


def _tube(basis: Basis, base: int) -> list[Mark]:
    """Ellipses or boxes around every sample; ellipses that a box is cut from are dashed."""
    rings = basis.points[base][:, None] + basis.tolerance(basis.radius, basis.times)[:, None] * _CIRCLE
    name = f"its tube every {basis.step:g} s"
    if basis.reach is None:
        return [Shapes(outlines=list(rings), colour=style.SKY, name=f"{name}: ellipses of ε = {basis.radius:g}")]
    boxes = basis.points[base][:, None] + tube_of(basis, basis.times)[:, None] * _SQUARE
    return [
        Shapes(outlines=list(rings), filled=False, dashed=True, width=0.6, colour=style.SKY,
               name=f"the ellipses of ε = {basis.radius:g}"),
        Shapes(outlines=list(boxes), colour=style.SKY, name=f"{name}, cut to boxes"),
    ]  # fmt: skip


def _over_time(
    basis: Basis,
    share: Float[np.ndarray, " M"],
    base: int,
    example: Float[np.ndarray, "T 2"] | None,
    component: int,
) -> Panel:
    """One component of all base trajectories over time; the highlighted one with its tube as a band."""
    times = np.linspace(0, basis.horizon, _CURVE)
    values = basis.rollout(times)[0][..., component]
    curves = np.stack(np.broadcast_arrays(times, values), axis=-1)
    half = tube_of(basis, times)[:, component]
    band = Band(x=times, low=values[base] - half, high=values[base] + half, colour=style.SKY, opacity=0.25)
    marks = [*_trajectories(curves, share), band, *_highlighted(curves[base], base, share)]
    if example is not None:
        marks.append(_recorded(np.stack([basis.times, example[:, component]], axis=-1)))
    shown, ends = labelled(share), np.stack(np.broadcast_arrays(basis.horizon, values[:, -1]), axis=-1)
    ends[shown, 1] = spread(ends[shown, 1], _LABELS_APART * (np.ptp(values) or 1.0))
    label = ("along the road [m]", "to the left [m]")[component]
    return Panel([*marks, _labels(share, ends)], Axis("time [s]", 0, 1.06 * basis.horizon), Axis(label))


def _highlighted(curve: Float[np.ndarray, "n 2"], base: int, share: Float[np.ndarray, " M"]) -> list[Mark]:
    name = f"base trajectory {base} ({percent(float(share[base]), 2)} of the segments)"
    return [Line(x=curve[:, 0], y=curve[:, 1], width=2, name=name, hover=name)]


def _recorded(points: Float[np.ndarray, "n 2"]) -> Mark:
    name = "a recorded segment that it stands for"
    return Line(x=points[:, 0], y=points[:, 1], width=1.6, dashed=True, colour=style.VERMILION, name=name, hover=name)


def _labels(share: Float[np.ndarray, " M"], places: Float[np.ndarray, "M 2"]) -> Mark:
    """The numbers of the base trajectories, beside where they end."""
    shown = labelled(share)
    anchors = ["end" if lon < 0 else "start" for lon in places[shown, 0]]
    text = [str(base) for base in shown]
    return Texts(x=places[shown, 0], y=places[shown, 1], text=text, anchor=anchors, colour=style.BLACK)


def _trajectories(curves: Float[np.ndarray, "M n 2"], share: Float[np.ndarray, " M"]) -> list[Line]:
    """Lines as dark and thick as they are common on a scale of logarithms, the most common on top."""
    common = _commonness(share)
    return [
        Line(
            x=curves[base, :, 0], y=curves[base, :, 1], colour=style.BLACK,
            width=_THINNEST + (_THICKEST - _THINNEST) * float(common[base]),
            opacity=_PALEST + (_DARKEST - _PALEST) * float(common[base]),
            hover=f"base {base}\n{percent(float(share[base]))} of the training segments",
        )
        for base in np.argsort(share)
    ]  # fmt: skip


def _commonness(share: Float[np.ndarray, " M"]) -> Float[np.ndarray, " M"]:
    """From 0 of the rarest that occurs to 1 of the most common."""
    lowest = share[share > 0].min(initial=1.0)
    logarithm = np.log(np.maximum(share, lowest) / lowest)
    return logarithm / max(logarithm.max(), 1e-3)


def _shares(share: Float[np.ndarray, " M"]) -> Panel:
    order = np.argsort(-share)
    shown = {float(place): str(base) for place, base in enumerate(order)} if len(order) <= 40 else None
    hover = [f"base {base}: {percent(float(share[base]))} of the training segments" for base in order]
    bars = Bars(x=np.arange(len(order)), height=100 * share[order], width=0.75, hover=hover)
    text = [percent(float(share[base]), 2) for base in order] if shown else []
    words = Texts(x=np.arange(len(text)), y=100 * share[order][: len(text)], text=text, anchor="middle", above=2)
    x = Axis(
        "base trajectory" if shown else "base trajectories, the most common first", -0.7, len(order) - 0.3, ticks=shown
    )
    return Panel([bars, words], x, Axis("training segments [%]", low=0))
