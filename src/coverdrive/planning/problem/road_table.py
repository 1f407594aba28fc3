"""A whole road for one planner: the table of which `coverdrive.road_ahead` is what lies ahead.

What bends change is decided here once for every road. The ego's body is as large as it becomes anywhere on the road
(`coverdrive.geometry.bent_half_sizes`), those of others as they become along each path; the edges are the innermost
ones over the length of the ego; and before curves the speed falls in time. P = K + 1 moments, R rows.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.errors import DataError
from coverdrive.geometry import bent_half_sizes
from coverdrive.paths import PredictedPaths
from coverdrive.planning.problem.constants import vehicle_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.road import Road
from coverdrive.road_ahead import LANE_END, TINY, RoadAhead, innermost_edges, lane_ends, largest_within

_SPACING = 2.0
"""[m] between two rows at the most"""
_NEAR = 40.0
"""[m] to both sides of a place: what a body that is there touches of the road"""
_WIDE = 15.0
"""[m] of that which is left for the way of the body until the next moment"""
_SEEN = 300.0
"""[m] ahead, and behind, where lanes that end are seen"""
_FREE = 1e3
"""[m/s] that no road forbids"""
_HELD = 0.9
"""share of the lateral acceleration that following the road may take at the most"""
_URGENT = 0.85
"""share of it that following the road takes at the wanted speed where that is urgent"""
_UNSURE = 0.5
"""[m] by which a body may be elsewhere along the road than evenly between the ends of a step, less than dt²·|f'|/8"""
_LEAST = 0.25
"""share of full braking that is taken for sure on any road"""
_NEAREST = 0.5
"""share of the way to the centre of a curve that lanes and bodies may be beside the line"""


class RoadTable(NamedTuple):
    """A whole road, and the car on it."""

    road: RoadAhead
    """seen from its beginning"""
    sharpest: Float[np.ndarray, " R"]
    """[1/m] largest curvature, without its sign, of all that is near"""
    wanted: Float[np.ndarray, "2 R"]
    """[m/s] speed at which curves are driven, usually and where it is urgent"""
    ends: Float[np.ndarray, "E 2"]
    """[m] centres of what stands beside the road where lanes end"""
    vehicle: Any
    """of the type `Vehicle`: as large as its body becomes anywhere, braking as it can everywhere"""
    reaching: Any
    """the same with all that it can do anywhere in the road frame"""

    def ahead(self, lon: float) -> RoadAhead:
        """The road as seen from a position [m]."""
        return self.road._replace(first=-lon)

    def wanted_from(
        self,
        lon: float,
        speed: float,
        problem: ProblemSettings,
        wished: float | None,
        braking: float = 0.0,
        urgent: bool = False,
    ) -> Float[np.ndarray, " P"]:
        """[m/s] the wanted speed at every moment, getting along from a position [m] and speed [m/s] as fast as that.

        Where no curve asks for less it is the wished one, or the reference speed of the problem. What is below 0 is as
        hard to brake for as it is far from the speed, though nobody drives backwards. With ``braking`` [m/s²] it is no
        more than what is left of the speed by then. If it is ``urgent`` curves are driven as fast as is safe.
        """
        usual = min(problem.cost.reference_speed if wished is None else wished, problem.vehicle.max_speed)
        most = np.full(problem.steps + 1, usual)
        if braking > 0:
            most = np.minimum(most, speed - braking * problem.dt * np.arange(len(most)))
        if self.wanted.shape[1] == 1:
            return most
        result, rows = np.empty(problem.steps + 1), self.road.spacing * np.arange(self.wanted.shape[1])
        for k in range(len(result)):
            result[k] = min(np.interp(lon, rows, self.wanted[int(urgent)]), most[k])
            slower = speed - problem.dt * problem.cost.curve_braking
            speed = max(0.0, min(speed + problem.dt * problem.vehicle.max_acceleration, max(result[k], slower)))
            lon += problem.dt * speed
        return result


