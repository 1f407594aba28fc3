"""Vehicles that vanish: for a short time they are taken to be on one of the paths that were last predicted for them."""

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.compiled import compiled
from coverdrive.paths import PredictedPaths

_FASTEST = 150.0
"""[m/s] along the road or across it"""


class PathMemory:
    """Remembers every vehicle's last predicted paths."""

    def __init__(self, grace: float, period: float):
        """Keep the paths of a vehicle for ``grace`` [s] after it was last seen; a call comes every ``period`` [s]."""
        self._grace, self._period = grace, period
        self._last: PredictedPaths | None = None
        self._ages: dict[int, float] = {}

    def completed(self, paths: PredictedPaths) -> tuple[PredictedPaths, bool]:
        """The paths of now, with those of vehicles that vanished or whose numbers cannot be true taken from memory.

        Returns:
            The paths, all finite, and whether every vehicle among ``paths`` is represented.
        """
        broken: set[int] = set()
        paths = _plain(paths)
        possible = np.empty(len(paths), dtype=bool)
        _mark_possible(paths.points, paths.half_sizes, _FASTEST * paths.dt, possible)
        if not possible.all():
            broken = set(paths.vehicle[~possible].tolist())
            paths = paths.of(~np.isin(paths.vehicle, list(broken)))
        seen = set(paths.vehicle.tolist())
        ages = {vehicle: age + self._period for vehicle, age in self._ages.items() if vehicle not in seen}
        kept = [vehicle for vehicle, age in ages.items() if age <= self._grace + 1e-9]
        if kept and self._last is not None:
            paths = paths.joined(later(self._last.of(np.isin(self._last.vehicle, kept)), self._period))
        self._last = paths
        self._ages = dict.fromkeys(seen, 0.0) | {vehicle: ages[vehicle] for vehicle in kept}
        return paths, broken <= self._ages.keys()

    def shift(self, paths: PredictedPaths) -> Float[np.ndarray, " 2"]:
        """By how much [m] along lon and lat vehicles are now elsewhere than remembered: the median, 0 without any."""
        if self._last is None:
            return np.zeros(2)
        expected = later(self._last, self._period)
        moved = [
            (paths.points[paths.vehicle == each, 0] - expected.points[expected.vehicle == each, 0][:1]).mean(0)
            for each in np.intersect1d(paths.vehicle, expected.vehicle)
        ]
        return np.median(moved, axis=0) if moved else np.zeros(2)


def _plain(paths: PredictedPaths) -> PredictedPaths:
    """The same in arrays of one type and layout, for which compiled functions were compiled at the planner's reset."""
    points, half_sizes = (np.ascontiguousarray(each, dtype=float) for each in (paths.points, paths.half_sizes))
    weight = None if paths.weight is None else np.ascontiguousarray(paths.weight, dtype=float)
    vehicle = np.ascontiguousarray(paths.vehicle, dtype=np.int64)
    return PredictedPaths(points, vehicle, half_sizes, paths.dt, paths.ellipses, weight)


@compiled
def _mark_possible(
    points: Float[np.ndarray, "S P 2"], half_sizes: Float[np.ndarray, "S P 2"], most: float,
    possible: Bool[np.ndarray, " S"],
) -> None:  # fmt: skip
    """Tell which paths have finite sizes above 0 and no step beyond a length [m]; what is not a number fails."""
    for i in range(len(points)):
        possible[i] = True
        for k in range(points.shape[1]):
            for axis in range(2):
                possible[i] &= 0 < half_sizes[i, k, axis] < np.inf
                if k > 0:
                    possible[i] &= abs(points[i, k, axis] - points[i, k - 1, axis]) <= most


def later(paths: PredictedPaths, elapsed: float) -> PredictedPaths:
    """The paths as seen ``elapsed`` [s] later: interpolated, and continued at the velocity and growth of their end."""
    steps = paths.points.shape[1] - 1
    at = np.arange(steps + 1) + elapsed / paths.dt
    before = np.minimum(at.astype(int), steps - 1)
    share = (at - before)[:, None]
    points, sizes = (
        values[:, before] + share * (values[:, before + 1] - values[:, before])
        for values in (paths.points, paths.half_sizes)
    )
    sizes = np.maximum(sizes, np.minimum(paths.half_sizes[:, before], paths.half_sizes[:, before + 1]))
    return PredictedPaths(points, paths.vehicle, sizes, paths.dt, weight=paths.weight)
