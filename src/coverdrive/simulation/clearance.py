"""How far paths stay clear of each other and of the road's edges: the collision check of the traffic (paper §5).

Bodies are boxes along the road that hold the turned vehicles. M paths, B other vehicles, n times.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from coverdrive.geometry import axis_gap, turned_half_extents
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.initial import EGO

Paths = Float[np.ndarray, "M n 4"]


def clearance(
    paths: Paths,
    half_size: Float[np.ndarray, " 2"],
    others: Float[np.ndarray, "B n 4"],
    half_sizes: Float[np.ndarray, "B 2"],
) -> Float[np.ndarray, " M"]:
    """Least distance [m] of a vehicle's paths to all others at the same times; infinite without any.

    It is that along lon or lat, whichever is larger; negative where bodies overlap.
    """
    extent = turned_half_extents(half_size, paths[..., 3])
    extents = turned_half_extents(half_sizes[:, None], others[..., 3])
    apart = axis_gap(paths[:, None, :, :2], others[..., :2], extent[:, None], extents)
    return apart.max(-1).min(axis=(1, 2), initial=np.inf)


def road_clearance(paths: Paths, half_size: Float[np.ndarray, " 2"], road: Road) -> Float[np.ndarray, " M"]:
    """How far every path stays on the road [m]; negative: the body leaves it, further than it is off at the start."""
    extent = turned_half_extents(half_size, paths[..., 3])[..., 1]
    lat = paths[..., 1]
    inside = np.minimum(lat - extent - road.edges[0], road.edges[-1] - lat - extent)
    return inside[:, 1:].min(1) - np.minimum(inside[:, 0], 0.0)


def directly_in_front(scene: Scene, road: Road) -> Bool[np.ndarray, " A"]:
    """Whether the ego is the nearest vehicle ahead in the same lane, for every slot."""
    lane: Int[np.ndarray, " A"] = np.asarray(road.lane_of(np.asarray(scene.lat)))
    ahead = np.asarray(scene.lon) - np.asarray(scene.lon)[:, None]
    candidate = (lane == lane[:, None]) & (ahead > 0) & scene.valid
    ahead = np.where(candidate, ahead, np.inf)
    return candidate[:, EGO] & (ahead[:, EGO] == ahead.min(1))
