"""Behind somebody who is far slower: how fast to come up to it while the lane beside may not be free in time.

A plan ends long before an ego at 30 m/s comes to what stands in its lane. If it drives as fast as it can until then, it
brakes hard, or has to find a gap among those beside that are slower by as much. So it wants the greater of two speeds
at the most: that from which it comes up calmly, and a little more than those beside drive at.
"""

import math

import numpy as np
from jaxtyping import Float

from coverdrive.paths import PredictedPaths
from coverdrive.planning.rules.leaders import Leaders
from coverdrive.road import Road

_FAR_SLOWER = 0.5
"""share of the ego's speed"""
_FASTER = 1.1
"""times as fast as those beside it may be, to find a gap"""
_BEHIND, _AHEAD = 30.0, 120.0
"""[m] within which others in the lane beside count that are not as slow; where nobody is, the one ahead does"""
_DECELERATION, _LAG, _ROOM = 2.0, 1.5, 8.0
"""[m/s²] of people who have time to brake, [s] until it is reached, and [m] that are left at the end"""


def approach(
    state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road, lanes: list[int], leaders: Leaders
) -> float:
    """Speed [m/s] that is wanted at the most; inf if nobody who is far slower is ahead, or a lane beside is free.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] of the ego.
        paths: predicted paths; all of a vehicle begin at the same point and speed.
        road: its lanes.
        lanes: that of the ego, followed by those that it can change to.
        leaders: who is ahead in every lane.
    """
    far_slower = _FAR_SLOWER * state[2]
    if not ((leaders.lane == lanes[0]) & (leaders.speed <= far_slower)).any():
        return math.inf
    lag, left = _DECELERATION * _LAG, np.maximum(leaders.gap - _ROOM, 0.0)
    calm = leaders.speed + np.sqrt(lag**2 + 2 * _DECELERATION * left) - lag
    behind = dict(zip(leaders.lane.tolist(), calm.tolist(), strict=True))
    fastest = behind[lanes[0]]
    now, speed = paths.points[:, 0], (paths.points[:, 1, 0] - paths.points[:, 0, 0]) / paths.dt
    near = (now[:, 0] > state[0] - _BEHIND) & (now[:, 0] < state[0] + _AHEAD) & (speed > far_slower)
    lane, speed = road.lane_at(now[near, 0], now[near, 1]), speed[near]
    for beside in lanes[1:]:
        there = lane == beside
        fastest = max(fastest, _FASTER * float(speed[there].max()) if there.any() else behind.get(beside, math.inf))
    return fastest
