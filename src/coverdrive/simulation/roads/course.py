"""What a road asks of those who drive on it: where its lanes begin and end, and how fast its bends let them be.

L lanes.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from coverdrive.road import LaneEdges, Road

COMFORT = 2.0
"""[m/s²] lateral acceleration at which a usual driver takes a bend (about what AASHTO designs them for)"""

AHEAD = 1.0
"""[m/s²] with which drivers slow down ahead of a bend"""

_STEP = 2.0
"""[m] along the road"""

_WHOLE = 0.9
"""share of its usual width from which on drivers take a lane for one"""


@dataclass(frozen=True, eq=False)
class Course:
    """The lanes of a road along it, and the speed that it allows."""

    road: Road

    @cached_property
    def _spots(self) -> Float[np.ndarray, " n"]:
        return np.arange(0.0, float(self.road.length) + _STEP, _STEP)

    @cached_property
    def ends(self) -> Float[np.ndarray, "2 L"]:
        """[m] where each lane begins and ends to be as wide as it is; infinite where it goes on."""
        edges = np.asarray(self.road.edges)
        if self.road.changing is None:
            return np.outer([-np.inf, np.inf], np.ones(self.road.lanes))
        whole = np.diff(self.road.edges_at(self._spots), axis=-1) >= _WHOLE * np.diff(edges)
        first, last = whole.argmax(0), len(whole) - 1 - whole[::-1].argmax(0)
        begins = np.where(first == 0, -np.inf, self._spots[first])
        return np.stack([begins, np.where(last == len(whole) - 1, np.inf, self._spots[last])])

    @cached_property
    def way_out(self) -> Int[np.ndarray, " L"]:
        """Step, to the left (1) or right (−1), from each lane that ends to one that goes on farther; else 0."""
        end = self.ends[1]
        left, right = np.append(end[1:], -np.inf), np.append(-np.inf, end[:-1])
        return np.where(np.isinf(end) | (np.maximum(left, right) <= end), 0, np.where(left >= right, 1, -1))

    @cached_property
    def ending(self) -> bool:
        """Whether drivers have to leave some lane."""
        return bool(self.way_out.any())

    @property
    def limited(self) -> bool:
        """Whether bends or a limit may ask drivers for less than they want."""
        return self.road.line is not None or self.road.speed_limit is not None

    @property
    def through(self) -> Road:
        """The road without the lanes that end on its sides."""
        first, last = np.flatnonzero(self.way_out == 0)[[0, -1]]
        kept, changing = slice(first, last + 2), self.road.changing
        return replace(
            self.road,
            edges=self.road.edges[kept],
            changing=changing and LaneEdges(changing.lon, changing.lat[:, kept]),
        )

    @cached_property
    def _speeds(self) -> Float[np.ndarray, " n"]:
        """[m/s] that limit and bends allow a usual driver, who slows down ahead of them."""
        bends = np.sqrt(COMFORT / np.maximum(np.abs(self.road.curvature(self._spots)), 1e-9))
        speeds = np.minimum(bends, self.road.speed_limit or np.inf)
        for i in reversed(range(len(speeds) - 1)):
            speeds[i] = min(speeds[i], np.sqrt(speeds[i + 1] ** 2 + 2 * AHEAD * _STEP))
        return speeds

    def speed_at(self, lon: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
        """[m/s] that a usual driver drives at most at positions [m]; infinite on a straight road without a limit."""
        if not self.limited:
            return np.full(np.shape(lon), np.inf)
        return np.interp(lon, self._spots, self._speeds)
