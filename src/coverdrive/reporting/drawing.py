"""A figure drawn with Matplotlib, and as files."""

import io
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure as Drawn
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import NullLocator

from coverdrive.files import write_atomically
from coverdrive.reporting import style
from coverdrive.reporting.figure import Band, Bars, Figure, Line, Mark, Panel, Points, Rule, Scale, Shapes, Texts

_DASHED = (0, (4, 2))
_FILLING = 0.16
"""opacity of what is inside a shape"""


def draw(figure: Figure) -> Drawn:
    """Draw a figure."""
    with style.style():
        drawn = style.new_figure(figure.width, figure.height)
        rows = drawn.subfigures(len(figure.rows), 1, height_ratios=figure.heights or None, squeeze=False)[:, 0]
        for place, row in zip(rows, figure.rows, strict=True):
            for axes, panel in zip(place.subplots(1, len(row), squeeze=False)[0], row, strict=True):
                _draw_panel(axes, panel)
        if figure.named:
            _draw_legend(rows[0], figure)
    return drawn


def _draw_panel(axes: Axes, panel: Panel) -> None:
    x, y = panel.scales
    axes.set(xlabel=x.label, ylabel=y.label, xscale=_kind(x), yscale=_kind(y))
    for order, mark in enumerate(panel.marks):
        _DRAW[type(mark)](axes, mark, 2 + order)
    axes.set(xlim=(x.low, x.high), ylim=(y.low, y.high))
    for axis, scale in ((axes.xaxis, x), (axes.yaxis, y)):
        axis.set_ticks([tick for tick, _ in scale.ticks], labels=[text for _, text in scale.ticks])
        axis.set_minor_locator(NullLocator())
    axes.set_title(panel.title, loc="left")
    axes.grid(True)


def _kind(scale: Scale) -> str:
    return "log" if scale.log else "linear"


def _draw_legend(place: Any, figure: Figure) -> None:
    handles: list[Artist] = [_handle(mark) for mark in figure.named.values()]
    place.legend(handles, list(figure.named), loc="outside upper left", ncols=figure.legend_columns)


def _handle(mark: Mark) -> Artist:
    """What stands for a mark in the legend."""
    dash: Any = _DASHED if getattr(mark, "dashed", False) else "-"
    if isinstance(mark, Points):
        return Line2D([], [], color=mark.colour, marker=mark.marker, markersize=mark.size, linestyle="none",
                      markerfacecolor=style.PAPER if mark.hollow else mark.colour)  # fmt: skip
    if isinstance(mark, Line | Rule):
        return Line2D([], [], color=mark.colour, linewidth=max(mark.width, 1.0), linestyle=dash)
    filled = mark.filled if isinstance(mark, Shapes) else True
    return Patch(facecolor=to_rgba(mark.colour, _FILLING if isinstance(mark, Shapes) else mark.opacity)
                 if filled else "none", edgecolor=mark.colour, linestyle=dash, linewidth=0.8)  # fmt: skip


def _draw_line(axes: Axes, mark: Line, order: int) -> None:
    axes.plot(
        np.asarray(mark.x), np.asarray(mark.y), color=mark.colour, linewidth=mark.width, alpha=mark.opacity,
        linestyle=_DASHED if mark.dashed else "-", drawstyle="steps-post" if mark.step else "default", zorder=order,
    )  # fmt: skip


def _draw_points(axes: Axes, mark: Points, order: int) -> None:
    x, y = np.asarray(mark.x, dtype=float), np.asarray(mark.y, dtype=float)
    if mark.low is not None and mark.high is not None:
        across = axes.hlines if mark.along == "x" else axes.vlines
        at = y if mark.along == "x" else x
        across(at, np.asarray(mark.low), np.asarray(mark.high), color=mark.colour, linewidth=0.9, zorder=order)
    axes.plot(
        x, y, color=mark.colour, marker=mark.marker, markersize=mark.size, alpha=mark.opacity, linestyle="none",
        markerfacecolor=style.PAPER if mark.hollow else mark.colour, zorder=order, clip_on=False,
        markeredgewidth=1.6 if mark.marker == "|" else 0.9,
    )  # fmt: skip


