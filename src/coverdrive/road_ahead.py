"""The road as compiled code sees it: its curvature, edges and the speed that holds it, and what bends do to a car.

The road frame is flat for the planner: speed and heading are those of (lon, lat), so that lon' = u·cos χ and
lat' = u·sin χ on any road. `bent` says what the real car does then, which is what the limits are about. R rows.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.ndimage import maximum_filter1d

from coverdrive.compiled import compiled
from coverdrive.road import Road

CURVATURE, RIGHT, LEFT, FASTEST = range(4)
"""columns of `RoadAhead.rows`"""
_APART = 0.5
"""[m] between places whose curvatures tell how it changes"""
TINY = 1e-9
"""[m/s] of a speed that is divided by"""
State = tuple[float, float, float, float]
"""lon [m], lat [m], speed [m/s], heading [rad]"""
Bend = tuple[float, float, float, float]
"""ρ, m, c [1/m] and D [m/s²] of `bent`"""
LANE_END = np.array([2.0, 1.5])
"""[m] half sizes of what stands where a lane ends, beside the road"""
STRAIGHT: Bend = (1.0, 1.0, 0.0, 0.0)
"""`bend_at` of a straight road"""


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


def bent_on(state: Any, road: Road) -> tuple[Any, Any, Any, Any, Any]:
    """`bent` at a state of numbers or arrays on a road."""
    if road.line is None:
        return *STRAIGHT, 0.0
    change = (road.curvature(state[0] + _APART / 2) - road.curvature(state[0] - _APART / 2)) / _APART
    return bent(state, road.curvature(state[0]), change, road.line.lat)


class Controls(NamedTuple):
    """What a real car does, or is to do."""

    speed: Any
    """[m/s]"""
    acceleration: Any
    """[m/s²]"""
    yaw_rate: Any
    """[rad/s]"""
    steering: Any
    """[rad] of the wheels"""


def controls(
    state: Float[np.ndarray, "*n 4"], inputs: Float[np.ndarray, "*n 2"], road: Road, wheelbase: float
) -> Controls:
    """What inputs in the road frame are for the real car, at the moment; exact, as `bent`.

    Args:
        state: lon [m], lat [m], speed [m/s] and heading [rad] of (lon, lat).
        inputs: their rates: acceleration [m/s²], yaw rate [rad/s].
        road: that the car is on.
        wheelbase: [m] of the car.
    """
    lon, lat, speed, heading = (state[..., i] for i in range(4))
    share, ease, follow, gain, swing = bent_on((lon, lat, speed, heading), road)
    real, turn = share * speed, share * (inputs[..., 1] / ease + speed * follow)
    acceleration = share * inputs[..., 0] + speed * swing * inputs[..., 1] + gain
    bend = np.where(real > TINY, turn / np.maximum(real, TINY), follow)
    return Controls(real, acceleration, turn, np.arctan(wheelbase * bend))


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
def bend_at(state: State, dt: float, road: RoadAhead) -> Bend:
    """`bent` at a state, for the road half a step of dt [s] further on."""
    curvature, change = value_at(state[0] + dt / 2 * state[2], CURVATURE, road)
    share, turning, follow, gain, _ = _bent(state, curvature, change, road.line)
    return share, turning, follow, gain


def lane_ends(road: Road, lon: Float[np.ndarray, " R"]) -> Float[np.ndarray, "E 2"]:
    """Where [m] something stands because an outer lane ends between two of these positions [m].

    Where one in the middle ends, those beside it come together, and nothing stands.
    """
    there = road.has_lane(lon)
    first, last = there.argmax(axis=1), road.lanes - 1 - there[:, ::-1].argmax(axis=1)
    found = [
        [lon[i] + LANE_END[0], road.edges_at(lon[i])[side] + outwards * LANE_END[1]]
        for outermost, side, outwards in ((first, 0, -1), (-last, -1, 1))
        for i in np.flatnonzero(np.diff(outermost) > 0) + 1
    ]
    return np.reshape(found, (-1, 2))


def largest_within(values: Float[np.ndarray, "R *n"], reach: float) -> Float[np.ndarray, "R *n"]:
    """The largest values within a reach [rows] of every row."""
    return maximum_filter1d(values, 2 * int(np.ceil(reach)) + 1, axis=0, mode="nearest")


def innermost_edges(road: Road, lon: Float[np.ndarray, " R"]) -> Float[np.ndarray, "R 2"]:
    """lat [m] of the right edge and −lat of the left one beside every row, at the most up to the rows beside it."""
    signs, kinks = np.array([1.0, -1.0]), np.zeros(0) if road.changing is None else road.changing.lon
    result = road.edges_at(lon)[:, [0, -1]] * signs
    before = np.clip(np.searchsorted(lon, kinks) - 1, 0, len(lon) - 2)
    for row in (before, before + 1):
        np.maximum.at(result, row, road.edges_at(kinks)[:, [0, -1]] * signs)
    return result