def table_of(road: Road, problem: ProblemSettings) -> RoadTable:
    """The table of a road for the ego of a problem.

    Raises:
        DataError: if the road is too near to the centre of a curve.
    """
    car, cost, plain = problem.vehicle, problem.cost, vehicle_of(problem.vehicle)
    if road.line is None and road.changing is None:
        rows = np.array([[0.0, road.edges[0], road.edges[-1], np.inf]], dtype=float)
        nothing = RoadAhead(rows, 0.0, 1.0, 0.0), np.zeros(1), np.full((2, 1), _FREE), np.zeros((0, 2))
        return RoadTable(*nothing, plain, plain)
    spacing, length, line = _SPACING, float(road.length), 0.0
    if road.line is not None:
        spacing, line = road.line.spacing * max(1, int(_SPACING / road.line.spacing)), float(road.line.lat)
        length = min(length, road.line.length)
    lon = spacing * np.arange(int(float(road.length) / spacing) + 2)
    curvature = road.curvature(np.minimum(lon, length))
    change = np.abs(np.diff(curvature, append=curvature[-1])) / spacing
    edges, sharpest = innermost_edges(road, lon), largest_within(np.abs(curvature), _NEAR / spacing)
    aside = np.abs(np.concatenate([edges * [1, -1], road.edges_at(lon)], axis=1) - line).max(axis=1)
    aside = largest_within(aside, _NEAR / spacing)
    most, near = sharpest.max(), float((sharpest * aside).max())
    if near > _NEAREST:
        place = int(np.argmax(sharpest * aside))
        tight = f"a curve of {1 / sharpest[place]:.0f} m radius on a road whose edge is {aside[place]:.0f} m beside"
        raise DataError(f"{tight} its line; expected at most half of the radius, choose or cut another road")
    half_length, half_width = bent_half_sizes(car.half_sizes, np.hypot(*car.half_sizes), sharpest, aside).max(axis=0)
    right, left = largest_within(edges, 2 + (half_length + half_width + _UNSURE) / spacing).T
    square = car.max_lateral_acceleration / np.maximum(np.abs(curvature) * (1 + near), TINY)
    held = _allowed(lon, _HELD * square, car.max_deceleration / 2)
    shares = cost.curve_share, max(cost.curve_share, _URGENT)
    wanted = np.stack([_allowed(lon, share * square, cost.curve_braking) for share in shares])
    farther, nearer = 1 + near, 1 - near
    braking = car.max_deceleration / farther - (held**2 * change * aside).max()
    vehicle = plain._replace(
        length=2 * half_length, width=2 * half_width, braking=max(braking, _LEAST * car.max_deceleration)
    )
    gain = car.max_speed**2 * ((change * aside).max() + most * np.sin(car.max_heading))
    reaching = vehicle._replace(
        max_deceleration=(car.max_deceleration + gain) / nearer,
        max_acceleration=(car.max_acceleration + gain) / nearer,
        max_lateral_acceleration=(car.max_lateral_acceleration + car.max_speed**2 * most) / nearer,
        max_speed=car.max_speed / nearer,
    )
    ahead = RoadAhead(np.stack([curvature, right, -left, held], axis=-1), 0.0, spacing, line)
    return RoadTable(ahead, sharpest, wanted, lane_ends(road, lon), vehicle, reaching)


def _allowed(lon: Float[np.ndarray, " R"], square: Float[np.ndarray, " R"], braking: float) -> Float[np.ndarray, " R"]:
    """[m/s] from which braking [m/s²] leads to speeds whose squares [m²/s²] are at most these everywhere ahead."""
    limit = np.minimum(square, _FREE**2) + 2 * braking * lon
    return np.sqrt(np.minimum.accumulate(limit[::-1])[::-1] - 2 * braking * lon)


def on_road(paths: PredictedPaths, lon: float, table: RoadTable) -> PredictedPaths:
    """The paths with boxes that hold the bodies on a road that bends, and what stands where lanes end.

    Args:
        paths: with boxes as if the road were straight; those of now hold the bodies alone.
        lon: [m] of the ego; lanes that end far away are left out.
        table: of the road.
    """
    if len(table.sharpest) == 1:
        return paths
    half, road = paths.half_sizes, table.road
    place = np.clip(paths.points[..., 0] / road.spacing, 0, len(table.sharpest) - 1).astype(int)
    curvature = table.sharpest[place].max(axis=1, initial=0.0)
    curvature[half[..., 0].max(axis=1, initial=0.0) > _NEAR - _WIDE] = table.sharpest.max()
    aside = (np.abs(paths.points[..., 1] - road.line) + half[..., 1]).max(axis=1, initial=0.0)
    aside = np.minimum(aside, _NEAREST / np.maximum(curvature, TINY))  # who is nearer to the centre is on no lane
    diagonal = np.hypot(half[:, 0, 0], half[:, 0, 1])
    paths = replace(paths, half_sizes=bent_half_sizes(half, *(each[:, None] for each in (diagonal, curvature, aside))))
    ends = table.ends[np.abs(table.ends[:, 0] - lon) < _SEEN]
    if not len(ends):
        return paths
    points = np.repeat(ends[:, None], paths.points.shape[1], axis=1)
    standing = PredictedPaths(points, -1 - np.arange(len(ends)), np.broadcast_to(LANE_END, points.shape), paths.dt)
    return paths.joined(standing)
