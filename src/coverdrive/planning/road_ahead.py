"""The road as the planner sees it: its curvature, edges and the speed that it allows, in a table along it.

The road frame is flat for the planner: speed and heading are those of (lon, lat), so that lon' = u·cos χ and
lat' = u·sin χ on any road. `bent` says what the real car does then, which is what the limits are about. The body is
made so much larger that it holds the real one (`coverdrive.geometry.bent_half_sizes`), and the edges are the innermost
ones over its length. P = K + 1 moments, R rows.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled
from coverdrive.errors import DataError
from coverdrive.geometry import bent_half_sizes
from coverdrive.paths import PredictedPaths
from coverdrive.planning.constants import vehicle_of
from coverdrive.planning.path_memory import joined
from coverdrive.planning.problem import ProblemSettings
from coverdrive.planning.vehicle import TINY, Bend
from coverdrive.road import Road

CURVATURE, RIGHT, LEFT, FASTEST = range(4)
"""columns of `RoadAhead.rows`"""
_SPACING = 2.0
"""[m] between two rows at the most"""
_NEAR = 40.0
"""[m] to both sides of a place: what a body that is there touches of the road"""
_WIDE = 15.0
"""[m] of that which is left for the way of the body until the next moment"""
_SEEN = 300.0
"""[m] ahead, where lanes that end are seen"""
_FREE = 1e3
"""[m/s] that no road forbids"""
_HELD = 0.9
"""share of the lateral acceleration that following the road may take at the most"""
_BODY = np.array([2.0, 1.5])
"""[m] half sizes of what stands where a lane ends, beside the road"""
_UNSURE = 0.5
"""[m] by which a body may be elsewhere along the road than evenly between the ends of a step, less than dt²·|f'|/8"""


class RoadAhead(NamedTuple):
    """The road around the ego, for compiled code."""

    rows: Float[np.ndarray, "R 4"]
    """curvature [1/m], lat [m] of the right and of the left edge, largest speed [m/s]; a single row: all along"""
    first: float
    """[m] lon of the first row"""
    spacing: float
    """[m] between two rows; before the first and after the last one the road stays as it is there"""
    line: float
    """[m] lat of the line along which lon is measured"""
    wanted: Float[np.ndarray, " P"]
    """[m/s] speed at every moment; in a `RoadTable` that at every row"""


class RoadTable(NamedTuple):
    """A whole road, and the car on it."""

    ahead: RoadAhead
    """seen from its beginning"""
    sharpest: Float[np.ndarray, " R"]
    """[1/m] largest curvature, without its sign, of all that is near"""
    ends: Float[np.ndarray, "E 2"]
    """[m] where something stands beside the road because a lane ends"""
    vehicle: Any
    """of the type `Vehicle`: as large as its body becomes anywhere, braking as it can everywhere"""
    reaching: Any
    """the same with all that it can do anywhere along the road frame"""


def bent(state: Any, curvature: Any, change: Any, line: float) -> tuple[Any, Any, Any, Any, Any]:
    """What the real car does where speed u and heading χ are those of (lon, lat); all exact at the moment.

    With the stretch g = 1 − κ·(lat − line), the real velocity along and across the road is u·(g·cos χ, sin χ). Its
    length is v = u·ρ, its direction ψ = atan2(sin χ, g·cos χ) from the road's, which turns by κ·lon'. Hence the real
    yaw rate is ω = ρ·(χ'/m + u·c) and the real acceleration v' = ρ·u' + u·C·χ' + D.

    Args:
        state: lon [m], lat [m], u [m/s], χ [rad].
        curvature: κ [1/m] of the road there.
        change: [1/m²] of it along the road.
        line: [m] lat of the reference line.

    Returns:
        ρ, m, c [1/m], D [m/s²] and C; on a straight road 1, 1, 0, 0, 0.
    """
    _, lat, speed, heading = state
    cosine, sine = np.cos(heading), np.sin(heading)
    stretch = 1 - curvature * (lat - line)
    narrowing = change * (lat - line) * cosine + curvature * sine  # −g'/u
    square = stretch**2 * cosine**2 + sine**2
    share = np.sqrt(square)
    follow = (curvature * cosine + sine * cosine * narrowing / square) / share
    gain = -(speed**2) * stretch * narrowing * cosine**2 / share
    return share, square * share / stretch, follow, gain, (1 - stretch**2) * sine * cosine / share


