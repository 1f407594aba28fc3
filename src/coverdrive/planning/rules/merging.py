"""Out of a lane that ends, into a gap beside: how fast to drive until it is alongside, and what distance to keep there.

A plan ends long before most gaps are reached. So who is in a lane that ends, next to one that does not, wants the speed
that leads it to the gap that takes least, as if all beside kept theirs; and in a gap that is shorter than manners ask
for, it asks for as much less, as people do.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.paths import PredictedPaths
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.road import Road

_AHEAD, _STEP = 15.0, 5.0
"""[s] of driving from which on nobody cares whether the lane ends, and [m] between places at which it is looked for"""
_APPROACH, _SOON = 4.0, 1.0
"""[s] in which the way to a gap falls to 1 / e, and the least, where there is little time"""
_CHANGE = 3.0
"""[s] of driving before the end, in which the lane is changed"""
_LEAST = 0.3
"""share of the asked headway that a gap has to leave"""
_SLOWEST = 0.5
"""share of the speed of a gap that is wanted at the least"""
_ROLLING = 1.0
"""[m/s] that is divided by"""


class Merge(NamedTuple):
    """What is wanted until the lane is changed."""

    speed: float
    """[m/s] at the most"""
    headway: float
    """[s] to who is ahead, and to leave to who is behind"""


def merge(
    state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road, lanes: list[int], problem: ProblemSettings,
    headway: float,
) -> Merge | None:  # fmt: skip
    """What an ego wants that is, in part or wholly, in a lane that ends; None if it is in none, or cannot leave it.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] of the ego.
        paths: predicted paths; all of a vehicle begin at the same point and speed.
        road: its lanes.
        lanes: that of the ego, followed by those that it can change to.
        problem: of the ego.
        headway: [s] that manners ask for.
    """
    if road.changing is None:
        return None
    lon, lat, speed = float(state[0]), float(state[1]), max(float(state[2]), 0.0)
    places, edges = np.arange(0.0, _AHEAD * speed + _STEP, _STEP), road.edges_at(lon)
    there = road.has_lane(lon + places)
    touched = there[0] & (edges[:-1] < lat + problem.vehicle.width / 2) & (edges[1:] > lat - problem.vehicle.width / 2)
    lasting = np.all(there, axis=0)
    beside = lanes[:1] if lasting[lanes[0]] else [lane for lane in lanes if lasting[lane]]
    if lasting[touched].all() or not beside:
        return None
    left = float(places[there[:, touched].all(1).argmin()])
    now, end = paths.points[:, 0], paths.points[:, -1]
    begun, ends = road.lane_at(now[:, 0], now[:, 1]), road.lane_at(end[:, 0], end[:, 1])
    found = [_best_gap((begun == lane) | (ends == lane), paths, lon, left, problem, headway) for lane in beside]
    return min(found, key=lambda each: each[0])[1]


def _best_gap(
    there: Bool[np.ndarray, " S"], paths: PredictedPaths, lon: float, left: float, problem: ProblemSettings,
    headway: float,
) -> tuple[float, Merge | None]:  # fmt: skip
    """How far it is to the gap that takes least, between paths that are there, and what is wanted on the way, if that
    is anything: from a lon [m], with so much [m] left of the lane.
    """
    if not there.any():
        return 0.0, None
    which = np.flatnonzero(there)[np.argsort(paths.points[there, 0, 0])]
    place, inflation = paths.points[which, 0, 0] - lon, problem.obstacles.inflation
    reach = problem.vehicle.length / 2 + paths.half_sizes[which, -1, 0]
    rate = np.maximum(paths.points[which, 1, 0] - paths.points[which, 0, 0], 0.0) / paths.dt
    behind, ahead = np.append(-np.inf, place), np.append(place, np.inf)
    before, after = np.append(reach[0], reach), np.append(reach, reach[-1])
    leads = np.append(rate, rate[-1])
    flow = np.maximum(np.minimum(leads, (leads + np.append(rate[0], rate)) / 2), _ROLLING)
    asked = inflation * (headway * flow + before), inflation * (headway * flow + after)
    share = np.minimum((ahead - behind) / (asked[0] + asked[1]), 1.0)
    way = np.maximum(behind + share * asked[0], 0.0) + np.minimum(ahead - share * asked[1], 0.0)
    kept = share * headway - (1 - share) * np.maximum(before, after) / flow
    time = (left - way) / flow - _CHANGE
    possible = (kept > _LEAST * headway) & ((time > 0) | (way == 0))
    takes = np.where(possible, np.abs(way) + (1 - share) * (asked[0] + asked[1]), np.inf)
    i = int(takes.argmin())
    if takes[i] == np.inf:
        return np.inf, None
    wanted = flow[i] + (ahead[i] - share[i] * asked[1][i]) / min(max(time[i], _SOON), _APPROACH)
    return float(takes[i]), Merge(float(max(wanted, _SLOWEST * flow[i])), float(kept[i]))
