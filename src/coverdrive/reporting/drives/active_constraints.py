"""Which constraints of a plan are active: the predicted boxes that it could not come any closer to."""

import numpy as np
from jaxtyping import Bool

from coverdrive.planning.planner import MpcPlanner
from coverdrive.planning.problem.obstacles import clearance, obstacles_of, own_half_sizes, way_to_brake
from coverdrive.planning.problem.settings import ProblemSettings
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
    settings, vehicle = problem.obstacles, problem.vehicle
    lon, lat, speed, heading = (trace.plans[step].held[1:, i, None] for i in range(4))
    there_lon, there_lat, half_length, half_width, other, fall, _ = obstacles_of(trace.paths[step], settings)[0][:, 1:]
    way = way_to_brake(speed, np.minimum(speed, other), fall, vehicle.max_deceleration)
    apart, own = (lon - there_lon, lat - there_lat), own_half_sizes(np.abs(heading), vehicle)
    values = clearance(apart, (half_length, half_width), own, way, settings)
    return np.pad((values < 1 + settings.margin + _MARGIN).T, ((0, 0), (1, 0)))
