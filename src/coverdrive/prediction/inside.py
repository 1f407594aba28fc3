"""Whether vehicles are where they were predicted to be."""

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.geometry import turned_half_extents
from coverdrive.paths import PredictedPaths

_TOLERANCE = 0.01
"""[m] by which a body may leave a box, because between two steps of a simulation its position is not exact"""


def inside(
    paths: PredictedPaths,
    first: int,
    poses: Float[np.ndarray, "K S 3"],
    half_sizes: Float[np.ndarray, "S 2"],
    boxes: bool = False,
) -> Bool[np.ndarray, "K S"]:
    """Whether poses are in the boxes of the paths, and in their ellipses unless ``boxes``.

    Args:
        paths: S paths.
        first: the point of the paths that the first poses belong to; the others follow.
        poses: centre (lon, lat) [m] and heading [rad] of the vehicle of each path.
        half_sizes: [m] half length and half width of these vehicles.
        boxes: whether their bodies alone count.
    """
    points, limits = (each[:, first : first + len(poses)].swapaxes(0, 1) for each in (paths.points, paths.half_sizes))
    apart = poses[..., :2] - points
    within = (np.abs(apart) + turned_half_extents(half_sizes, poses[..., 2]) <= limits + _TOLERANCE).all(-1)
    if not boxes and paths.ellipses is not None:
        axes = np.maximum(paths.ellipses[:, first : first + len(poses)].swapaxes(0, 1), _TOLERANCE)
        within &= ((apart / axes) ** 2).sum(-1) <= 1.0
    return within
