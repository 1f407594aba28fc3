"""The basis on the page: every base trajectory, with its share of the data under the pointer."""

import numpy as np
import plotly.graph_objects as go

from coverdrive.prediction.basis import Basis
from coverdrive.prediction.learned import Learned
from coverdrive.report import style
from coverdrive.report.basis_figure import most_telling
from coverdrive.report.page.plots import Plot, plot

_CURVE = 31
"""points of a drawn trajectory"""
_THINNEST, _THICKEST = 1.2, 5.0
"""[pixel]"""
_CIRCLE = np.linspace(0, 2 * np.pi, 61)


def basis_plots(basis: Basis, learned: Learned) -> list[Plot]:
    """All base trajectories from above, and over time."""
    times = np.linspace(0, basis.horizon, _CURVE)
    curves = basis.rollout(times)[0]
    telling = most_telling(basis, learned.base_share)
    plane = [_line(curves[base], base, learned) for base in range(len(basis))]
    along = [_line(np.stack([times, curve[:, 0]], -1), base, learned) for base, curve in enumerate(curves)]
    across = [_line(np.stack([times, curve[:, 1]], -1), base, learned) for base, curve in enumerate(curves)]
    tolerance = f"{basis.aspect * basis.epsilon:g} m × {basis.epsilon:g} m at the start, growing to " + (
        "{:.3g} m × {:.3g} m".format(*basis.tolerance(basis.epsilon, np.array([basis.horizon]))[0])
    )
    return [
        plot(
            "basis",
            [_ellipses(basis, telling), *plane, _example(learned, telling)],
            f"{len(basis)} base trajectories of {basis.horizon:g} s as deviations from constant velocity, the thicker "
            f"the more common. The ellipses around base {telling} are its tolerance (half axes {tolerance}); dashed: "
            "the recorded segment farthest from it among those that it stands for.",
            x="along the road [m]",
            y="to the left [m]",
            wide=True,
            height=460,
            showlegend=False,
        ),
        plot("basis-lon", along, "Deviation along the road.", x="time [s]", y="along the road [m]", showlegend=False),
        plot("basis-lat", across, "Deviation across the road.", x="time [s]", y="to the left [m]", showlegend=False),
        _shares(learned),
    ]


def _line(points: np.ndarray, base: int, learned: Learned) -> go.Scatter:
    share = float(learned.base_share[base])
    width = _THINNEST + (_THICKEST - _THINNEST) * np.sqrt(share / learned.base_share.max())
    return go.Scatter(
        x=points[:, 0].round(3),
        y=points[:, 1].round(3),
        mode="lines",
        line={"width": round(float(width), 2), "color": _colour(base)},
        name=f"base {base}",
        hovertemplate=f"<b>base {base}</b><br>{share:.2%} of the training segments<extra></extra>",
    )


def _ellipses(basis: Basis, base: int) -> go.Scatter:
    """The tolerance around every sample of one base trajectory, as one filled line with gaps."""
    reach = basis.tolerance(basis.epsilon, basis.step * np.arange(basis.points.shape[1]))
    circle = np.stack([np.cos(_CIRCLE), np.sin(_CIRCLE)], axis=-1)
    rings = basis.points[base][:, None] + reach[:, None] * circle
    gapped = np.concatenate([rings, np.full((len(rings), 1, 2), np.nan)], axis=1).reshape(-1, 2).round(3)
    return go.Scatter(
        x=gapped[:, 0], y=gapped[:, 1], mode="lines", fill="toself", fillcolor="rgba(86,180,233,0.12)",
        line={"width": 1, "color": style.SKY}, hoverinfo="skip", name="tolerance",
    )  # fmt: skip


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
