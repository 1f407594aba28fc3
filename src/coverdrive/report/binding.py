"""Which predicted paths bind a plan: those that it could not come any closer to."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool

from coverdrive.planning.obstacles import Obstacles, ObstacleSettings, clearances
from coverdrive.planning.vehicle import VehicleSettings
from coverdrive.simulation.trace import Trace

_MARGIN = 0.02
"""an obstacle binds if the left-hand side of its constraint is below 1 + this"""


class Binding(NamedTuple):
    """What decides it."""

    car: VehicleSettings
    """the own car"""
    obstacles: ObstacleSettings
    """shape of the obstacles that the planner stays clear of"""

    def of(self, trace: Trace, step: int) -> Bool[np.ndarray, "S P"]:
        """Which of the S paths bind the plan of a step, and at which of their points; never at the first, now."""
        paths = trace.paths[step]
        boxes = Obstacles(np.moveaxis(paths.points[:, 1:], 0, 1), np.moveaxis(paths.half_sizes[:, 1:], 0, 1))
        tight = clearances(trace.plans[step].states, boxes, self.car, self.obstacles) < 1 + _MARGIN
        return np.pad(tight.T, ((0, 0), (1, 0)))
