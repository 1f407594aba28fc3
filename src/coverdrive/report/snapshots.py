"""Moments of one drive, one above the other (paper, Fig. 3)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from coverdrive.errors import DataError
from coverdrive.report import style
from coverdrive.report.road_drawing import RoadDrawing, Window
from coverdrive.simulation.initial import OWN
from coverdrive.simulation.outcome import Kind
from coverdrive.simulation.trace import Trace

NEAR = 20.0
"""[m] along the road: vehicles nearer than this surround the own car"""


class Moment(NamedTuple):
    """A moment worth looking at."""

    step: int
    remark: str


def snapshots(trace: Trace, steps: Sequence[int] | None = None, window: Window | None = None) -> Figure:
    """Draw moments of a trace: vehicles, predicted sets and the own plan.

    Args:
        trace: one episode.
        steps: indices of the steps at whose start the scene is shown; if left out, four interesting ones.
        window: the stretch of road around the own car that is shown.

    Raises:
        DataError: no step, or one that the trace does not have.
    """
    if steps is not None and not (steps and all(0 <= step < len(trace) for step in steps)):
        raise DataError(f"snapshots need steps from 0 to {len(trace) - 1}, got {list(steps)}; choose among these")
    moments = interesting_moments(trace) if steps is None else [Moment(step, "") for step in steps]
    window = window or Window()
    with style.style():
        figure = style.new_figure(12, 1.0 + 1.75 * len(moments))
        panels = figure.subplots(len(moments), 1, sharex=True, squeeze=False)[:, 0]
        for letter, (axes, moment) in enumerate(zip(panels, moments, strict=True)):
            _draw_moment(axes, trace, moment, window, chr(ord("a") + letter))
        panels[-1].set_xlabel("distance ahead of the own car [m]")
        add_legend(figure, trace, panels)
    return figure


def add_legend(figure: Figure, trace: Trace, panels: Sequence[Axes]) -> None:
    """Explain the drawing, above the panels."""
    handles = [
        Patch(color=style.OWN, label="own car"),
        Line2D([], [], color=style.OWN, marker="o", markersize=3, label="its plan, body at every second"),
        Patch(color=style.OTHER, label="other vehicles (numbers: speed in m/s)"),
    ]
    figure.legend(handles=handles, loc="outside upper left", ncols=len(handles))
    horizon = trace.paths[0].dt * (trace.paths[0].points.shape[1] - 1)
    scale = ScalarMappable(Normalize(0, horizon), style.SETS)
    bar = figure.colorbar(scale, ax=list(panels), aspect=30, pad=0.01, fraction=0.02)
    bar.set_label("predicted set: time ahead [s]")
    bar.ax.invert_yaxis()


def interesting_moments(trace: Trace, count: int = 4) -> list[Moment]:
    """The moments at which most happens, spread over the drive.

    The collision comes first, then lane changes and overtaking, then dense traffic.

    Args:
        trace: one episode.
        count: how many, at most.

    Returns:
        Moments in the order of time.
    """
    near, changes, passes = _near(trace), _changes(trace), _passes(trace)
    interest = near + 10.0 * changes + 5.0 * passes
    collided = trace.outcome.kind is not Kind.FINISHED
    interest[-1] += 1000.0 * collided
    apart = max(1, len(trace) // (2 * count))
    chosen: list[int] = []
    while len(chosen) < count and np.isfinite(interest).any():
        step = int(np.argmax(interest))
        chosen.append(step)
        interest[max(0, step - apart + 1) : step + apart] = -np.inf
    remarks = {
        "changes lane": changes,
        "overtakes": passes,
        f"just before a {trace.outcome.kind.value} collision": collided & (np.arange(len(trace)) == len(trace) - 1),
    }
    return [
        Moment(
            step,
            ", ".join(
                [remark for remark, applies in remarks.items() if applies[step]]
                or [f"{near[step]} vehicles within {NEAR:.0f} m"]
            ),
        )
        for step in sorted(chosen)
    ]


def _near(trace: Trace) -> np.ndarray:
    """Number of vehicles around the own car at the start of every step."""
    scene = trace.scene
    distance = np.abs(np.asarray(scene.lon) - np.asarray(scene.lon)[:, [OWN]])
    return ((distance < NEAR) & scene.valid)[:-1].sum(1) - 1


def _changes(trace: Trace) -> np.ndarray:
    """Whether the own car crosses into another lane in each step."""
    return np.diff(np.asarray(trace.road.lane_of(np.asarray(trace.scene.lat[:, OWN])))) != 0


def _passes(trace: Trace) -> np.ndarray:
    """Whether the own car passes another vehicle in each step, centre by centre."""
    ahead = np.asarray(trace.scene.lon) > np.asarray(trace.scene.lon)[:, [OWN]]
    return (ahead[:-1] & ~ahead[1:] & trace.scene.valid[1:]).any(1)


def _draw_moment(axes: Axes, trace: Trace, moment: Moment, window: Window, letter: str) -> None:
    scene = trace.scene_at(moment.step)
    drawing = RoadDrawing.on(axes, trace.road, scene.vehicles, window)
    drawing.show(scene, trace.paths[moment.step], trace.plans[moment.step])
    title = f"({letter})  {trace.time[moment.step]:.1f} s,  own car {scene.speed[OWN]:.1f} m/s"
    axes.set_title(title + (f":  {moment.remark}" if moment.remark else ""), loc="left")
