"""The trajectory basis as a figure (paper, Fig. 1).

All base trajectories as deviations from constant velocity, the darker and thicker the more common, with their numbers;
one of them with its tube at every sample, and a recorded segment that stays within all of it. The tube is the ellipses
of radius ε, or where it is cut, boxes; the ellipses, within which a segment has to stay besides, are then dashed.
M base trajectories of T points.
"""

import numpy as np
from jaxtyping import Float
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator

from coverdrive.errors import DataError
from coverdrive.prediction.cover.basis import Basis
from coverdrive.report import style
from coverdrive.report.labels import labelled, spread

_THINNEST, _THICKEST = 0.7, 2.6
"""[point] line widths of the rarest and the most common base trajectory"""

_CURVE = 31
"""points of a drawn trajectory: the spline that the vehicles follow, not only the samples"""


_INSIDE = style.SKY + "22"
"""colour of the tube at every sample; they overlap"""

_LABELS_APART = 0.05
"""of the height of a plot"""


def basis_figure(
    basis: Basis,
    share: Float[np.ndarray, " M"],
    segments: Float[np.ndarray, "N T 2"] | None = None,
    highlighted: int | None = None,
) -> Figure:
    """Draw a basis.

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
    with style.style():
        figure = style.new_figure(10.5, 6.6)
        grid = figure.add_gridspec(2, 2, height_ratios=(1.25, 1))
        plane = figure.add_subplot(grid[0, :])
        over_time = figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])
        lines = _draw_plane(plane, basis, share)
        _draw_highlighted(plane, basis, base, example)
        _label(plane, share, basis.points[:, -1])
        for component, axes in enumerate(over_time):
            _draw_over_time(axes, basis, share, base, example, component)
        bar = figure.colorbar(lines, ax=[plane, *over_time], aspect=40, pad=0.015)
        bar.set_label("share of the training segments")
        bar.ax.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5), numticks=8))
        bar.ax.yaxis.set_major_formatter(lambda share, _: f"{100 * share:g} %")
        bar.ax.minorticks_off()
        _explain(figure, basis, base, float(share[base]), example is not None)
    return figure


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


def _draw_plane(axes: Axes, basis: Basis, share: Float[np.ndarray, " M"]) -> LineCollection:
    """All base trajectories, lon against lat."""
    times = np.linspace(0, basis.horizon, _CURVE)
    lines = _trajectories(basis.rollout(times)[0], share)
    axes.add_collection(lines)
    axes.set(
        xlabel="deviation from constant velocity along the road [m]",
        ylabel="across the road, to the left [m]",
    )
    axes.set_title(f"{len(basis)} base trajectories of {basis.horizon:g} s", loc="right")
    axes.grid(True)
    return lines


def _draw_highlighted(axes: Axes, basis: Basis, base: int, example: Float[np.ndarray, "T 2"] | None) -> None:
    """One base trajectory with its tube and an example inside it."""
    widths, heights = 2 * basis.tolerance(basis.radius, basis.times).T
    points = basis.points[base]
    cut = basis.reach is not None
    axes.add_collection(
        EllipseCollection(
            widths, heights, np.zeros(len(points)), units="xy", offsets=points, offset_transform=axes.transData,
            facecolor="none" if cut else _INSIDE, edgecolor=style.SKY if cut else style.BLUE,
            linestyle="--" if cut else "-", linewidth=0.8 if cut else 1.0, zorder=4,
        )
    )  # fmt: skip
    if cut:
        half = tube_of(basis, basis.times)
        corners = points[:, None] + half[:, None] * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        axes.add_collection(PolyCollection(list(corners), facecolor=_INSIDE, edgecolor=style.BLUE, zorder=4))
    curve = basis.rollout(np.linspace(0, basis.horizon, _CURVE))[0][base]
    axes.plot(*curve.T, color=style.BLUE, linewidth=2.4, zorder=5)
    axes.plot(*points.T, color=style.BLUE, marker="o", markersize=4, linestyle="none", zorder=5)
    if example is not None:
        axes.plot(*example.T, color=style.VERMILION, linestyle="--", linewidth=2, zorder=6)
    reach = np.stack([widths, heights], axis=-1) / 2
    axes.update_datalim(np.concatenate([points - reach, points + reach]))
    axes.autoscale_view()


def _explain(figure: Figure, basis: Basis, base: int, share: float, has_example: bool) -> None:
    """The legend."""
    label = f"base trajectory {base} ({100 * share:.2g} % of the segments)"
    handles: list[Artist] = [Line2D([], [], color=style.BLUE, linewidth=2.4, label=label)]
    ellipses = f"ellipses of ε = {basis.radius:g}"
    label = f"its tube every {basis.step:g} s" + (f": {ellipses}" if basis.reach is None else ", cut to boxes")
    handles.append(Patch(facecolor=_INSIDE, edgecolor=style.BLUE, label=label))
    if basis.reach is not None:
        handles.append(Line2D([], [], color=style.SKY, linestyle="--", linewidth=0.8, label=f"the {ellipses}"))
    if has_example:
        label = "a recorded segment that it stands for"
        handles.append(Line2D([], [], color=style.VERMILION, linestyle="--", linewidth=2, label=label))
    figure.legend(handles=handles, loc="outside upper left", ncols=2)


def _draw_over_time(
    axes: Axes,
    basis: Basis,
    share: Float[np.ndarray, " M"],
    base: int,
    example: Float[np.ndarray, "T 2"] | None,
    component: int,
) -> None:
    """One component of all base trajectories over time; the highlighted one with its tube as a band."""
    times = np.linspace(0, basis.horizon, _CURVE)
    values = basis.rollout(times)[0][..., component]
    axes.add_collection(_trajectories(np.stack(np.broadcast_arrays(times, values), axis=-1), share))
    half = tube_of(basis, times)[:, component]
    axes.fill_between(
        times, values[base] - half, values[base] + half, color=style.SKY, alpha=0.25, linewidth=0, zorder=4
    )
    axes.plot(times, values[base], color=style.BLUE, linewidth=2.4, zorder=5)
    if example is not None:
        samples = basis.step * np.arange(len(example))
        axes.plot(samples, example[:, component], color=style.VERMILION, linestyle="--", linewidth=2, zorder=6)
    low, high = axes.get_ylim()
    ends = np.stack(np.broadcast_arrays(basis.horizon, values[:, -1]), axis=-1)
    shown = labelled(share)
    ends[shown, 1] = spread(ends[shown, 1], _LABELS_APART * (high - low))
    _label(axes, share, ends)
    axes.set(xlabel="time [s]", ylabel=("along the road [m]", "to the left [m]")[component])
    axes.set_xlim(0, basis.horizon)
    axes.grid(True)


def _label(axes: Axes, share: Float[np.ndarray, " M"], places: Float[np.ndarray, "M 2"]) -> None:
    """The numbers of the base trajectories, beside where they end."""
    for base in labelled(share):
        lon, lat = places[base]
        side, align = (-3, "right") if lon < 0 else (3, "left")
        axes.annotate(
            str(base), (lon, lat), xytext=(side, 0), textcoords="offset points", va="center", ha=align, fontsize=8,
            zorder=7, annotation_clip=False, path_effects=[withStroke(linewidth=2, foreground=style.PAPER)],
        )  # fmt: skip


def _trajectories(curves: Float[np.ndarray, "M n 2"], share: Float[np.ndarray, " M"]) -> LineCollection:
    """Lines coloured by share, the most common on top."""
    rare_first = np.argsort(share)
    lowest = share[share > 0].min(initial=1.0)
    norm = LogNorm(lowest, max(share.max(), 1.001 * lowest), clip=True)
    shown = np.maximum(share[rare_first], lowest)
    widths = _THINNEST + (_THICKEST - _THINNEST) * np.asarray(norm(shown))
    lines = LineCollection(list(curves[rare_first]), cmap=style.SHARES, norm=norm, linewidths=widths.tolist(), zorder=2)
    lines.set_array(shown)
    return lines
