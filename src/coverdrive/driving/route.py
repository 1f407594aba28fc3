"""Through which lanelets of a map a planning problem leads, and how far of the road matters.

A lanelet can be left for those after it and for those beside it that are driven in the same direction.
"""

from collections.abc import Callable, Collection, Iterable
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from shapely.geometry import Point, Polygon
from shapely.geometry.base import BaseGeometry

from coverdrive.driving.goal import Goal
from coverdrive.errors import DataError
from coverdrive.recordings.roads.drawn_road import ASIDE, DrawnLane, drawn_road
from coverdrive.road import Road

_ALONG = np.pi / 4
"""[rad] between the start and a lanelet that it is on, at the most"""
_BEHIND, _BEYOND = 100.0, 150.0
"""[m] of the road behind the start that matters, and beyond what can be reached in time: others, and what plans see"""
_ELSEWHERE = ASIDE + 5.0
"""[m] from the first lane of a road, beyond which nothing is on it"""
_HARDEST = 3.0
"""[m/s²] at which a car gets away"""
_SIDES = ("left", "right")
_SHARES_AHEAD, _SHARES_BEHIND = (1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12), (1.0, 0.5, 0.2, 0.05)
"""of these that are tried where the rest of a lane is no line that can be followed"""


class Route(NamedTuple):
    """The numbers of lanelets."""

    lanelets: set[int]
    """from a start to goals, and beyond"""
    goals: set[int]
    """those of them at the goals, or beside them"""
    starts: set[int]
    """at the start, or beside it"""


def route(
    lanelets: Iterable[Any], start: Float[np.ndarray, " 2"], heading: float, goals: Collection[BaseGeometry]
) -> Route | None:
    """The way from a start to goals. None if none leads there.

    Args:
        lanelets: of commonroad-io.
        start: [m] where.
        heading: [rad] of who starts.
        goals: areas, any of which will do.
    """
    parts = {part.lanelet_id: part for part in lanelets}
    at = {
        n
        for n, part in parts.items()
        if part.polygon.shapely_object.covers(Point(start)) and _along(part, start, heading)
    }
    points = [part.representative_point() for goal in goals for part in getattr(goal, "geoms", [goal])]
    ends = {n for n, part in parts.items() if any(part.polygon.shapely_object.covers(point) for point in points)}
    ahead = _reached(parts, at, ("successor",), beside=True)
    reached = ends & ahead
    if not reached:
        return None
    between = ahead & _reached(parts, reached, ("predecessor",), beside=True)
    first, last = (_reached(parts, some, (), beside=True) for some in (at, reached))
    beyond = _reached(parts, last, ("successor",)) | _reached(parts, first, ("predecessor",))
    return Route(between | beyond, last & between, first)


def _along(part: Any, place: Float[np.ndarray, " 2"], heading: float) -> bool:
    """Whether a lanelet leads in about a direction [rad] at a place [m]."""
    centre = part.center_vertices
    step = np.diff(centre, axis=0)
    nearest = int(np.argmin(np.hypot(*((centre[1:] + centre[:-1]) / 2 - place).T)))
    turned = np.arctan2(step[nearest, 1], step[nearest, 0]) - heading
    return bool(np.cos(turned) > np.cos(_ALONG))


def _reached(parts: dict[int, Any], some: Collection[int], links: Iterable[str], beside: bool = False) -> set[int]:
    """Some lanelets and all to which links lead from them, and lane changes."""
    found, stack = set[int](), [*some]
    while stack:
        number = stack.pop()
        if number in found or number not in parts:
            continue
        found.add(number)
        part = parts[number]
        stack += [other for link in links for other in getattr(part, link)]
        stack += [
            getattr(part, f"adj_{side}") for side in _SIDES if beside and getattr(part, f"adj_{side}_same_direction")
        ]
    return found


def farthest(speed: float, time: float) -> float:
    """[m] as far as a car gets from a speed [m/s] on in a time [s]."""
    return speed * time + _HARDEST / 2 * time**2


def within_reach(goal: Goal, lon: float, speed: float) -> bool:
    """Whether a car at a place [m] of the road, at a speed [m/s], can be where, and as fast as, a goal says in time."""
    if goal.time is None:
        return True
    time = goal.time[1]
    first, last = goal.position or (lon, lon)
    slowest = 0.0 if goal.speed is None else goal.speed[0]
    return time > 0 and lon <= last and first - lon <= farthest(speed, time) and slowest <= speed + _HARDEST * time


def drawn_near(
    start: Float[np.ndarray, " 2"], speed: float, time: float, touching: float, why: list[tuple[float, str]]
) -> Callable[[list[DrawnLane]], Road]:
    """Draws as much of a road as matters from a start [m] on, at a speed [m/s] and for a time [s].

    Where that bends too sharply it is less, as much as can be followed. ``touching`` is that of `drawn_road`; ``why``
    gains how far [m] from the start the first lanes of those are that are no road, and the reasons. Lanes that are
    too far away for the start to be on their road are not drawn.
    """
    reach = farthest(speed, time) + _BEYOND

    def draw(lanes: list[DrawnLane]) -> Road:
        problems = list[DataError]()
        away = Polygon(np.concatenate([lanes[0].left, lanes[0].right[::-1]])).distance(Point(start))
        if away > _ELSEWHERE:
            raise DataError("the start is on another road")
        most = min(reach, float(np.hypot(*np.diff(lanes[0].left, axis=0).T).sum()))
        for ahead, behind in product(_SHARES_AHEAD, _SHARES_BEHIND):
            try:
                return drawn_road([lanes[0].cut(start, behind * _BEHIND, ahead * most), *lanes[1:]], touching)
            except DataError as error:
                problems.append(error)
        why.append((away, str(problems[0])))
        raise problems[0]

    return draw
