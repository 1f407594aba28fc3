"""Roads that are made up: lanes of one width, bends, an on-ramp and a limit of speed, as settings.

Bends are given as curvature at positions, linear between them, so that they begin and end with clothoids. The lane of
the ramp is the rightmost one, from the road's beginning; where it ends its edge comes over to the next lane.
"""

from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from coverdrive.reference_line import MOST_TURNED, WIDEST_STEP, ReferenceLine
from coverdrive.road import LaneEdges, Road
from coverdrive.settings import Settings

TAPER = 90.0
"""[m] over which a lane that ends narrows to nothing: 300 ft (AASHTO, Green Book, parallel entrances)"""

UNLIMITED = 120.0
"""[m/s] a limit of speed that is none"""

_Place = tuple[Annotated[float, Field(ge=-1e6, le=1e6)], Annotated[float, Field(ge=-0.02, le=0.02)]]


def _ascending(course: tuple[_Place, ...]) -> tuple[_Place, ...]:
    if any(after[0] <= before[0] for before, after in pairwise(course)):
        raise ValueError("the positions of the curvature must ascend")
    return course


class RoadSettings(Settings):
    """Lanes and course of a road."""

    lanes: int = Field(default=3, ge=1, le=20)
    """number of lanes that go on (authors' scripts: 3)"""
    lane_width: float = Field(default=3.6, ge=2, le=10)
    """[m] (authors' scripts; US freeway standard, AASHTO)"""
    curvature: Annotated[tuple[_Place, ...], AfterValidator(_ascending)] = Field(default=(), max_length=1000)
    """positions [m] along the road, ascending, and the curvature [1/m] there, positive where it turns left; linear
    between them, and as at the ends beyond. None: straight"""
    ramp: float = Field(default=0.0, ge=0, le=1e6)
    """[m] how far one more lane on the right, that of an on-ramp, accompanies the road; it narrows to nothing over the
    next 90 m. 0: there is none"""
    speed_limit: float = Field(default=UNLIMITED, gt=0, le=UNLIMITED)
    """[m/s] 120: none"""

    def road_of(self, length: float) -> Road:
        """The road, of a length [m]."""
        lanes = self.lanes + (self.ramp > 0)
        edges = np.arange(lanes + 1) * self.lane_width
        line, changing = None, None
        if any(curvature for _, curvature in self.curvature):
            positions, values = np.array(self.curvature).T
            step = min(WIDEST_STEP, MOST_TURNED / np.abs(values).max())
            spots = np.linspace(0.0, length, int(np.ceil(length / step)) + 1)
            line = ReferenceLine(
                np.zeros(2), 0.0, np.interp(spots, positions, values), length, lat=lanes * self.lane_width / 2
            )
        if self.ramp > 0:
            ended = edges.copy()
            ended[0] = ended[1]
            changing = LaneEdges(np.array([self.ramp, self.ramp + TAPER]), np.stack([edges, ended]))
        limit = None if self.speed_limit >= UNLIMITED else self.speed_limit
        return Road(edges, length, line, changing, limit)

    @property
    def smallest_radius(self) -> float:
        """[m] infinite on a straight road."""
        tightest = max((abs(curvature) for _, curvature in self.curvature), default=0.0)
        return 1 / tightest if tightest else np.inf


CURVED = RoadSettings(
    curvature=tuple(
        (position, 0.0 if radius is None else 1 / radius)
        for position, radius in [
            (250.0, None), (330.0, 400.0), (530.0, 400.0), (690.0, -231.0), (890.0, -231.0), (970.0, None),
            (1070.0, None), (1150.0, 300.0), (1350.0, 300.0), (1430.0, None),
        ]
    ),
    ramp=700.0,
    speed_limit=22.4,
)  # fmt: skip
"""Three lanes and an on-ramp whose lane ends after 700 m; bends of 400 m radius to the left, 231 m to the right and 300
m to the left, with clothoids between; 50 mph, the design speed of 231 m at 8 % of superelevation (AASHTO, Green Book,
2018: side friction 0.14)"""
