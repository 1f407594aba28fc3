"""The vehicles directly ahead in every lane, or about to come there, which may brake hard whatever their sets say.

A set that is learned from what usually happens may leave out what seldom does, and it does not know who is braking
already. Responsibility-sensitive safety (Shalev-Shwartz, Shammah, Shashua 2017) asks a car to keep clear of vehicles
ahead that brake; so do plans here, wherever there is one that does, as if that were a member of their sets. Who is
about to come ahead from beside brakes on the way: those who cut in often do.

And they hold the ego up: a plan ends when an overtaking begins to pay. What comes after is told from their speeds.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from pydantic import Field

from coverdrive.compiled import compiled, lent
from coverdrive.paths import PredictedPaths
from coverdrive.road import Road
from coverdrive.settings import Settings

_LIKELIHOOD = 0.1
"""of braking, over that of the least likely member"""
_SLOW = 0.1
"""[m/s] that is divided by"""
_ON_THE_WAY = 0.4
"""[m/s] across the road of who is changing lanes; a vehicle that only might do so moves slower at first"""
_CHANGE = 2.0
"""[s] after the end of a plan when the ego can be in the next lane"""


class LeaderSettings(Settings):
    """What vehicles ahead may do besides what is predicted of them."""

    deceleration: float = Field(default=4.0, ge=0, le=15)
    """[m/s²] at which they may brake to a stop from now on, beyond which hardly anybody does in normal traffic; 0: no
    such thing is assumed"""
    foresight: float = Field(default=6.0, ge=0, le=60)
    """[s] after the end of a plan for which lanes are compared by the speeds of those ahead"""


@lent
class Leaders(NamedTuple):
    """The vehicle directly ahead in every lane that has one."""

    lane: Int[np.ndarray, " l"]
    """the lane"""
    path: Int[np.ndarray, " l"]
    """one of its paths"""
    gap: Float[np.ndarray, " l"]
    """[m] from the ego's front to its rear"""
    speed: Float[np.ndarray, " l"]
    """[m/s]"""
    entering: Int[np.ndarray, " e"]
    """a path of each vehicle that is coming into a lane from beside, ahead of the ego and of whoever else does"""

    def lost(self, there: Bool[np.ndarray, " L"], wanted: float, begin: float, end: float) -> Float[np.ndarray, " L"]:
        """What is lost of a wanted speed [m/s] in each lane, or there first and beside it then: squared [m²/s].

        Args:
            there: which lanes do not end before long.
            wanted: [m/s] at which the ego drives until it is behind the one ahead.
            begin: [s] from when it counts.
            end: [s] until when.
        """
        result = np.empty(len(there))
        _write_lost(self, there, wanted, begin, end, result)
        return result


def leaders_of(state: Float[np.ndarray, " 4"], half_length: float, paths: PredictedPaths, road: Road) -> Leaders:
    """The vehicles directly ahead.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] of the ego.
        half_length: [m] of the ego.
        paths: predicted paths; all of a vehicle begin at the same point and speed.
        road: its lanes.
    """
    now, end, lanes = paths.points[:, 0], paths.points[:, -1], road.lanes
    begun, there = road.lane_at(now[:, 0], now[:, 1]), road.lane_at(end[:, 0], end[:, 1])
    (lane, path, entering), (gap, speed) = np.empty((3, lanes), dtype=np.int64), np.empty((2, lanes))
    leading, coming = _write_leaders(
        paths.points, paths.half_sizes, begun, there, float(state[0]), half_length, paths.dt,
        lane, path, gap, speed, entering,
    )  # fmt: skip
    return Leaders(lane[:leading], path[:leading], gap[:leading], speed[:leading], entering[:coming])


