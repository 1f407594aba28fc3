"""The lanes that a plan may aim at: the own one, and the next on either side that are there as far as it gets."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.road import Road

_STEP = 5.0
"""[m] between places at which a lane is looked for"""
_AHEAD = 10.0
"""[s] of driving from which on nobody cares whether the own lane ends"""


class TargetLanes(NamedTuple):
    """L lanes, the first of which is the own one, of the R of the road."""

    lanes: list[int]
    """their indices"""
    lat: Float[np.ndarray, " L"]
    """[m] of their centres, half-way through the plan"""
    lasting: Bool[np.ndarray, " R"]
    """which lanes of the road are there and do not end before long"""
    lost: Float[np.ndarray, " R"]
    """[m²/s] speed that is lost in each lane of the road after the plan, behind whoever is ahead (`Leaders.lost`)"""


def target_lanes(state: Float[np.ndarray, " 4"], road: Road, horizon: float) -> TargetLanes:
    """The target lanes of a plan over a horizon [s] from a state (lon, lat, speed, heading); nothing lost in any."""
    lane, nothing = int(road.lane_at(state[0], state[1])), np.zeros(road.lanes)
    if road.changing is None:
        lanes = [lane, *(side for side in (lane - 1, lane + 1) if 0 <= side < road.lanes)]
        return TargetLanes(lanes, np.array(road.centres, dtype=float)[lanes], nothing == 0, nothing)
    lon, way = float(state[0]), max(float(state[2]), 0.0)
    soon, there = _all_along(road, lon, horizon * way), road.has_lane(lon)
    next_ones = np.flatnonzero(there[:lane])[-1:], lane + 1 + np.flatnonzero(there[lane + 1 :])[:1]
    lanes = [lane, *(side for side in np.concatenate(next_ones).tolist() if soon[side])]
    there = road.edges_at(lon + (horizon / 2 * way if soon[lane] else 0.0))
    return TargetLanes(lanes, ((there[:-1] + there[1:]) / 2)[lanes], _all_along(road, lon, _AHEAD * way), nothing)


def _all_along(road: Road, lon: float, way: float) -> Bool[np.ndarray, " L"]:
    """Which lanes are there all the way [m] from a position [m] on."""
    return np.all(road.has_lane(np.arange(lon, lon + way + 2 * _STEP, _STEP)), axis=0)
