"""The vehicles directly ahead in every lane, which may brake hard whatever their sets say.

A set that is learned from what usually happens may leave out what seldom does, and it does not know who is braking
already. Responsibility-sensitive safety (Shalev-Shwartz, Shammah, Shashua 2017) asks a car to keep clear of vehicles
ahead that brake; so do plans here, wherever there is one that does, as if that were a member of their sets. Where there
is none and the ego is much faster than the vehicle ahead, it wants to be no faster than that.
"""

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.paths import PredictedPaths
from coverdrive.road import Road
from coverdrive.settings import Settings

_LIKELIHOOD = 0.1
"""of braking, over that of the least likely member"""


class LeaderSettings(Settings):
    """What vehicles ahead may do besides what is predicted of them."""

    deceleration: float = Field(default=4.0, ge=0, le=15)
    """[m/s²] at which they may brake to a stop from now on, beyond which hardly anybody does in normal traffic; 0: no
    such thing is assumed"""
    closing: float = Field(default=5.0, ge=0, le=120)
    """[m/s] by which the ego may be faster than the vehicle directly ahead, where no plan is clear of those that brake,
    before that one's speed is all it wants"""


def braking_leaders(
    state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road, settings: LeaderSettings
) -> PredictedPaths:
    """A path for the vehicle directly ahead in every lane, on which it brakes to a stop.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] of the ego.
        paths: predicted paths; all of a vehicle begin at the same point and speed.
        road: its lanes.
        settings: how hard they brake.
    """
    now = paths.points[:, 0]
    ahead = np.flatnonzero(now[:, 0] > state[0])
    if settings.deceleration == 0 or len(ahead) == 0:
        return paths.of(ahead[:0])
    nearest_first = ahead[np.argsort(now[ahead, 0], kind="stable")]
    leaders = nearest_first[np.unique(road.lane_at(*now[nearest_first].T), return_index=True)[1]]
    speed = np.maximum(0.0, np.diff(paths.points[leaders, :2, 0])) / paths.dt
    braking = np.minimum(paths.dt * np.arange(paths.points.shape[1]), speed / settings.deceleration)
    points, half_sizes = paths.points[leaders], paths.half_sizes[leaders]
    points[..., 0] = points[:, :1, 0] + (speed - settings.deceleration / 2 * braking) * braking
    points[..., 1] = points[:, :1, 1]
    half_sizes[:] = half_sizes[:, :1]
    least = 1.0 if paths.weight is None else float(paths.weight.min())
    weight = np.full(len(leaders), _LIKELIHOOD * least)
    return PredictedPaths(points, paths.vehicle[leaders], half_sizes, paths.dt, weight=weight)


def speed_ahead(state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> float:
    """The speed [m/s] of the vehicle directly ahead in the ego's lane now; infinite without one.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] of the ego.
        paths: predicted paths.
        road: its lanes.
    """
    lon, lat = paths.points[:, 0].T
    ahead = np.flatnonzero((lon > state[0]) & (road.lane_at(lon, lat) == road.lane_at(state[0], state[1])))
    if len(ahead) == 0:
        return np.inf
    nearest = paths.points[ahead[lon[ahead].argmin()], :2, 0]
    return max(0.0, float(nearest[1] - nearest[0])) / paths.dt
