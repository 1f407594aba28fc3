"""The member that a set has whatever was learned: a lane change that is under way goes on.

Sets that hold nine windows of ten may leave out the tenth, in which a vehicle changes lanes for everybody to see. Which
windows are missed a claim about shares does not say, but it matters to whoever drives beside them. A vehicle whose
lateral speed takes it out of its box is therefore expected, besides, in a second one: between where it comes at that
speed and where it comes if it swings further, by the width of a lane at the most. Sets only grow by it, so that every
certificate holds; it does not depend on their scale, so that they stay nested.
"""

import numpy as np

from coverdrive.geometry import turned_extents
from coverdrive.paths import PredictedPaths
from coverdrive.scene import Scene

_SWING = 0.6
"""[m/s²] lateral acceleration of a lane change that has begun; own choice, about the largest of 3.6 m in 6 s"""
_LANE = 3.6
"""[m] that a vehicle comes across the road at the most (US freeways: AASHTO)"""
_LIKELIHOOD = 0.5
"""of going on, where staying in the learned box has 1"""


def lane_changes(paths: PredictedPaths, scene: Scene) -> PredictedPaths:
    """A path for every vehicle that leaves its box across the road at its lateral speed.

    Args:
        paths: S paths, one for each vehicle.
        scene: from which they were predicted.
    """
    times = paths.dt * np.arange(paths.points.shape[1])
    lon, lat, speed, heading, length, width = (np.asarray(each)[paths.vehicle, None] for each in scene.measures)
    half_length, half_width = turned_extents(length / 2, width / 2, heading)
    across = speed * np.sin(heading)
    reach = np.abs(lat + across * times - paths.points[..., 1]) + half_width - paths.half_sizes[..., 1]
    leaving = np.flatnonzero((reach[:, 1:] > 0).any(1))
    near = np.abs(across[leaving]) * times
    near, far = (np.minimum(way, _LANE) for way in (near, near + _SWING / 2 * times**2))
    straight = lon[leaving] + speed[leaving] * np.cos(heading[leaving]) * times
    swung = lat[leaving] + np.sign(across[leaving]) * (near + far) / 2
    centre = np.stack([straight, swung], axis=-1)
    half_sizes = np.empty_like(centre)
    half_sizes[..., 0], half_sizes[..., 1] = half_length[leaving], half_width[leaving] + (far - near) / 2
    weight = np.full(len(leaving), _LIKELIHOOD)
    return PredictedPaths(centre, paths.vehicle[leaving], half_sizes, paths.dt, weight=weight)
