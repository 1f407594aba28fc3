"""The line along which a road is measured: a curve of piecewise linear curvature, and the frame beside it.

Such a curve is a chain of clothoids, as roads are built. Its heading is the integral of the curvature, exactly, and its
points are the integral of the heading's direction (`_within`); lon is its arc length. A point of the map lies in the
road frame where its foot on the line is, found by Newton's method from the nearest of the line's points; beyond both
ends the line goes on straight. P is the number of points between which the curvature is linear.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import jax
import numpy as np
from jax import Array
from jaxtyping import Float

from coverdrive.compiled import compiled
from coverdrive.errors import DataError

SMALLEST_RADIUS = 20.0
"""[m] of a road that this package is for; loops of junctions that are driven slowly have about as much"""

WIDEST_STEP, MOST_TURNED = 2.0, 0.05
"""[m], [rad] between two points of a line: what it goes on and what its direction turns by, at the most"""

_LEAF = 3.0
"""[m] to both sides: a stretch so short lies within 0.25 m of a straight one"""

Numbers = Any
"""NumPy arrays of any shape, and numbers"""


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False)
class ReferenceLine:
    """A smooth curve in map coordinates, in the direction of travel."""

    start: Float[np.ndarray, " 2"]
    """[m] its first point in map coordinates, x to the east, y to the north"""
    heading: float
    """[rad] of its first point, counter-clockwise from the map's x axis"""
    curvature: Float[Array | np.ndarray, " P"]
    """[1/m] at points evenly spaced along it, positive where it turns left"""
    length: float
    """[m]"""
    lat: float = 0.0
    """[m] where it lies in the road frame"""

    def __post_init__(self) -> None:
        """Refuse a curve that is too tight for a road."""
        if isinstance(self.curvature, np.ndarray):  # JAX puts other things into the fields
            if len(self.curvature) < 2:
                raise DataError("a line has the curvature at two points at least; give more")
            tightest = float(np.max(np.abs(self.curvature)))
            if not tightest * SMALLEST_RADIUS <= 1 + 1e-9:
                where = int(np.argmax(np.abs(self.curvature))) * self.spacing
                problem = f"a curve of {1 / tightest:.0f} m radius, {where:.0f} m after the road's beginning"
                raise DataError(f"{problem}; expected at least {SMALLEST_RADIUS:g} m, choose or cut another road")
            widest = min(WIDEST_STEP, MOST_TURNED / max(tightest, 1e-9))
            if not 0 < self.spacing <= widest * (1 + 1e-9):
                problem = f"the curvature of the line is given every {self.spacing:g} m"
                raise DataError(f"{problem}; expected more than 0 and at most {widest:.3g} m: give more points")

    @property
    def spacing(self) -> float:
        """[m] between two points."""
        return self.length / (len(self.curvature) - 1)

    @cached_property
    def nodes(self) -> Float[np.ndarray, "P 7"]:
        """Position x, y [m], direction (cosine, sine), heading [rad], curvature [1/m] and its change of its points."""
        nodes, (x, y) = np.empty((len(self.curvature), 7)), map(float, self.start)
        _fill_nodes(x, y, float(self.heading), np.asarray(self.curvature), self.spacing, nodes)
        return nodes

    @property
    def bend(self) -> float:
        """Largest angle [rad] between any two of its directions."""
        return float(np.ptp(self.nodes[:, 4]))

    def to_road(self, x: Numbers, y: Numbers) -> tuple[Numbers, Numbers]:
        """Road frame (lon, lat) [m] of points [m] in map coordinates.

        Exact, and the inverse of `to_map`, where the line is nearer than its centre of curvature.
        """
        return self._each(_to_road, x, y)

    def to_map(self, lon: Numbers, lat: Numbers) -> tuple[Numbers, Numbers]:
        """Map coordinates (x, y) [m] of points [m] in the road frame."""
        return self._each(_to_map, lon, lat)

    def heading_at(self, lon: Numbers) -> Numbers:
        """[rad] of the line at positions [m], continuous along it, counter-clockwise from the map's x axis."""
        return self._each(_direction, lon, np.zeros_like(lon))[0]

    def curvature_at(self, lon: Numbers) -> Numbers:
        """[1/m] of the line at positions [m]; 0 beyond its ends."""
        return self._each(_direction, lon, np.zeros_like(lon))[1]

    def mirrored(self) -> "ReferenceLine":
        """The same with left and right exchanged, in a map whose y axis points the other way."""
        return replace(
            self,
            start=self.start * np.array([1.0, -1.0]),
            heading=-self.heading,
            curvature=-self.curvature,
            lat=-self.lat,
        )

    def _each(self, function: Callable[..., None], first: Any, second: Any) -> tuple[Numbers, Numbers]:
        """What a compiled function makes of every pair of numbers, of any shape."""
        pairs = np.broadcast_arrays(np.asarray(first, dtype=float), np.asarray(second, dtype=float))
        flat = [np.ascontiguousarray(values).ravel() for values in pairs]
        results = np.empty((2, len(flat[0])))
        function(*flat, self.nodes, self.spacing, self.lat, results)
        shaped = results.reshape(2, *pairs[0].shape)
        return shaped[0], shaped[1]


