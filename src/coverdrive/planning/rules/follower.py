"""The vehicle directly behind in the own lane, which has to keep its distance (paper, Remark 2)."""

import numpy as np
from jaxtyping import Float

from coverdrive.paths import PredictedPaths
from coverdrive.road import Road


def without_follower(state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> PredictedPaths:
    """The paths without those of that vehicle, which ``planner.problem.obstacles.ignore_rear`` asks for.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] of the ego.
        paths: predicted paths; all of a vehicle begin at the same point.
        road: its lanes.
    """
    now = paths.points[:, 0]
    same_lane = np.asarray(road.lane_at(now[:, 0], now[:, 1]) == road.lane_at(state[:1], state[1:2]))
    gap = np.where(same_lane & (now[:, 0] < state[0]), state[0] - now[:, 0], np.inf)
    return paths.of(paths.vehicle != paths.vehicle[np.argmin(gap)]) if np.isfinite(gap).any() else paths
