"""The member that a set has whatever was learned: a lane change that is under way goes on.

Sets that hold nine windows of ten may leave out the tenth, in which a vehicle changes lanes for everybody to see. Which
windows are missed a claim about shares does not say, but it matters to whoever drives beside them. A vehicle whose
lateral speed takes it out of its box is therefore expected, besides, in a second one: between where it comes at that
speed and where it comes if it swings further, by the width of a lane at the most unless it crosses the road. Sets only
grow by it, so that every certificate holds; it does not depend on their scale, so that they stay nested.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from coverdrive.compiled import compiled
from coverdrive.geometry import turned_extents
from coverdrive.paths import PredictedPaths
from coverdrive.scene import Scene

_SWING = 0.6
"""[m/s²] lateral acceleration of a lane change that has begun; own choice, about the largest of 3.6 m in 6 s"""
_LANE = 3.6
"""[m] that a vehicle which changes lanes comes across the road at the most (US freeways: AASHTO)"""
_STEEPEST = 0.5
"""of its speed along the road that one who changes lanes has across it; who has more crosses the road"""
_LIKELIHOOD = 0.5
"""of going on, where staying in the learned box has 1"""

_turned_extents = compiled(turned_extents)


def lane_changes(paths: PredictedPaths, scene: Scene) -> PredictedPaths:
    """A path for every vehicle of a scene that leaves the box of its one path across the road at its lateral speed."""
    now = tuple(np.ascontiguousarray(each, dtype=float) for each in scene.measures)
    points, half_sizes = np.empty_like(paths.points), np.empty_like(paths.half_sizes)
    leaving = np.zeros(len(paths), dtype=bool)
    _write_changes(now, paths.vehicle, paths.points, paths.half_sizes, paths.dt, leaving, points, half_sizes)
    weight = np.full(np.count_nonzero(leaving), _LIKELIHOOD)
    return PredictedPaths(points[leaving], paths.vehicle[leaving], half_sizes[leaving], paths.dt, weight=weight)


@compiled
def _write_changes(
    now: tuple[Float[np.ndarray, " A"], ...], vehicle: Int[np.ndarray, " S"], kept: Float[np.ndarray, "S P 2"],
    room: Float[np.ndarray, "S P 2"], dt: float, leaving: Bool[np.ndarray, " S"], points: Float[np.ndarray, "S P 2"],
    half_sizes: Float[np.ndarray, "S P 2"],
) -> None:  # fmt: skip
    """Tell who leaves boxes with these centres and half sizes across the road, and write the second ones of these.

    The measures of now are those of `Scene.measures`.
    """
    lon, lat, speed, heading, length, width = now
    for i in range(len(kept)):
        v = vehicle[i]
        along, across = speed[v] * np.cos(heading[v]), speed[v] * np.sin(heading[v])
        half_length, half_width = _turned_extents(length[v] / 2, width[v] / 2, heading[v])
        for k in range(kept.shape[1]):
            time = dt * k
            beyond = abs(lat[v] + across * time - kept[i, k, 1]) + half_width - room[i, k, 1]
            leaving[i] |= k > 0 and beyond > 0
            near = abs(across) * time
            far = near + _SWING / 2 * (time * time)
            near = near if abs(across) > _STEEPEST * abs(along) else min(near, _LANE)
            far = min(far, max(near, _LANE))
            points[i, k, 0] = lon[v] + along * time
            points[i, k, 1] = lat[v] + np.sign(across) * (near + far) / 2
            half_sizes[i, k, 0], half_sizes[i, k, 1] = half_length, half_width + (far - near) / 2
