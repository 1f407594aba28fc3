"""What a figure of a result shows, said once: pages and files show the same.

A page is drawn by `page/templates/figure.js`, a file by `coverdrive.reporting.plotting.drawing`. A figure has rows of
panels, a panel has two axes and marks. Limits and ticks are decided here, once for both. Colours are those of
`coverdrive.reporting.plotting.style`; widths and sizes are in points, places in the units of the axes. Marks of one
name are one entry of the legend, and on a page they are shown and hidden together.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from coverdrive.reporting.plotting.style import BLUE, GREY, TWO_COLUMNS

_MARGIN = 0.05
"""of an axis beyond what is shown, where no limit is given"""

_DIGITS = 5
"""significant ones of a number in a page"""


@dataclass(frozen=True, kw_only=True)
class Mark:
    """What all marks have."""

    colour: str = BLUE
    name: str = ""
    """in the legend; none if empty"""
    opacity: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Line(Mark):
    """A line through points; NaN interrupts it."""

    x: ArrayLike
    y: ArrayLike
    width: float = 1.2
    dashed: bool = False
    step: bool = False
    """whether y stays until the next x"""
    hover: str = ""


@dataclass(frozen=True, kw_only=True)
class Points(Mark):
    """Markers of Matplotlib's names, with intervals from low to high where there are some."""

    x: ArrayLike
    y: ArrayLike
    marker: str = "o"
    size: float = 5.0
    hollow: bool = False
    low: ArrayLike | None = None
    high: ArrayLike | None = None
    along: str = "y"
    """axis of the intervals"""
    hover: Sequence[str] = ()


def crossed(
    x: float,
    y: float,
    along_x: tuple[float | None, float | None],
    along_y: tuple[float | None, float | None],
    hover: str,
    **look: Any,
) -> list[Mark]:
    """One mark, with its intervals along both axes, if they are known."""
    (left, right), (low, high) = along_x, along_y
    across: dict[str, Any] = {} if left is None or right is None else {"low": [left], "high": [right], "along": "x"}
    marks: list[Mark] = [Points(x=[x], y=[y], hover=[hover], **across, **look)]
    if low is not None and high is not None:
        marks.append(Points(x=[x], y=[y], low=[low], high=[high], **look))
    return marks


@dataclass(frozen=True, kw_only=True)
class Bars(Mark):
    """Rectangles around x that stand on a base."""

    x: ArrayLike
    height: ArrayLike
    width: ArrayLike = 0.8
    base: float = 0.0
    hover: Sequence[str] = ()


@dataclass(frozen=True, kw_only=True)
class Band(Mark):
    """What lies between two curves."""

    x: ArrayLike
    low: ArrayLike
    high: ArrayLike


@dataclass(frozen=True, kw_only=True)
class Shapes(Mark):
    """Closed outlines, each of n points, filled or not."""

    outlines: Sequence[np.ndarray]
    filled: bool = True
    dashed: bool = False
    width: float = 0.8


@dataclass(frozen=True, kw_only=True)
class Texts(Mark):
    """Words beside points; they do not widen the axes."""

    x: ArrayLike
    y: ArrayLike
    text: Sequence[str]
    anchor: str | Sequence[str] = "start"
    """start, middle or end of the words at the point"""
    above: float = 0.0
    """[point] above it"""


@dataclass(frozen=True, kw_only=True)
class Rule(Mark):
    """A straight line across the panel at one value of an axis."""

    at: float
    axis: str = "x"
    width: float = 1.2
    dashed: bool = True
    colour: str = GREY


@dataclass(frozen=True)
class Axis:
    """What an axis measures; what is left out is chosen from what is shown."""

    label: str
    """with its unit"""
    low: float | None = None
    high: float | None = None
    log: bool = False
    ticks: Mapping[float, str] | None = None

    def scaled(self, values: np.ndarray) -> "Scale":
        """Its limits and ticks for the values that have to be within it."""
        values = values[np.isfinite(values) & ((values > 0) | (not self.log))]
        low, high = (values.min(), values.max()) if len(values) else (1.0, 10.0)
        inner = np.log([low, high]) if self.log else np.array([low, high], dtype=float)
        margin = _MARGIN * (np.ptp(inner) or 1.0)
        wide = inner + np.array([-margin, margin])
        wide = np.exp(wide) if self.log else wide
        low = float(wide[0]) if self.low is None else self.low
        high = float(wide[1]) if self.high is None else self.high
        ticks = self.ticks or {
            tick: f"{tick:g}".replace("-", "−") for tick in (_log_ticks if self.log else _ticks)(low, high)
        }
        return Scale(self.label, low, high, self.log, tuple(ticks.items()))


