"""A figure drawn with Matplotlib, and as files."""

import io
from pathlib import Path
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
from coverdrive.reporting.plotting import style
from coverdrive.reporting.plotting.figure import Band, Bars, Figure, Line, Mark, Panel, Points, Rule, Shapes, Texts

_FILLING = 0.16
"""opacity of what is inside a shape"""

_ROOM = 0.98
"""of the width of a figure for its legend"""


def draw(figure: Figure) -> Drawn:
    """Draw a figure."""
    with style.style():
        drawn = style.new_figure(figure.width, figure.height)
        rows = drawn.subfigures(len(figure.rows), 1, height_ratios=figure.heights or None, squeeze=False)[:, 0]
        for place, row in zip(rows, figure.rows, strict=True):
            for axes, panel in zip(place.subplots(1, len(row), squeeze=False)[0], row, strict=True):
                _draw_panel(axes, panel)
        if figure.named:
            handles = [_handle(mark) for mark in figure.named.values()]
            for columns in range(figure.legend_columns, 0, -1):
                legend = rows[0].legend(handles, list(figure.named), loc="outside upper left", ncols=columns)
                if legend.get_window_extent().width < _ROOM * drawn.bbox.width or columns == 1:
                    break
                legend.remove()
    return drawn


def _draw_panel(axes: Axes, panel: Panel) -> None:
    x, y = panel.scales
    kinds = ["log" if scale.log else "linear" for scale in (x, y)]
    axes.set(xlabel=x.label, ylabel=y.label, xscale=kinds[0], yscale=kinds[1])
    for order, mark in enumerate(panel.marks, start=2):
        _draw_mark(axes, mark, {"color": mark.colour, "zorder": order})
    axes.set(xlim=(x.low, x.high), ylim=(y.low, y.high))
    for axis, scale in ((axes.xaxis, x), (axes.yaxis, y)):
        axis.set_ticks([tick for tick, _ in scale.ticks], labels=[text for _, text in scale.ticks])
        axis.set_minor_locator(NullLocator())
    axes.set_title(panel.title, loc="left")
    axes.grid(True)


def _dash(mark: Mark) -> Any:
    return (0, (4, 2)) if getattr(mark, "dashed", False) else "-"


def _handle(mark: Mark) -> Artist:
    """What stands for a mark in the legend."""
    if isinstance(mark, Points):
        return Line2D([], [], color=mark.colour, marker=mark.marker, markersize=mark.size, linestyle="none",
                      markerfacecolor=style.PAPER if mark.hollow else mark.colour)  # fmt: skip
    if isinstance(mark, Line | Rule):
        return Line2D([], [], color=mark.colour, linewidth=max(mark.width, 1.0), linestyle=_dash(mark))
    face = to_rgba(mark.colour, mark.opacity) if not isinstance(mark, Shapes) else _filling(mark)
    return Patch(facecolor=face, edgecolor=mark.colour, linestyle=_dash(mark), linewidth=0.8)


def _filling(mark: Shapes) -> Any:
    return to_rgba(mark.colour, _FILLING) if mark.filled else "none"


def _draw_mark(axes: Axes, mark: Mark, look: dict[str, Any]) -> None:
    match mark:
        case Line():
            axes.plot(np.asarray(mark.x), np.asarray(mark.y), linewidth=mark.width, alpha=mark.opacity,
                      linestyle=_dash(mark), drawstyle="steps-post" if mark.step else "default", **look)  # fmt: skip
        case Points() if not np.size(mark.x):
            pass  # drawn, it would be in the corner of the figure, and the panel laid out to reach it
        case Points():
            x, y = np.asarray(mark.x, dtype=float), np.asarray(mark.y, dtype=float)
            if mark.low is not None and mark.high is not None:
                across, at = (axes.hlines, y) if mark.along == "x" else (axes.vlines, x)
                across(at, np.asarray(mark.low), np.asarray(mark.high), linewidth=0.9, **look)
            axes.plot(x, y, marker=mark.marker, markersize=mark.size, alpha=mark.opacity, linestyle="none",
                      markerfacecolor=style.PAPER if mark.hollow else mark.colour, clip_on=False,
                      markeredgewidth=1.6 if mark.marker == "|" else 0.9, **look)  # fmt: skip
        case Bars():
            axes.bar(np.asarray(mark.x), np.asarray(mark.height), np.asarray(mark.width), bottom=mark.base,
                     alpha=mark.opacity, **look)  # fmt: skip
        case Band():
            axes.fill_between(np.asarray(mark.x), np.asarray(mark.low), np.asarray(mark.high), alpha=mark.opacity,
                              linewidth=0, **look)  # fmt: skip
        case Shapes():
            edge = to_rgba(mark.colour, mark.opacity)
            shapes = PolyCollection(list(mark.outlines), facecolor=_filling(mark), edgecolor=edge, linewidth=mark.width,
                                    linestyle=_dash(mark), zorder=look["zorder"])  # fmt: skip
            axes.add_collection(shapes, autolim=False)
        case Texts():
            anchors = [mark.anchor] * len(mark.text) if isinstance(mark.anchor, str) else mark.anchor
            sides = {"start": ("left", 3), "middle": ("center", 0), "end": ("right", -3)}
            look |= {"zorder": look["zorder"] + 20, "path_effects": [withStroke(linewidth=1.5, foreground=style.PAPER)]}
            for x, y, text, anchor in zip(np.asarray(mark.x), np.asarray(mark.y), mark.text, anchors, strict=True):
                align, beside = sides[anchor]
                axes.annotate(text, (x, y), xytext=(beside, mark.above), textcoords="offset points", ha=align,
                              va="bottom" if mark.above else "center", fontsize=6.5, annotation_clip=False,
                              **look)  # fmt: skip
        case Rule():
            across = axes.axvline if mark.axis == "x" else axes.axhline
            across(mark.at, linewidth=mark.width, linestyle=_dash(mark), **look)
        case _:
            raise TypeError(f"a mark of a figure is a Line, Points, Bars, …, got {type(mark).__name__}")


def save(figure: Figure | Drawn, path: Path) -> tuple[Path, Path]:
    """Write a figure, of this package or any of Matplotlib, as PNG (200 dpi) and as PDF with embedded fonts.

    ``path`` has no suffix; its folder is made if need be. The same figure gives the same bytes.
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
