"""The affordance as a sketch (paper, Fig. 2): what the 21 features measure, each with its number in `FEATURES`.

Not to scale: lanes are drawn wider and gaps shorter than they are.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyBboxPatch

from coverdrive.reporting.plotting import style

_LANE = 5.4
"""height of a lane"""
_LENGTH, _WIDTH = 8.0, 2.6
"""of a vehicle"""
_LEFT, _RIGHT = -28.0, 37.0
"""ends of the road that is shown"""
_SPEED = 4.0
"""length of the arrow of a speed"""
_FRONT = 25.0
_OWN_LAT = -0.8

_ALONG, _ACROSS, _SPEEDS, _LENGTHS, _OFFSET = style.BLUE, style.GREEN, style.VERMILION, style.PURPLE, style.ORANGE
_KINDS = {
    _ALONG: "clearance along the road",
    _ACROSS: "clearance across the road",
    _SPEEDS: "speed, of others relative to the own",
    _LENGTHS: "length",
    _OFFSET: "distance to the lane centre",
}
"""what the features of a colour measure"""

_Point = tuple[float, float]


_NEIGHBOURS = (
    ("left front", 17.0, 1, (5, 6, 7, 17)),
    ("left rear", -17.0, 1, (8, 10, 9, 18)),
    ("right front", 15.0, -1, (11, 12, 13, 19)),
    ("right rear", -19.0, -1, (14, 16, 15, 20)),
)
"""vehicles beside the ego: place of the centre, side (1: left, −1: right), and the numbers of clearance along the road,
speed, clearance across the road, and length"""


def affordance_figure() -> Figure:
    """Draw the sketch."""
    with style.style():
        figure = style.new_figure(style.TWO_COLUMNS, 2.7)
        axes = figure.subplots()
        axes.set(xlim=(_LEFT, _RIGHT), ylim=(-1.5 * _LANE - 0.2, 1.5 * _LANE + 0.2), aspect="equal")
        axes.set_axis_off()
        axes.axhspan(-1.5 * _LANE, 1.5 * _LANE, facecolor=style.ROAD, zorder=0)
        for edge, width, dash in ((-1.5, 1.2, "-"), (1.5, 1.2, "-"), (-0.5, 1.0, (0, (9, 9))), (0.5, 1.0, (0, (9, 9)))):
            axes.axhline(edge * _LANE, color=style.MARKING, linewidth=width, linestyle=dash, zorder=1)
        _draw_vehicle(axes, 0.0, _OWN_LAT, style.EGO, "ego")
        _draw_vehicle(axes, _FRONT, 0.0, style.GREY, "front")
        for name, lon, side, numbers in _NEIGHBOURS:
            _draw_vehicle(axes, lon, side * _LANE, style.GREY, name)
            _draw_neighbour(axes, lon, side, *numbers)
        _draw_own(axes)
        handles = [Line2D([], [], color=colour, linewidth=1.8, label=label) for colour, label in _KINDS.items()]
        figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def _draw_vehicle(axes: Axes, lon: float, lat: float, colour: str, name: str) -> None:
    corner = lon - _LENGTH / 2, lat - _WIDTH / 2
    shape = "round,pad=0,rounding_size=0.5"
    axes.add_patch(FancyBboxPatch(corner, _LENGTH, _WIDTH, boxstyle=shape, facecolor=colour, linewidth=0, zorder=3))
    axes.text(lon, lat, name, color="white", fontsize=6.5, ha="center", va="center_baseline", zorder=4)


def _draw_own(axes: Axes) -> None:
    """Features 1 to 4 and 21."""
    nose, tail = _LENGTH / 2, -_LENGTH / 2
    _speed(axes, nose, _OWN_LAT - 0.55, 1)
    _measure(axes, (nose, 0.75), (_FRONT - nose, 0.75), 3, _ALONG)
    _speed(axes, _FRONT + nose, 0.0, 4)
    _length(axes, 0.0, _OWN_LAT, 21, side=-1)
    axes.plot([_LEFT + 12, nose + 1], [0, 0], color=style.ORANGE, linewidth=0.9, linestyle=(0, (4, 3)), zorder=4)
    _helper(axes, (tail, _OWN_LAT), (tail - 2.2, _OWN_LAT))
    _measure(axes, (tail - 1.6, 0.0), (tail - 1.6, _OWN_LAT), 2, _OFFSET, beside=-1.4)


def _draw_neighbour(axes: Axes, lon: float, side: int, along: int, speed: int, across: int, length: int) -> None:
    """The four features of a vehicle beside the ego."""
    lat, ahead = side * _LANE, 1 if lon > 0 else -1
    own_end, own_side = ahead * _LENGTH / 2, _OWN_LAT + side * _WIDTH / 2
    near_end, near_side = lon - ahead * _LENGTH / 2, lat - side * _WIDTH / 2
    middle = lon - ahead * 1.5
    _helper(axes, (own_end, own_side), (own_end, lat + 0.3 * side))
    _measure(axes, (own_end, lat), (near_end, lat), along, _ALONG)
    _helper(axes, (own_end, own_side), (middle + ahead, own_side))
    _measure(axes, (middle, own_side), (middle, near_side), across, _ACROSS)
    _speed(axes, lon + _LENGTH / 2, lat - 0.85 * side, speed)
    _length(axes, lon, lat, length, side)


def _length(axes: Axes, lon: float, lat: float, number: int, side: int) -> None:
    beyond = lat + side * (_WIDTH / 2 + 0.65)
    _measure(axes, (lon - _LENGTH / 2, beyond), (lon + _LENGTH / 2, beyond), number, _LENGTHS)


def _speed(axes: Axes, lon: float, lat: float, number: int) -> None:
    _measure(axes, (lon, lat), (lon + _SPEED, lat), number, _SPEEDS, -0.05 * _SPEED, arrowstyle="-|>", linewidth=1.2)


def _measure(
    axes: Axes, start: _Point, end: _Point, number: int, colour: str, beside: float = 0.0, **look: Any
) -> None:
    """A dimension line with its number in the middle, or beside it."""
    line = {"arrowstyle": "<|-|>,head_width=0.2,head_length=0.35", "linewidth": 1.0, "color": colour}
    axes.annotate("", end, start, arrowprops=line | look | {"shrinkA": 0, "shrinkB": 0}, zorder=4)
    middle = (start[0] + end[0]) / 2 + beside, (start[1] + end[1]) / 2
    box = {"boxstyle": "circle,pad=0.18", "facecolor": style.PAPER, "edgecolor": colour, "linewidth": 0.8}
    axes.text(*middle, str(number), fontsize=6, ha="center", va="center", bbox=box, zorder=6)


def _helper(axes: Axes, start: _Point, end: _Point) -> None:
    axes.plot(*zip(start, end, strict=True), color=style.GREY, linewidth=0.7, linestyle=(0, (2, 2)), zorder=2)
