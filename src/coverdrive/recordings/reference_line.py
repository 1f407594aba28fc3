"""A smooth line along a road, and the road frame (lon, lat) of points beside it.

In map coordinates the line is east·t + f(t)·n over the direction t from its first to its last point, where f is a
cubic smoothing spline; beyond both ends it goes on straight. P is the number of points.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.interpolate import BSpline, make_smoothing_spline

SPACING = 1.0
"""[m] between the points that the spline is fitted to"""

SHORTEST_BEND = 80.0
"""[m] wave length below which bends are smoothed out: kinks of a drawn map, not of a freeway"""

BEND_SPACING = 15.0
"""[m] between the points whose directions tell whether a road bends; shorter kinks are those of a drawn map"""

LARGEST_BEND = 15.0
"""[degrees] between any two directions of a road that still counts as straight; the recorded scenes of US-101 bend
by at most 8°, roads of junctions by 40° and more"""


@dataclass(frozen=True)
class ReferenceLine:
    """Origin of the road frame: lon is measured along the line, lat from it to the left."""

    start: Float[np.ndarray, " 2"]
    """[m] where the line starts, in map coordinates"""
    along: Float[np.ndarray, " 2"]
    """unit vector from the first to the last point"""
    offset: BSpline
    """[m] to the left of the chord, over the distance [m] along it"""
    chord: float
    """[m] distance of the ends"""
    arc: Float[np.ndarray, " G"]
    """[m] length of the line up to each of G points that are evenly spaced along the chord"""

    @property
    def left(self) -> Float[np.ndarray, " 2"]:
        """Unit vector to the left of the chord."""
        return np.array([-self.along[1], self.along[0]])

    @property
    def length(self) -> float:
        """Length of the line [m]."""
        return float(self.arc[-1])

    def project(self, points: Float[np.ndarray, "P 2"]) -> Float[np.ndarray, "P 2"]:
        """Road frame (lon, lat) [m] of points [m] in map coordinates, with lat = 0 on the line."""
        relative = points - self.start
        u = relative @ self.along
        v = relative @ self.left
        foot = u
        for _ in range(10):  # Newton steps towards (u − foot) + (v − f)·f' = 0; the line is nearly straight
            value, slope, bend = self._line(foot)
            foot = foot + (u - foot + (v - value) * slope) / (1 + slope**2 - (v - value) * bend)
        value, slope, _ = self._line(foot)
        inside = np.clip(foot, 0.0, self.chord)
        arc = np.interp(inside, np.linspace(0.0, self.chord, len(self.arc)), self.arc)
        stretch = np.sqrt(1 + slope**2)
        return np.stack([arc + (foot - inside) * stretch, (v - value) * stretch], axis=-1)

    def _line(self, foot: Float[np.ndarray, " P"]) -> tuple[Float[np.ndarray, " P"], ...]:
        """Offset, slope and second derivative, extended straight."""
        inside = np.clip(foot, 0.0, self.chord)
        slope = self.offset(inside, 1)
        bend = np.where(inside == foot, self.offset(inside, 2), 0.0)
        return self.offset(inside) + slope * (foot - inside), slope, bend


def bend(points: Float[np.ndarray, "P 2"]) -> float:
    """Largest angle [rad] between two directions of the polyline through points [m], taken every `BEND_SPACING`."""
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    apart = np.insert(np.diff(way) > 0, 0, True)
    grid = np.linspace(0.0, way[-1], max(2, round(way[-1] / BEND_SPACING) + 1))
    x, y = (np.interp(grid, way[apart], values[apart]) for values in points.T)
    return float(np.ptp(np.unwrap(np.arctan2(np.diff(y), np.diff(x)))))


def reference_line(points: Float[np.ndarray, "P 2"]) -> ReferenceLine:
    """The smooth line along points [m] in map coordinates, in the order of travel."""
    start = points[0]
    chord = float(np.hypot(*(points[-1] - start)))
    along = (points[-1] - start) / chord
    relative = points - start
    u, v = relative @ along, relative @ np.array([-along[1], along[0]])
    order = np.argsort(u, kind="stable")
    grid = np.linspace(0.0, chord, max(6, round(chord / SPACING) + 1))
    stiffness = (SHORTEST_BEND / (2 * np.pi)) ** 4 / (grid[1] - grid[0])
    offset = make_smoothing_spline(grid, np.interp(grid, u[order], v[order]), lam=stiffness)
    steps = np.hypot(np.diff(grid), np.diff(offset(grid)))
    return ReferenceLine(start, along, offset, chord, np.concatenate([[0.0], np.cumsum(steps)]))
