"""The affordance as a sketch (paper, Fig. 2): what the 21 features measure, each with its number in `FEATURES`.

Not to scale: lanes are drawn wider and gaps shorter than they are.
"""

from dataclasses import dataclass
from enum import Enum

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyBboxPatch

from coverdrive.reporting import style
from coverdrive.reporting.figure import TWO_COLUMNS

_LANE = 5.4
"""height of a lane"""
_LENGTH, _WIDTH = 8.0, 2.6
"""of a vehicle"""
_LEFT, _RIGHT = -28.0, 37.0
"""ends of the road that is shown"""
_SPEED = 4.0
"""length of the arrow of a speed"""


class _Kind(Enum):
    """What a feature measures, and its colour."""

    ALONG = ("clearance along the road", style.BLUE)
    ACROSS = ("clearance across the road", style.GREEN)
    SPEED = ("speed, of others relative to the own", style.VERMILION)
    LENGTH = ("length", style.PURPLE)
    OFFSET = ("distance to the lane centre", style.ORANGE)


@dataclass(frozen=True)
class _Neighbour:
    """A vehicle beside the own one, and the numbers of its features."""

    lon: float
    """of its centre"""
    side: int
    """1: left, −1: right"""
    along: int
    speed: int
    across: int
    length: int
    name: str

    @property
    def lat(self) -> float:
        return self.side * _LANE

    @property
    def ahead(self) -> int:
        return 1 if self.lon > 0 else -1


_NEIGHBOURS = (
    _Neighbour(17.0, 1, along=5, speed=6, across=7, length=17, name="left front"),
    _Neighbour(-17.0, 1, along=8, speed=10, across=9, length=18, name="left rear"),
    _Neighbour(15.0, -1, along=11, speed=12, across=13, length=19, name="right front"),
    _Neighbour(-19.0, -1, along=14, speed=16, across=15, length=20, name="right rear"),
)
_FRONT = 25.0
_OWN_LAT = -0.8


def affordance_figure() -> Figure:
    """Draw the sketch."""
    with style.style():
        figure = style.new_figure(TWO_COLUMNS, 2.7)
        axes = figure.subplots()
        axes.set(xlim=(_LEFT, _RIGHT), ylim=(-1.5 * _LANE - 0.2, 1.5 * _LANE + 0.2), aspect="equal")
        axes.set_axis_off()
        _draw_road(axes)
        _draw_vehicle(axes, 0.0, _OWN_LAT, style.EGO, "ego")
        _draw_vehicle(axes, _FRONT, 0.0, style.GREY, "front")
        for neighbour in _NEIGHBOURS:
            _draw_vehicle(axes, neighbour.lon, neighbour.lat, style.GREY, neighbour.name)
            _draw_neighbour(axes, neighbour)
        _draw_own(axes)
        handles = [Line2D([], [], color=kind.value[1], linewidth=1.8, label=kind.value[0]) for kind in _Kind]
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def _draw_road(axes: Axes) -> None:
    axes.axhspan(-1.5 * _LANE, 1.5 * _LANE, facecolor=style.ROAD, zorder=0)
    for edge in (-1.5, 1.5):
        axes.axhline(edge * _LANE, color=style.MARKING, linewidth=1.2, zorder=1)
    for edge in (-0.5, 0.5):
        axes.axhline(edge * _LANE, color=style.MARKING, linewidth=1.0, linestyle=(0, (9, 9)), zorder=1)


def _draw_vehicle(axes: Axes, lon: float, lat: float, colour: str, name: str) -> None:
    corner = lon - _LENGTH / 2, lat - _WIDTH / 2
    shape = "round,pad=0,rounding_size=0.5"
    axes.add_patch(FancyBboxPatch(corner, _LENGTH, _WIDTH, boxstyle=shape, facecolor=colour, linewidth=0, zorder=3))
    axes.text(lon, lat, name, color="white", fontsize=6.5, ha="center", va="center_baseline", zorder=4)