def _draw_bars(axes: Axes, mark: Bars, order: int) -> None:
    axes.bar(
        np.asarray(mark.x), np.asarray(mark.height), np.asarray(mark.width), bottom=mark.base, color=mark.colour,
        alpha=mark.opacity, zorder=order,
    )  # fmt: skip


def _draw_band(axes: Axes, mark: Band, order: int) -> None:
    axes.fill_between(
        np.asarray(mark.x), np.asarray(mark.low), np.asarray(mark.high), color=mark.colour, alpha=mark.opacity,
        linewidth=0, zorder=order,
    )  # fmt: skip


def _draw_shapes(axes: Axes, mark: Shapes, order: int) -> None:
    filling = to_rgba(mark.colour, _FILLING) if mark.filled else "none"
    axes.add_collection(
        PolyCollection(
            list(mark.outlines), facecolor=filling, edgecolor=to_rgba(mark.colour, mark.opacity),
            linewidth=mark.width, linestyle=_DASHED if mark.dashed else "-", zorder=order,
        ),
        autolim=False,
    )  # fmt: skip


def _draw_texts(axes: Axes, mark: Texts, order: int) -> None:
    anchors = [mark.anchor] * len(mark.text) if isinstance(mark.anchor, str) else mark.anchor
    sides = {"start": ("left", 3), "middle": ("center", 0), "end": ("right", -3)}
    for x, y, text, anchor in zip(np.asarray(mark.x), np.asarray(mark.y), mark.text, anchors, strict=True):
        align, beside = sides[anchor]
        axes.annotate(
            text, (x, y), xytext=(beside, mark.above), textcoords="offset points", ha=align,
            va="bottom" if mark.above else "center", fontsize=6.5, color=mark.colour, zorder=order + 20,
            annotation_clip=False, path_effects=[withStroke(linewidth=1.5, foreground=style.PAPER)],
        )  # fmt: skip


def _draw_rule(axes: Axes, mark: Rule, order: int) -> None:
    across = axes.axvline if mark.axis == "x" else axes.axhline
    across(mark.at, color=mark.colour, linewidth=mark.width, linestyle=_DASHED if mark.dashed else "-", zorder=order)


_DRAW: Mapping[type[Mark], Callable[[Axes, Any, int], None]] = MappingProxyType(
    {
        Line: _draw_line,
        Points: _draw_points,
        Bars: _draw_bars,
        Band: _draw_band,
        Shapes: _draw_shapes,
        Texts: _draw_texts,
        Rule: _draw_rule,
    }
)


def save(figure: Figure | Drawn, path: Path) -> tuple[Path, Path]:
    """Write a figure as PNG (200 dpi) and as PDF with embedded fonts; the same figure gives the same bytes.

    Args:
        figure: made by a function of this package, or any of Matplotlib.
        path: of both files, without suffix; the folder is made if need be.

    Returns:
        The PNG and the PDF file.
    """
    drawn = draw(figure) if isinstance(figure, Figure) else figure
    png, pdf = (path.with_name(path.name + suffix) for suffix in (".png", ".pdf"))
    with style.style():
        write_atomically(png, lambda file: drawn.savefig(file, dpi=style.DPI))
        write_atomically(pdf, lambda file: drawn.savefig(file, dpi=style.DPI, metadata={"CreationDate": None}))
    return png, pdf


def inline_svg(figure: Drawn) -> str:
    """A drawing as an SVG element to stand in a page; black, white, road and markings follow the page's colours."""
    with style.style(), io.StringIO() as file:
        nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        figure.savefig(file, format="svg", transparent=True, metadata=nothing)
        text = file.getvalue()
    names = ((style.BLACK, "ink"), (style.PAPER, "paper"), (style.ROAD, "road"), (style.MARKING, "marking"))
    for colour, name in names:
        text = text.replace(f": {colour.lower()}", f": var(--{name})")
    return text[text.index("<svg") :]
