"""The obstacles of a CommonRoad scenario: what a driver is told of them, and the tracks of those that are vehicles."""

from collections.abc import Iterable
from itertools import pairwise
from math import ceil
from types import SimpleNamespace
from typing import Any

import numpy as np
import polars as pl
import shapely
from jaxtyping import Bool, Float
from shapely import get_coordinates
from shapely.geometry import Point
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from coverdrive.driving.perception import Told
from coverdrive.errors import DataError
from coverdrive.geometry import body_corners, boxes_overlap
from coverdrive.recordings.checks import FASTEST
from coverdrive.recordings.files.scenario import has_sets, is_vehicle, numbers_of, sets_of, states_of
from coverdrive.recordings.tracks.repair import VERGE
from coverdrive.road import Road

_HEADINGS = 9
"""at which a body of uncertain heading is looked at"""
_LONG = 20.0
"""[m] standing obstacles that are longer, as walls and guard rails are, are told in pieces of at most this length"""
_SOON, _FAR = 1.0, 5.0
"""[s] before a vehicle comes to the road at which it is told of, and [m] that it is away at the most"""
_STEPS, _TELLING = 5, 0.25
"""time steps over which the motion of sets is looked at, and [m] of a way from which on it says where that leads"""
_MOTION = ("velocity", "orientation")
_COLUMNS = ("vehicle", "time", "lon", "lat", "speed", "heading", "length", "width")


def begins_in(obstacle: Any, other: Any, dt: float) -> bool:
    """Whether the bodies of two moving obstacles overlap at the first time step, of dt [s], at which both are there."""
    step = max(obstacle.initial_state.time_step, other.initial_state.time_step)
    bodies = [
        (np.array([x, y]), np.array(heading), np.divide(size, 2))
        for (x, y, _, heading), size in filter(None, (told_at(each, step, dt) for each in (obstacle, other)))
    ]
    return len(bodies) == 2 and bool(boxes_overlap(*bodies[0], *bodies[1]))


def told_at(obstacle: Any, step: int, dt: float) -> Told | None:
    """Where a moving obstacle is at a time step of dt [s]; None if it is not there, errors as of `told`.

    If that is in sets of places, it is a box around all, as fast as their middle moves and along its way, or as at
    first where that is too short to tell.
    """
    first = obstacle.initial_state
    if not has_sets(obstacle) or step == first.time_step:
        state = obstacle.state_at_time(step)
        return None if state is None else told(state, obstacle.obstacle_shape)
    latest = range(step - _STEPS, step + 1)
    sets = {when: shape_of(shape) for when, shape in sets_of(obstacle) if isinstance(when, int) and when in latest}
    if step not in sets:
        return None
    area, before = sets[step], min(sets)
    speed, heading = (float(np.mean(numbers_of(getattr(first, name)))) for name in _MOTION)
    way = get_coordinates(area.centroid)[0] - get_coordinates(sets[before].centroid)[0]
    if before < step:
        speed = min(float(np.hypot(*way)) / (dt * (step - before)), FASTEST)
    if np.hypot(*way) > _TELLING:
        heading = float(np.arctan2(way[1], way[0]))
    place, size = _box_around(get_coordinates(area) @ _turned(-heading), heading)
    return (*place, speed, heading), size


def cut(whole: Told) -> list[Told]:
    """A box in parts along it, each of a length that can be told."""
    (x, y, *motion), (length, width) = whole
    count, heading = max(1, ceil(length / _LONG)), motion[-1]
    along = (np.arange(count) - (count - 1) / 2) * length / count
    return [((x + d * np.cos(heading), y + d * np.sin(heading), *motion), (length / count, width)) for d in along]


def told(state: Any, shape: Any) -> Told:
    """Where an obstacle is, and its size along its heading: of uncertain states the middle, in a box around all.

    Raises:
        DataError: it has no place, heading or speed.
    """
    for name in ("position", "orientation", "velocity"):
        if getattr(state, name, None) is None:
            raise DataError(f"an obstacle has no {name} at time step {state.time_step}; give it one, or leave it out")
    speed, heading = (float(np.mean(numbers_of(getattr(state, name)))) for name in _MOTION)
    place, exact = state.position, isinstance(state.position, np.ndarray) and not hasattr(state.orientation, "start")
    if exact and hasattr(shape, "radius"):
        size = (2 * shape.radius, 2 * shape.radius)
    elif exact and hasattr(shape, "width"):
        size = (shape.length, shape.width)
    else:
        ends = numbers_of(state.orientation)
        backwards, apart = _turned(-heading), np.linspace(ends[0], ends[-1], _HEADINGS) - heading
        around = np.concatenate([get_coordinates(_at_origin(shape)) @ _turned(each) for each in apart])
        places = get_coordinates(Point(place) if isinstance(place, np.ndarray) else shape_of(place)) @ backwards
        place, size = _box_around(places[:, None] + around, heading)
    return (*place, speed, heading), size


def _box_around(
    points: Float[np.ndarray, "*n 2"], heading: float
) -> tuple[Float[np.ndarray, " 2"], tuple[float, float]]:
    """Place and size [m] of a box of a heading [rad] around points along it and across it."""
    along, across = np.moveaxis(points, -1, 0)
    least, most = np.array([along.min(), across.min()]), np.array([along.max(), across.max()])
    return _turned(-heading) @ (least + most) / 2, tuple((most - least).tolist())