_bent: Any = compiled(bent)


@compiled
def value_at(lon: float, column: int, road: RoadAhead) -> tuple[float, float]:
    """A column of the table at a position [m], and how it changes along the road."""
    rows = road.rows
    if len(rows) == 1:
        return rows[0, column], 0.0
    place = (lon - road.first) / road.spacing
    if not 0 <= place < len(rows) - 1:
        return rows[0 if place < 0 else -1, column], 0.0
    i = int(place)
    change = rows[i + 1, column] - rows[i, column]
    return rows[i, column] + (place - i) * change, change / road.spacing


@compiled
def bend_at(state: tuple[float, float, float, float], dt: float, road: RoadAhead) -> Bend:
    """`bent` at a state, for the road half a step of dt [s] further on."""
    if len(road.rows) == 1:
        return 1.0, 1.0, 0.0, 0.0
    curvature, change = value_at(state[0] + dt / 2 * state[2], CURVATURE, road)
    share, turning, follow, gain, _ = _bent(state, curvature, change, road.line)
    return share, turning, follow, gain


def table_of(road: Road, problem: ProblemSettings) -> RoadTable:
    """The table of a road for the ego of a problem.

    Raises:
        DataError: if a lane in the middle of the road begins or ends, or the road is too near to the centre of a curve.
    """
    car, cost, plain = problem.vehicle, problem.cost, vehicle_of(problem.vehicle)
    if road.line is None and road.changing is None:
        rows, none = np.array([[0.0, road.edges[0], road.edges[-1], np.inf]], dtype=float), np.zeros((0, 2))
        wanted = np.full(problem.steps + 1, cost.reference_speed)
        return RoadTable(RoadAhead(rows, 0.0, 1.0, 0.0, wanted), np.zeros(1), none, plain, plain)
    spacing = _SPACING if road.line is None else road.line.spacing * max(1, int(_SPACING / road.line.spacing))
    lon, line = spacing * np.arange(int(float(road.length) / spacing) + 2), 0.0 if road.line is None else road.line.lat
    places = np.unique(np.concatenate([lon, [] if road.changing is None else road.changing.lon]))
    edges, there = road.edges_at(places)[:, [0, -1]], road.has_lane(lon)
    first, last = there.argmax(axis=1), road.lanes - 1 - there[:, ::-1].argmax(axis=1)
    gap = there.sum(axis=1) != last - first + 1
    if gap.any():
        where = f"{lon[np.argmax(gap)]:.0f} m after its beginning"
        raise DataError(f"a lane in the middle of the road begins or ends {where}; choose a road whose lanes go on")
    curvature, aside = road.curvature(lon), float(np.abs(edges - line).max())
    sharpest = _largest(np.abs(curvature), lon, lon, _NEAR)
    most, change = sharpest.max(), np.abs(np.gradient(curvature, spacing))
    if most * aside > 0.5:
        tight = f"a curve of {1 / most:.0f} m radius on a road whose edge is {aside:.0f} m beside its line"
        raise DataError(f"{tight}; expected at most half of the radius, choose or cut another road")
    half_length, half_width = bent_half_sizes(car.half_sizes, np.hypot(*car.half_sizes), most, aside)
    reach = half_length + half_width + _UNSURE + 2 * spacing
    right, left = _largest(edges[:, 0], places, lon, reach), -_largest(-edges[:, 1], places, lon, reach)
    square = car.max_lateral_acceleration / np.maximum(np.abs(curvature) * (1 + most * aside), TINY)

    def allowed(share: float, braking: float) -> Float[np.ndarray, " R"]:
        """[m/s] from which that share of the lateral acceleration is enough all along, braking before curves."""
        limit = np.minimum(share * square, _FREE**2) + 2 * braking * lon
        return np.sqrt(np.minimum.accumulate(limit[::-1])[::-1] - 2 * braking * lon)

    held, wanted = allowed(_HELD, car.max_deceleration / 2), allowed(cost.curve_share, cost.curve_braking)
    ends = [
        [lon[i] + _BODY[0], road.edges_at(lon[i])[side] + outwards * _BODY[1]]
        for outermost, side, outwards in ((first, 0, -1), (-last, -1, 1))
        for i in np.flatnonzero(np.diff(outermost) > 0) + 1
    ]
    shift = (held**2 * change).max() * aside, car.max_speed**2 * (change.max() * aside + most * np.sin(car.max_heading))
    vehicle = plain._replace(
        length=2 * half_length,
        width=2 * half_width,
        braking=max(car.max_deceleration / (1 + most * aside) - shift[0], car.max_deceleration / 4),
    )
    faster = 1 / (1 - most * aside)
    reaching = vehicle._replace(
        max_deceleration=faster * (car.max_deceleration + shift[1]),
        max_acceleration=faster * (car.max_acceleration + shift[1]),
        max_lateral_acceleration=faster * (car.max_lateral_acceleration + car.max_speed**2 * most),
        max_speed=faster * car.max_speed,
    )
    rows = np.stack([curvature, right, left, held], axis=-1)
    wanted = np.minimum(wanted, cost.reference_speed)
    return RoadTable(
        RoadAhead(rows, 0.0, spacing, line, wanted), sharpest, np.reshape(ends, (-1, 2)), vehicle, reaching
    )


