"""Whether vehicles are where they were predicted to be."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.geometry import turned_half_extents
from coverdrive.paths import PredictedPaths

_TOLERANCE = 0.01
"""[m] by which a body may leave a box, because between two steps of a simulation its position is not exact"""

_ROUNDING = 1e-6
"""of a number of steps"""


def every(step: float, paths: PredictedPaths) -> PredictedPaths:
    """Paths with points ``step`` [s] apart, on the lines between those that they have."""
    last = paths.points.shape[1] - 1
    moments = step * np.arange(int(last * paths.dt / step + _ROUNDING) + 1) / paths.dt
    before = np.minimum(np.floor(moments + _ROUNDING).astype(int), last - 1)
    share = (moments - before)[:, None]
    fields = {
        name: (1 - share) * values[:, before] + share * values[:, before + 1]
        for name in ("points", "half_sizes", "ellipses")
        if (values := getattr(paths, name)) is not None
    }
    return replace(paths, **fields, dt=step)


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