def _turned(angle: float) -> Float[np.ndarray, "2 2"]:
    """What turns rows by an angle [rad]."""
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def shape_of(position: Any) -> BaseGeometry:
    """The area of a position of commonroad-io, some versions of which draw circles at half their radius."""
    parts = getattr(position, "shapes", [position])
    return unary_union([
        Point(part.center).buffer(part.radius) if hasattr(part, "radius") else part.shapely_object for part in parts
    ])  # fmt: skip


def _at_origin(shape: Any) -> BaseGeometry:
    """The area of an obstacle's shape, which from commonroad-io 2026.1 on is none of its own until it is placed."""
    placed = getattr(shape, "compute_occupancy_for_state", lambda _: shape)
    return shape_of(placed(SimpleNamespace(position=np.zeros(2), orientation=0.0)))


def pieces(state: Any, shape: Any) -> list[Told]:
    """What is told of a standing obstacle, a long one in pieces that follow its shape; errors as of `told`."""
    (*place, speed, heading), size = whole = told(state, shape)
    if max(size) <= _LONG:
        return [whole]
    exact = isinstance(state.position, np.ndarray) and not hasattr(state.orientation, "start")
    area = _at_origin(shape) if exact else shapely.box(*(-np.divide(size, 2)), *np.divide(size, 2))
    origin, low, high = state.position if exact else place, *np.reshape(area.bounds, (2, 2))
    axis, found = int(np.argmax(high - low)), list[Told]()
    ends = np.linspace(low[axis], high[axis], ceil((high - low)[axis] / _LONG) + 1)
    for first, last in pairwise(ends):
        begin, end = low.copy(), high.copy()
        begin[axis], end[axis] = first, last
        there = area.intersection(shapely.box(*begin, *end))
        for part in (each for each in getattr(there, "geoms", [there]) if each.area > 0):
            around = get_coordinates(shapely.oriented_envelope(part))[:4]
            sides = sorted((around[1] - around[0], around[2] - around[1]), key=lambda side: -np.hypot(*side))
            turn = np.arctan(sides[0][1] / sides[0][0]) if sides[0][0] else np.pi / 2
            centre = origin + around.mean(axis=0) @ _turned(heading)
            found.append(((*centre, speed, heading + turn), tuple(np.hypot(*np.transpose(sides)).tolist())))
    return found


def near(points: Any, road: Road) -> Any:
    """Which of some points (x, y) [m] of the map are on a road, or at most `VERGE` from it."""
    lon, lat = road.to_road(*points)
    edges = road.edges_at(lon)
    within = (edges[..., 0] - VERGE <= lat) & (lat <= edges[..., -1] + VERGE)
    return within & (lon >= -VERGE) & (lon <= road.length + VERGE)


def come_near(bodies: Iterable[Told], road: Road) -> Bool[np.ndarray, " n"]:
    """Which of one or more bodies are on a road, in part or beside it, or come there soon if they go on as they do."""
    poses, sizes = (np.array(each, dtype=float) for each in zip(*bodies, strict=True))
    x, y, speed, heading = poses.T
    lon, lat = road.to_road(x, y)
    edges, across = road.edges_at(lon), speed * np.sin(road.heading_to_road(lon, heading))
    right, left = edges[:, 0], edges[:, -1]
    soon = np.clip(np.where(lat < right, across, -across) * _SOON, 0.0, _FAR)
    beside = (right - VERGE - soon <= lat) & (lat <= left + VERGE + soon)
    along, corners = road.to_road(*body_corners(poses, sizes / 2).T)  # each by corner, and by body
    reaches = (corners.min(axis=0) <= left) & (right <= corners.max(axis=0))
    reaches &= (along.min(axis=0) <= road.length) & (along.max(axis=0) >= 0)
    return reaches | (beside & (lon >= -VERGE) & (lon <= road.length + VERGE))


def tracks_of(scenario: Any, road: Road) -> pl.DataFrame:
    """The recorded vehicles on a road, as the table of a recording has them; what is uncertain is left out."""
    rows = [
        (obstacle.obstacle_id, state.time_step * float(scenario.dt), *pose, *size)
        for obstacle in scenario.dynamic_obstacles
        if is_vehicle(obstacle) and hasattr(obstacle.obstacle_shape, "width")
        for state in filter(None, states_of(obstacle))
        if isinstance(state.position, np.ndarray)
        and len(numbers_of([getattr(state, each, None) for each in _MOTION])) == 2
        for pose, size in [told(state, obstacle.obstacle_shape)]
    ]
    table = np.unique(np.reshape(np.array(rows, dtype=float), (-1, len(_COLUMNS))), axis=0)
    vehicle, time, x, y, speed, heading, length, width = table[near(table[:, 2:4].T, road)].T
    lon, lat = road.to_road(x, y)
    heading = road.heading_to_road(lon, heading + np.pi * (speed < 0))
    columns = (vehicle.astype(np.int64), time, lon, lat, np.abs(speed), heading, length, width)
    return pl.DataFrame(dict(zip(_COLUMNS, columns, strict=True)))