def _draw_own(axes: Axes) -> None:
    """Features 1 to 4 and 21."""
    nose, tail = _LENGTH / 2, -_LENGTH / 2
    _speed(axes, nose, _OWN_LAT - 0.55, 1)
    _measure(axes, (nose, 0.75), (_FRONT - nose, 0.75), 3, _Kind.ALONG)
    _speed(axes, _FRONT + nose, 0.0, 4)
    _length(axes, 0.0, _OWN_LAT, 21, side=-1)
    axes.plot([_LEFT + 12, nose + 1], [0, 0], color=style.ORANGE, linewidth=0.9, linestyle=(0, (4, 3)), zorder=4)
    _helper(axes, (tail, _OWN_LAT), (tail - 2.2, _OWN_LAT))
    _measure(axes, (tail - 1.6, 0.0), (tail - 1.6, _OWN_LAT), 2, _Kind.OFFSET, beside=(-1.4, 0.0))


def _draw_neighbour(axes: Axes, neighbour: _Neighbour) -> None:
    """The four features of a vehicle beside the own one."""
    side, ahead = neighbour.side, neighbour.ahead
    own_end, own_side = ahead * _LENGTH / 2, _OWN_LAT + side * _WIDTH / 2
    near_end, near_side = neighbour.lon - ahead * _LENGTH / 2, neighbour.lat - side * _WIDTH / 2
    _helper(axes, (own_end, own_side), (own_end, neighbour.lat + 0.3 * side))
    _measure(axes, (own_end, neighbour.lat), (near_end, neighbour.lat), neighbour.along, _Kind.ALONG)
    middle = neighbour.lon - ahead * 1.5
    _helper(axes, (own_end, own_side), (middle + ahead, own_side))
    _measure(axes, (middle, own_side), (middle, near_side), neighbour.across, _Kind.ACROSS)
    _speed(axes, neighbour.lon + _LENGTH / 2, neighbour.lat - 0.85 * side, neighbour.speed)
    _length(axes, neighbour.lon, neighbour.lat, neighbour.length, side)


def _length(axes: Axes, lon: float, lat: float, number: int, side: int) -> None:
    beyond = lat + side * (_WIDTH / 2 + 0.65)
    _measure(axes, (lon - _LENGTH / 2, beyond), (lon + _LENGTH / 2, beyond), number, _Kind.LENGTH)


def _speed(axes: Axes, lon: float, lat: float, number: int) -> None:
    arrow = {"arrowstyle": "-|>", "color": _Kind.SPEED.value[1], "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (lon + _SPEED, lat), (lon, lat), arrowprops=arrow, zorder=4)
    _number(axes, (lon + 0.45 * _SPEED, lat), number, _Kind.SPEED)


def _measure(
    axes: Axes,
    start: tuple[float, float],
    end: tuple[float, float],
    number: int,
    kind: _Kind,
    beside: tuple[float, float] = (0.0, 0.0),
) -> None:
    """A dimension line with its number in the middle."""
    arrow = {"arrowstyle": "<|-|>,head_width=0.2,head_length=0.35", "color": kind.value[1], "linewidth": 1.0}
    axes.annotate("", end, start, arrowprops={**arrow, "shrinkA": 0, "shrinkB": 0}, zorder=4)
    middle = (start[0] + end[0]) / 2 + beside[0], (start[1] + end[1]) / 2 + beside[1]
    _number(axes, middle, number, kind)


def _number(axes: Axes, at: tuple[float, float], number: int, kind: _Kind) -> None:
    box = {"boxstyle": "circle,pad=0.18", "facecolor": style.PAPER, "edgecolor": kind.value[1], "linewidth": 0.8}
    axes.text(*at, str(number), fontsize=6, ha="center", va="center", bbox=box, zorder=6)


def _helper(axes: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    axes.plot(*zip(start, end, strict=True), color=style.GREY, linewidth=0.7, linestyle=(0, (2, 2)), zorder=2)