@compiled
def _within(way: float, curvature: float, change: float) -> tuple[float, float, float]:
    """How far ahead, to the left [m] and turned [rad] one is after a way [m] along a clothoid that begins straight on.

    By Gauss–Legendre quadrature of three points, with sines and cosines as series: over a turn of 0.05 rad the error is
    below 1e-10 of the way.
    """
    ahead, left = 0.0, 0.0
    for place, weight in (
        (0.1127016653792583, 0.2777777777777778),
        (0.5, 0.4444444444444444),
        (0.8872983346207417, 0.2777777777777778),
    ):
        at = place * way
        angle = at * (curvature + change * at / 2)
        square = angle * angle
        ahead += weight * (1 - square * (1 / 2 - square * (1 / 24)))
        left += weight * angle * (1 - square * (1 / 6 - square * (1 / 120)))
    return way * ahead, way * left, way * (curvature + change * way / 2)


@compiled
def _fill_nodes(x: float, y: float, heading: float, curvature: np.ndarray, spacing: float, nodes: np.ndarray) -> None:
    for i in range(len(curvature)):
        cosine, sine = np.cos(heading), np.sin(heading)
        nodes[i, 0], nodes[i, 1], nodes[i, 2], nodes[i, 3] = x, y, cosine, sine
        nodes[i, 4], nodes[i, 5], nodes[i, 6] = heading, curvature[i], 0.0
        if i + 1 < len(curvature):
            nodes[i, 6] = change = (curvature[i + 1] - curvature[i]) / spacing
            ahead, left, turned = _within(spacing, curvature[i], change)
            x += ahead * cosine - left * sine
            y += ahead * sine + left * cosine
            heading += turned


@compiled
def _at(lon: float, nodes: np.ndarray, spacing: float) -> tuple[float, float, float, float, float, float]:
    """Position x, y [m], direction (cosine, sine), heading [rad] and curvature [1/m] of the line at a position [m]."""
    last = len(nodes) - 1
    i = min(max(int(np.floor(lon / spacing)), 0), last)
    way, curvature, change = lon - i * spacing, 0.0, 0.0
    if way >= 0 and (i < last or way < 1e-9):  # the last point, but nothing beyond
        curvature, change = nodes[i, 5], nodes[i, 6]
    ahead, left, turned = _within(way, curvature, change)
    along, across = nodes[i, 2], nodes[i, 3]
    square = turned * turned
    cosine = 1 - square * (1 / 2 - square * (1 / 24))
    sine = turned * (1 - square * (1 / 6 - square * (1 / 120)))
    return (
        nodes[i, 0] + ahead * along - left * across,
        nodes[i, 1] + ahead * across + left * along,
        along * cosine - across * sine,
        across * cosine + along * sine,
        nodes[i, 4] + turned,
        curvature + change * way,
    )


@compiled
def _nearest(x: float, y: float, nodes: np.ndarray, spacing: float, stack: np.ndarray) -> float:
    """A position [m] near the foot of a point on the line, found by halving.

    A stretch that goes ``reach`` to both sides of its middle lies within a box of that half length, in the direction of
    its middle, and of the half width reach² / 2 `SMALLEST_RADIUS`. Stretches whose box is farther away than another
    foot are left out; those of `_LEAF` or less are as good as straight.
    """
    best, least, top = 0.0, np.inf, 1
    stack[0, 0], stack[0, 1] = 0, len(nodes) - 1
    while top:
        top -= 1
        low, high = stack[top]
        middle = (low + high + 1) // 2
        off_x, off_y = x - nodes[middle, 0], y - nodes[middle, 1]
        ahead = off_x * nodes[middle, 2] + off_y * nodes[middle, 3]
        left = abs(off_y * nodes[middle, 2] - off_x * nodes[middle, 3])
        reach = spacing * (middle - low)
        leaf = reach <= _LEAF or high == low + 1
        beyond = max(abs(ahead) - reach, 0.0)
        beside = left if leaf else max(left - reach * reach / (2 * SMALLEST_RADIUS), 0.0)
        distance = beyond * beyond + beside * beside
        if distance >= least:
            continue
        if leaf:
            best, least = middle * spacing + min(max(ahead, -reach), reach), distance
        elif ahead > 0:  # the nearer half is looked at first
            stack[top, 0], stack[top, 1], stack[top + 1, 0], stack[top + 1, 1] = low, middle, middle, high
            top += 2
        else:
            stack[top, 0], stack[top, 1], stack[top + 1, 0], stack[top + 1, 1] = middle, high, low, middle
            top += 2
    return best


@compiled
def _to_road(x: np.ndarray, y: np.ndarray, nodes: np.ndarray, spacing: float, own: float, result: np.ndarray) -> None:
    stack = np.empty((64, 2), np.int64)
    for k in range(len(x)):
        lon, left = _nearest(x[k], y[k], nodes, spacing, stack), 0.0
        for _ in range(20):
            line_x, line_y, cosine, sine, _, curvature = _at(lon, nodes, spacing)
            off_x, off_y = x[k] - line_x, y[k] - line_y
            ahead, left = off_x * cosine + off_y * sine, off_y * cosine - off_x * sine
            lon += ahead / max(1 - curvature * left, 0.1)
            if abs(ahead) < 1e-5:  # the next step would be its square over the radius
                break
        result[0, k], result[1, k] = lon, own + left


@compiled
def _to_map(
    lon: np.ndarray, lat: np.ndarray, nodes: np.ndarray, spacing: float, own: float, result: np.ndarray
) -> None:
    for k in range(len(lon)):
        x, y, cosine, sine, _, _ = _at(lon[k], nodes, spacing)
        left = lat[k] - own
        result[0, k], result[1, k] = x - left * sine, y + left * cosine


@compiled
def _direction(
    lon: np.ndarray, _: np.ndarray, nodes: np.ndarray, spacing: float, own: float, result: np.ndarray
) -> None:
    for k in range(len(lon)):
        _x, _y, _cosine, _sine, result[0, k], result[1, k] = _at(lon[k], nodes, spacing)