def _largest(
    values: Float[np.ndarray, " n"], places: Float[np.ndarray, " n"], lon: Float[np.ndarray, " R"], reach: float
) -> Float[np.ndarray, " R"]:
    """The largest value within a reach [m] of every row."""
    low, high = np.searchsorted(places, lon - reach), np.searchsorted(places, lon + reach, side="right")
    return np.array([values[a:b].max() for a, b in zip(low, high, strict=True)])


def ahead_of(table: RoadTable, state: Float[np.ndarray, " 4"], problem: ProblemSettings) -> RoadAhead:
    """The road as seen from a state, with the speed that is wanted as one gets along as fast as that."""
    ahead = table.ahead._replace(first=table.ahead.first - float(state[0]))
    if len(ahead.rows) == 1:
        return ahead
    lon, speed, wanted = float(state[0]), float(state[2]), np.empty(problem.steps + 1)
    faster, slower = problem.dt * problem.vehicle.max_acceleration, problem.dt * problem.cost.curve_braking
    rows = np.arange(len(ahead.wanted))
    for k in range(len(wanted)):
        wanted[k] = np.interp(lon / ahead.spacing, rows, ahead.wanted)
        speed = min(speed + faster, max(wanted[k], speed - slower))
        lon += problem.dt * speed
    return ahead._replace(wanted=wanted)


def on_road(paths: PredictedPaths, state: Float[np.ndarray, " 4"], table: RoadTable) -> PredictedPaths:
    """The paths with boxes that hold the bodies on a road that bends, and what stands where lanes end.

    Args:
        paths: with boxes as if the road were straight; those of now hold the bodies alone.
        state: of the ego; lanes that end farther ahead than `_SEEN` are left out.
        table: of the road.
    """
    ahead, half = table.ahead, paths.half_sizes
    if len(ahead.rows) == 1:
        return paths
    place = np.clip(paths.points[..., 0] / ahead.spacing, 0, len(ahead.rows) - 1).astype(int)
    curvature = table.sharpest[place].max(axis=1, initial=0.0)
    curvature[half[..., 0].max(axis=1, initial=0.0) > _NEAR - _WIDE] = table.sharpest.max()
    aside = (np.abs(paths.points[..., 1] - ahead.line) + half[..., 1]).max(axis=1, initial=0.0)
    diagonal = np.hypot(half[:, 0, 0], half[:, 0, 1])
    paths = replace(paths, half_sizes=bent_half_sizes(half, *(each[:, None] for each in (diagonal, curvature, aside))))
    ends = table.ends[(table.ends[:, 0] > state[0] - _SEEN) & (table.ends[:, 0] < state[0] + _SEEN)]
    if not len(ends):
        return paths
    points = np.repeat(ends[:, None], paths.points.shape[1], axis=1)
    standing = PredictedPaths(points, -1 - np.arange(len(ends)), np.broadcast_to(_BODY, points.shape), paths.dt)
    return joined(paths, standing)
