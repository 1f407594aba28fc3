"""The basis on the page: every base trajectory, with its share of the data under the pointer."""

import numpy as np
import plotly.graph_objects as go

from coverdrive.numbers import percent
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.learned import Learned
from coverdrive.report import style
from coverdrive.report.basis_figure import most_telling, tube_of
from coverdrive.report.labels import labelled, spread
from coverdrive.report.page.plots import Plot, plot

_CURVE = 31
"""points of a drawn trajectory"""
_THINNEST, _THICKEST = 1.2, 5.0
"""[pixel]"""
_CIRCLE = np.linspace(0, 2 * np.pi, 61)
_SQUARE = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)])
_LABELS_APART = 0.05
"""of the height of a plot"""


def basis_plots(basis: Basis, learned: Learned) -> list[Plot]:
    """All base trajectories from above, and over time."""
    times = np.linspace(0, basis.horizon, _CURVE)
    curves = basis.rollout(times)[0]
    telling = most_telling(basis, learned.base_share)
    plane = [_line(curves[base], base, learned) for base in range(len(basis))]
    return [
        plot(
            "basis",
            [*_tube(basis, telling), *plane, _example(learned, telling), _labels(learned, basis.points[:, -1])],
            f"{len(basis)} base trajectories of {basis.horizon:g} s as deviations from constant velocity, the thicker "
            f"the more common. {_explained(basis, telling)}; the dashed line is the recorded segment farthest from it "
            "among those that it stands for.",
            x="along the road [m]",
            y="to the left [m]",
            wide=True,
            height=460,
            showlegend=False,
        ),
        _over_time("basis-lon", learned, times, curves[..., 0], "along the road"),
        _over_time("basis-lat", learned, times, curves[..., 1], "to the left"),
        _shares(learned),
    ]


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
        f"for also stays within the faint ellipses of ε = {basis.radius:g}"
    )


def _over_time(name: str, learned: Learned, times: np.ndarray, values: np.ndarray, direction: str) -> Plot:
    """One component of all base trajectories, with their numbers beside the ends."""
    lines = [_line(np.stack([times, each], -1), base, learned) for base, each in enumerate(values)]
    shown, ends = labelled(learned.base_share), values[:, -1].copy()
    ends[shown] = spread(ends[shown], _LABELS_APART * np.ptp(values))
    labels = _labels(learned, np.stack(np.broadcast_arrays(times[-1], ends), -1))
    return plot(
        name, [*lines, labels], f"Deviation {direction} over time.", x="time [s]", y=f"{direction} [m]",
        showlegend=False, xaxis_range=[0, 1.07 * times[-1]],
    )  # fmt: skip


def _labels(learned: Learned, places: np.ndarray) -> go.Scatter:
    """The numbers of the base trajectories, beside where they end."""
    shown = labelled(learned.base_share)
    lon, lat = places[shown].T.round(3)
    return go.Scatter(
        x=lon, y=lat, mode="text", text=[f" {base} " for base in shown],
        textposition=["middle left" if end < 0 else "middle right" for end in lon],
        textfont={"size": 11, "color": [_colour(int(base)) for base in shown]},
        hoverinfo="skip", name="numbers", cliponaxis=False,
    )  # fmt: skip


def _line(points: np.ndarray, base: int, learned: Learned) -> go.Scatter:
    share = float(learned.base_share[base])
    width = _THINNEST + (_THICKEST - _THINNEST) * np.sqrt(share / learned.base_share.max())
    return go.Scatter(
        x=points[:, 0].round(3),
        y=points[:, 1].round(3),
        mode="lines",
        line={"width": round(float(width), 2), "color": _colour(base)},
        name=f"base {base}",
        hovertemplate=f"<b>base {base}</b><br>{percent(share)} of the training segments<extra></extra>",
    )


def _tube(basis: Basis, base: int) -> list[go.Scatter]:
    """The tube around every sample of one base trajectory, and the ellipses if it is cut from them."""
    circle = np.stack([np.cos(_CIRCLE), np.sin(_CIRCLE)], axis=-1)
    ellipses = _around(basis, base, basis.tolerance(basis.radius, basis.times), circle)
    filled = {"fill": "toself", "fillcolor": "rgba(86,180,233,0.12)", "line": {"width": 1, "color": style.SKY}}
    if basis.reach is None:
        return [ellipses.update(filled)]
    faint = {"line": {"width": 0.8, "color": style.SKY, "dash": "dot"}, "opacity": 0.6}
    return [ellipses.update(faint), _around(basis, base, tube_of(basis, basis.times), _SQUARE).update(filled)]


def _around(basis: Basis, base: int, half: np.ndarray, shape: np.ndarray) -> go.Scatter:
    """A shape of given half extents around every sample, as one line with gaps."""
    rings = basis.points[base][:, None] + half[:, None] * shape
    gapped = np.concatenate([rings, np.full((len(rings), 1, 2), np.nan)], axis=1).reshape(-1, 2).round(3)
    return go.Scatter(x=gapped[:, 0], y=gapped[:, 1], mode="lines", hoverinfo="skip", name="tube")


def _example(learned: Learned, base: int) -> go.Scatter:
    points = learned.examples[base].round(3)
    return go.Scatter(
        x=points[:, 0], y=points[:, 1], mode="lines", line={"width": 2.5, "dash": "dash", "color": style.VERMILION},
        hovertemplate=f"a recorded segment that base {base} stands for<extra></extra>", name="recorded",
    )  # fmt: skip


def _shares(learned: Learned) -> Plot:
    order = np.argsort(-learned.base_share)
    bars = go.Bar(
        x=[str(base) for base in order],
        y=(100 * learned.base_share[order]).round(3),
        marker={"color": [_colour(int(base)) for base in order]},
        hovertemplate="<b>base %{x}</b><br>%{y:.2f} %<extra></extra>",
    )
    return plot(
        "shares", [bars], "Share of the training segments that each base trajectory stands for.",
        x="base trajectory", y="training segments [%]", wide=True, height=300, xaxis_type="category", bargap=0.25,
    )  # fmt: skip


def _colour(base: int) -> str:
    return style.CYCLE[base % len(style.CYCLE)]
