"""The vehicle directly behind in the own lane, which has to keep its distance (paper, Remark 2).

The paper can leave it out of the constraints (`without_follower`, ``planner.problem.obstacles.ignore_rear``). Here,
where nothing else is clear, it is taken to react as a careful driver would: it goes on at its speed for a time of
reaction, and then brakes at a given deceleration. Braking much harder in front of it is still unsafe. The rear vehicle
of responsibility-sensitive safety (Shalev-Shwartz, Shammah, Shashua 2017) does the same, but for speeding up while it
has not reacted yet.
"""

import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field

from coverdrive.paths import PredictedPaths
from coverdrive.road import Road
from coverdrive.settings import Settings


class FollowerSettings(Settings):
    """What the vehicle behind is trusted to do."""

    reaction: float = Field(default=0.5, ge=0, le=10)
    """[s] for which it goes on at its speed"""
    deceleration: float = Field(default=2.0, gt=0, le=15)
    """[m/s²] at which it brakes then, a little more than what is comfortable (1.67: Treiber, Hennecke, Helbing 2000)"""


def without_follower(state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> PredictedPaths:
    """The paths without those of the vehicle directly behind in the own lane."""
    return paths.of(~_of_follower(state, paths, road))


def with_careful_follower(
    state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road, settings: FollowerSettings
) -> PredictedPaths | None:
    """The paths, but the vehicle directly behind in the own lane reacts and brakes; None if there is none.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] of the ego.
        paths: predicted paths; all of a vehicle begin at the same point and speed.
        road: its lanes.
        settings: how the vehicle behind reacts.
    """
    follower = _of_follower(state, paths, road)
    if not follower.any():
        return None
    first = int(np.argmax(follower))
    points, half_sizes = paths.points.copy(), paths.half_sizes.copy()
    lon, lat = points[first, 0]
    speed = max(0.0, (points[first, 1, 0] - lon) / paths.dt)
    times = paths.dt * np.arange(points.shape[1])
    braking = np.clip(times - settings.reaction, 0.0, speed / settings.deceleration)
    driven = speed * np.minimum(times, settings.reaction) + (speed - settings.deceleration / 2 * braking) * braking
    points[first] = np.stack([lon + driven, np.full(len(times), lat)], axis=-1)
    half_sizes[first] = half_sizes[first, 0]
    kept = ~follower
    kept[first] = True
    return PredictedPaths(points, paths.vehicle, half_sizes, paths.dt, weight=paths.weight).of(kept)


def _of_follower(state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> Bool[np.ndarray, " S"]:
    """Which paths are those of the vehicle directly behind in the own lane."""
    now = paths.points[:, 0]
    same_lane = np.asarray(road.lane_at(now[:, 0], now[:, 1]) == road.lane_at(state[:1], state[1:2]))
    gap = np.where(same_lane & (now[:, 0] < state[0]), state[0] - now[:, 0], np.inf)
    if not np.isfinite(gap).any():
        return np.zeros(len(paths), bool)
    return paths.vehicle == paths.vehicle[np.argmin(gap)]