class Scale(NamedTuple):
    """An axis as it is drawn."""

    label: str
    low: float
    high: float
    log: bool
    ticks: tuple[tuple[float, str], ...]


@dataclass(frozen=True)
class Panel:
    """One pair of axes."""

    marks: Sequence[Mark]
    x: Axis
    y: Axis
    title: str = ""

    @property
    def scales(self) -> tuple[Scale, Scale]:
        """Both axes as they are drawn."""
        reaches = [_reach(mark) for mark in self.marks]
        x, y = (np.concatenate([np.empty(0), *(np.ravel(each[axis]) for each in reaches)]) for axis in (0, 1))
        return self.x.scaled(x), self.y.scaled(y)


@dataclass(frozen=True)
class Figure:
    """Rows of panels with a legend above them, and the sentences that stand below it on a page."""

    rows: Sequence[Sequence[Panel]]
    height: float
    """[inch]"""
    caption: str = ""
    width: float = TWO_COLUMNS
    """[inch]"""
    heights: Sequence[float] = ()
    """of the rows, relative to each other; equal if left out"""
    legend_columns: int = 3
    """at most; fewer where names are long"""

    @property
    def panels(self) -> list[Panel]:
        """All of them, row by row."""
        return [panel for row in self.rows for panel in row]

    @property
    def named(self) -> dict[str, Mark]:
        """The first mark of every entry of the legend, in the order of the marks."""
        named: dict[str, Mark] = {}
        for mark in (mark for panel in self.panels for mark in panel.marks if mark.name):
            named.setdefault(mark.name, mark)
        return named


def _reach(mark: Mark) -> tuple[ArrayLike, ArrayLike]:
    """Values of x and of y that have to be within the axes."""
    match mark:
        case Points(x=x, y=y, low=low, high=high, along=along) if low is not None and high is not None:
            ends = np.concatenate([np.asarray(low), np.asarray(high)])
            return (np.append(x, ends), y) if along == "x" else (x, np.append(y, ends))
        case Line(x=x, y=y) | Points(x=x, y=y):
            return x, y
        case Bars(x=x, height=height, width=width, base=base):
            centre, half = np.asarray(x, dtype=float), np.asarray(width) / 2
            return np.append(centre - half, centre + half), np.append(base + np.asarray(height), base)
        case Band(x=x, low=low, high=high):
            return x, np.append(np.asarray(low), np.asarray(high))
        case Shapes(outlines=outlines):
            return tuple(np.concatenate([*outlines, np.empty((0, 2))]).T)
        case Rule(at=at, axis=axis):
            return ([at], []) if axis == "x" else ([], [at])
        case _:
            return [], []


def to_json(figure: Figure) -> dict[str, Any]:
    """A figure as JSON values; what has its default is left out."""
    share = figure.heights or [1.0] * len(figure.rows)
    rows = [
        {"height": part / sum(share) * figure.height, "panels": [_panel(panel) for panel in row]}
        for part, row in zip(share, figure.rows, strict=True)
    ]
    return {"rows": rows, "caption": figure.caption}


def _panel(panel: Panel) -> dict[str, Any]:
    x, y = (scale._asdict() for scale in panel.scales)
    return {"title": panel.title, "x": x, "y": y, "marks": [_mark(mark) for mark in panel.marks]}


def _mark(mark: Mark) -> dict[str, Any]:
    values = {field.name: (getattr(mark, field.name), field.default) for field in dataclasses.fields(mark)}
    shown = {name: _plain(value) for name, (value, default) in values.items() if value is not default}
    return {"type": type(mark).__name__, **shown}


def _plain(value: Any) -> Any:
    """Numbers rounded, what is not finite as null."""
    if isinstance(value, str | bool):
        return value
    if isinstance(value, int | float | np.number):
        return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None
    return [_plain(each) for each in value]


def _ticks(low: float, high: float) -> list[float]:
    """Round numbers, about six of them."""
    margin, found = 1e-9 * (high - low), MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    return [float(f"{tick:.10g}") for tick in found if low - margin <= tick <= high + margin]


def _log_ticks(low: float, high: float) -> list[float]:
    """Powers of ten, and twice and five times them if there are few; round numbers on less than a decade."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    within = [
        float(f"{factor * 10.0**power:.3g}")
        for power in range(first, last + 1)
        for factor in (1, 2, 5)
        if low <= factor * 10.0**power <= high
    ]
    powers = [tick for tick in within if math.log10(tick).is_integer()]
    return powers if len(powers) > 3 else within if len(within) > 2 else _ticks(low, high)