@compiled
def _write_leaders(
    points: Float[np.ndarray, "S P 2"], half_sizes: Float[np.ndarray, "S P 2"], begun: Int[np.ndarray, " S"],
    there: Int[np.ndarray, " S"], lon: float, half_length: float, dt: float, lane: Int[np.ndarray, " L"],
    path: Int[np.ndarray, " L"], gap: Float[np.ndarray, " L"], speed: Float[np.ndarray, " L"],
    entering: Int[np.ndarray, " L"],
) -> tuple[int, int]:  # fmt: skip
    """Write the leaders of an ego at a position [m], given in which lanes paths begin and end; returns how many lead,
    and how many are entering.
    """
    lanes, to, leading, coming = len(lane), there.copy(), 0, 0
    for i in range(len(points)):
        if there[i] == begun[i] or not abs(points[i, 1, 1] - points[i, 0, 1]) > _ON_THE_WAY * dt:
            to[i] = -1
    nearest, first = np.full(lanes, -1), np.full(lanes, -1)
    _mark_nearest(points, begun, lon, nearest, False)
    _mark_nearest(points, to, lon, first, True)
    for each in range(lanes):
        i = nearest[each]
        if i >= 0:
            lane[leading], path[leading], begins = each, i, points[i, 0, 0]
            gap[leading] = begins - half_sizes[i, 0, 0] - lon - half_length
            speed[leading] = max(0.0, points[i, 1, 0] - begins) / dt
            leading += 1
        if first[each] >= 0:
            entering[coming] = first[each]
            coming += 1
    return leading, coming


@compiled
def _write_lost(
    leaders: Leaders, there: Bool[np.ndarray, " L"], wanted: float, begin: float, end: float,
    result: Float[np.ndarray, " L"],
) -> None:  # fmt: skip
    """Write what `Leaders.lost` returns."""
    lanes, staying, first = len(there), np.zeros(len(there)), np.zeros(len(there))
    for i in range(len(leaders.lane)):
        lane, faster = leaders.lane[i], max(wanted - leaders.speed[i], _SLOW)
        since = max(leaders.gap[i] / faster, begin)
        staying[lane] = faster * faster * max(end - since, 0.0)
        first[lane] = faster * faster * max(min(begin + _CHANGE, end) - since, 0.0)
    for lane in range(lanes):
        later = np.inf
        for beside in (lane - 1, lane + 1):
            if 0 <= beside < lanes and there[beside]:
                later = min(later, staying[beside] - first[beside])
        result[lane] = min(staying[lane], first[lane] + later)


@compiled
def _mark_nearest(
    points: Float[np.ndarray, "S P 2"], lane: Int[np.ndarray, " S"], lon: float, nearest: Int[np.ndarray, " L"],
    last: bool,
) -> None:  # fmt: skip
    """Write which path begins as the nearest ahead of a position [m] in every lane, given the lane of each, if any: the
    first or the last one of its vehicle.
    """
    for i in range(len(points)):
        if lane[i] < 0:
            continue
        best, begins = nearest[lane[i]], points[i, 0, 0]
        if begins > lon and (best < 0 or begins < points[best, 0, 0] or (last and begins == points[best, 0, 0])):
            nearest[lane[i]] = i


def braking(leaders: Leaders, paths: PredictedPaths, settings: LeaderSettings) -> PredictedPaths:
    """A path for each of them, and of who is to come ahead, on which it brakes to a stop, given those of all."""
    if settings.deceleration == 0:
        return paths.of(leaders.path[:0])
    path = np.concatenate([leaders.path, leaders.entering])
    points, half_sizes = paths.points[path], paths.half_sizes[path]
    _write_braking(points, half_sizes, len(leaders.path), settings.deceleration, paths.dt)
    least = 1.0 if paths.weight is None else float(paths.weight.min(initial=1.0))
    weight = np.full(len(points), _LIKELIHOOD * least)
    return PredictedPaths(points, paths.vehicle[path], half_sizes, paths.dt, weight=weight)


@compiled
def _write_braking(
    points: Float[np.ndarray, "l P 2"], half_sizes: Float[np.ndarray, "l P 2"], leading: int, deceleration: float,
    dt: float,
) -> None:  # fmt: skip
    """Write how vehicles brake from their speeds at the first of the points: so many in their lanes, the others on the
    way across the road that is there.
    """
    for i in range(len(points)):
        speed = max(0.0, points[i, 1, 0] - points[i, 0, 0]) / dt
        for k in range(1, points.shape[1]):
            elapsed = min(dt * k, speed / deceleration)
            points[i, k, 0] = points[i, 0, 0] + (speed - deceleration / 2 * elapsed) * elapsed
            half_sizes[i, k, 0] = half_sizes[i, 0, 0]
            if i < leading:
                points[i, k, 1], half_sizes[i, k, 1] = points[i, 0, 1], half_sizes[i, 0, 1]
