"""Which constraints of a plan are active: the predicted boxes that it could not come any closer to."""

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.planning.planner import MpcPlanner
from coverdrive.planning.problem.obstacles import (
    ObstacleSettings,
    clearance,
    obstacles_of,
    own_half_sizes,
    way_to_brake,
)
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.vehicle import VehicleSettings
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.studies.study import Study

_MARGIN = 0.02
"""a constraint is active if its left-hand side is at most this much above what the planner asks for"""


def problem_of(study: Study) -> ProblemSettings | None:
    """The problem that the planner of a study solves, which says what is active, if the planner is ours."""
    planner = study.setup.planner
    return planner.settings.problem if isinstance(planner, MpcPlanner) else None


def active_constraints(trace: Trace, step: int, problem: ProblemSettings) -> Bool[np.ndarray, "S P"]:
    """Which of the S paths constrain the plan of a step, and at which of their points; never at the first, now.

    All paths constrain the fail-safe branch, where a plan has one.
    """
    boxes, _ = obstacles_of(trace.paths[step], problem.obstacles)
    values = clearances(trace.plans[step].held, boxes, problem.vehicle, problem.obstacles)
    return np.pad((values < 1 + problem.obstacles.margin + _MARGIN).T, ((0, 0), (1, 0)))


def clearances(
    states: Float[np.ndarray, "*m P 4"],
    boxes: Float[np.ndarray, "7 P n"],
    vehicle: VehicleSettings,
    settings: ObstacleSettings,
) -> Float[np.ndarray, "*m K n"]:
    """Left-hand sides of all obstacle constraints, without their slacks, at the steps k = 1 … K.

    Args:
        states: lon [m], lat [m], speed [m/s], heading [rad].
        boxes: to stay clear of, as `coverdrive.planning.problem.obstacles.obstacles_of` gives them.
        vehicle: size and limits of the ego.
        settings: shape of the obstacles.
    """
    lon, lat, speed, heading = (states[..., 1:, i, None] for i in range(4))
    there, half_length, half_width, other, fall = boxes[:2, 1:], *boxes[2:6, 1:]
    way = way_to_brake(speed, np.minimum(speed, other), fall, vehicle.max_deceleration)
    own = own_half_sizes(np.abs(heading), vehicle)
    return clearance((lon - there[0], lat - there[1]), (half_length, half_width), own, way, settings)
