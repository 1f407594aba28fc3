"""Moments of one drive, one above the other (paper, Fig. 3)."""

from collections.abc import Sequence
from textwrap import fill

import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from coverdrive.errors import DataError
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.reporting.drives.reasons import reason_of
from coverdrive.reporting.drives.road_drawing import RoadDrawing, height_of
from coverdrive.reporting.drives.worst_moment import worst_moment
from coverdrive.reporting.plotting import style
from coverdrive.road_markings import ahead_label
from coverdrive.simulation.drives.outcome import Kind
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.misses import Windows, find_windows, left_recently
from coverdrive.simulation.roads.initial import EGO

NEAR = 20.0
"""[m] along the road: vehicles nearer than this surround the ego"""

_ABOVE, _ABOUT, _BESIDE = 0.75, 0.32, 0.55
"""[inch] legend and label of the axis, title of a panel, labels of the lanes"""
LINE = 0.13
"""[inch] one more line of a title or the legend"""
_LETTERS = 100
"""that find room in a line over the road"""


def snapshots(
    trace: Trace,
    steps: Sequence[int] | None = None,
    problem: ProblemSettings | None = None,
) -> Figure:
    """Draw vehicles, predicted sets and the ego's plan at the starts of some steps, by default four interesting ones.

    Active constraints of the planner's ``problem`` are marked, if it is known. DataError if there is no step, or one
    that the trace does not have.
    """
    if steps is not None and not (steps and all(0 <= step < len(trace) for step in steps)):
        raise DataError(f"snapshots need steps from 0 to {len(trace) - 1}, got {list(steps)}; choose among these")
    windows = find_windows(trace)
    moments = interesting_moments(trace, windows) if steps is None else [(step, "") for step in steps]
    left = left_recently(trace, windows)
    with style.style():
        reasons = [reason_of(trace, step) for step, _ in moments]
        said = [
            f"\n{in_lines(f'{trace.plans[step].status.value}: {reason.text}')}" * bool(reason.text)
            for (step, _), reason in zip(moments, reasons, strict=True)
        ]
        height = _ABOUT + height_of(trace.road, style.TWO_COLUMNS - _BESIDE)
        lines = sum(text.count("\n") for text in said)
        figure = style.new_figure(style.TWO_COLUMNS, _ABOVE + height * len(moments) + LINE * (lines + bool(lines)))
        panels = figure.subplots(len(moments), 1, sharex=True, squeeze=False)[:, 0]
        for letter, (axes, (step, remark), why) in enumerate(zip(panels, moments, said, strict=True), start=ord("a")):
            drawing = RoadDrawing(axes, trace.road, trace.scene.vehicles)
            scene = drawing.show_moment(trace, step, problem, left)
            title = f"({chr(letter)})  {trace.time[step]:.1f} s, ego {scene.speed[EGO]:.1f} m/s"
            axes.set_title(title + f":  {remark}" * bool(remark) + why, loc="left")
        panels[-1].set_xlabel(ahead_label(trace.road))
        met = any(reason.path >= 0 for reason in reasons)
        marked = bool(left[[step for step, _ in moments]].any())
        add_legend(figure, trace.horizon, problem is not None, marked, met)
    return figure


def in_lines(text: str) -> str:
    """Words over a drawing of the road, in as many lines as they need."""
    return fill(text, _LETTERS)


def add_legend(figure: Figure, horizon: float, active: bool, left: bool, met: bool) -> None:
    """Explain a drawing of the road above all panels, with what of the last three is marked."""
    shades = tuple(Patch(color=style.SETS(age)) for age in (0.0, 0.25, 0.5, 0.75, 1.0))
    dark = tuple(Patch(facecolor="none", edgecolor=style.TIMES(age)) for age in (0.33, 0.67, 1.0))
    explained: dict[str, Patch | Line2D | tuple[Patch, ...]] = {
        "ego": Patch(color=style.EGO),
        "its plan, and dashed its fail-safe branch": Line2D([], [], color=style.EGO, linestyle="--"),
        "that every second, in the hue of the sets then": dark,
        "other vehicles, speed in m/s": Patch(color=style.OTHER),
        f"predicted set, now … {horizon:g} s ahead": shades,
    }
    if active:
        explained["active constraints, in that hue"] = dark
    if met:
        explained["first contact of a plan that is not clear"] = Patch(
            facecolor=to_rgba(style.BAD, 0.25), edgecolor=style.BAD, linestyle="--"
        )
    if left:
        explained["left its predicted set"] = Patch(facecolor=style.OTHER, edgecolor=style.BLACK, linewidth=2)
    figure.legend(
        list(explained.values()),  # pyright: ignore[reportArgumentType]  (Matplotlib takes tuples too)
        list(explained),
        loc="outside upper left",
        ncols=3,
        handler_map={tuple: HandlerTuple(ndivide=None, pad=0)},
    )


def interesting_moments(trace: Trace, windows: Windows, count: int = 4) -> list[tuple[int, str]]:
    """The step at which most happens in each of ``count`` equal parts of the drive and what, in the order of time.

    The worst moment of the drive, of which ``windows`` are all, comes first, then lane changes, then overtaking, then
    dense traffic. Two moments are at least half a part from each other.
    """
    lon, valid = np.asarray(trace.scene.lon), trace.scene.valid
    ahead, lane = lon - lon[:, [EGO]], trace.road.lane_at(lon[:, EGO], trace.scene.lat[:, EGO])
    near = ((np.abs(ahead) < NEAR) & valid)[:-1].sum(1) - 1
    changes = np.asarray(lane[1:] != lane[:-1])
    passes = np.asarray(((ahead[:-1] > 0) & (ahead[1:] <= 0) & valid[1:]).any(1))
    worst, kind, steps = worst_moment(trace, windows), trace.outcome.kind, np.arange(len(trace))
    decisive = min(worst.moment, len(trace) - 1) if worst.slot >= 0 else -np.inf
    when = "just" if worst.moment == len(trace) else f"{worst.name}, {trace.time[-1] - trace.time[worst.moment]:.1f} s"
    named = worst.name if kind is Kind.FINISHED else f"{when} before a {kind.value} collision"
    interest = near + 100 * passes + 1000 * changes + 10_000 * (steps == decisive)
    parts = [part for part in np.array_split(steps, count) if len(part)]
    apart, chosen = len(parts[0]) // 2, list[int]()
    for part in parts:
        free = part[(part == decisive) | (np.abs(part - decisive) >= apart)]
        free = free[free >= chosen[-1] + apart] if chosen else free
        chosen.append(int(free[np.argmax(interest[free])]))
    remarks = {"changes lane": changes, "overtakes": passes, named: steps == decisive}
    said = {step: ", ".join(remark for remark, applies in remarks.items() if applies[step]) for step in chosen}
    return [(step, said[step] or f"vehicles within {NEAR:.0f} m: {near[step]}") for step in chosen]
