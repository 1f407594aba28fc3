"""Solving the nonlinear program with IPOPT.

Solvers are compiled once per process for every size of the problem. They neither pickle nor may be used by two
threads at a time.
"""

from functools import cache
from typing import Any

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.errors import SettingError
from coverdrive.extras import require
from coverdrive.planning.problem.constants import constants_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.surroundings import Surroundings
from coverdrive.settings import Settings
from oracle.program import Program, bounds, build_program, padded, parameters, start_values

ca: Any = require("casadi")
_kept: Any = cache  # settings have a hash, which the type checker does not know


class SolverSettings(Settings):
    """When IPOPT is done, and when it gives up."""

    tolerance: float = Field(default=1e-3, gt=0, le=1)
    """largest violation of the optimality conditions"""
    max_iterations: int = Field(default=100, ge=0, le=10_000)
    """at the most"""


_FAR = 0.5
"""slack from which on a start counts as inside an obstacle"""
_BARRIERS = 0.1, 1000.0
"""barrier parameter to start with, and from a start inside an obstacle; of the size of the slack penalty, the latter
lets the solver leave the obstacle before it refines (measured: a third of the failures, half the iterations, cheaper
plans)"""


@_kept
def compiled_program(problem: ProblemSettings, period: float, boxes: int, likely: int) -> Program:
    """The program of a problem that is posed anew every ``period`` [s], for a number of boxes of either kind."""
    return build_program(problem, constants_of(problem, period), boxes, likely)


@_kept
def compiled_solver(
    problem: ProblemSettings, period: float, boxes: int, likely: int, settings: SolverSettings, barrier: float
) -> Any:
    """The `casadi.nlpsol` object of `compiled_program`, which starts with this barrier parameter."""
    limits = {"max_iter": settings.max_iterations, "tol": settings.tolerance, "mu_init": barrier}
    quiet = {"print_time": False, "error_on_fail": False, "show_eval_warnings": False}
    options = quiet | {"ipopt": limits | {"print_level": 0, "sb": "yes"}}
    return ca.nlpsol("plan", "ipopt", compiled_program(problem, period, boxes, likely).nlp, options)


def solve(
    start: Float[np.ndarray, "N 2"],
    targets: Float[np.ndarray, " 2"],
    around: Surroundings,
    problem: ProblemSettings,
    period: float,
    settings: SolverSettings,
) -> Float[np.ndarray, "N 2"] | None:
    """The inputs that IPOPT converges to, or None.

    Args:
        start: acceleration [m/s²] and yaw rate [rad/s] of every node, to start from.
        targets: [m] lat of the centre of the target lane of the drive branch (0) and of the fail-safe branch (1).
        around: what the plan is made for.
        problem: horizon, ego, weights and shape of the obstacles.
        period: [s] from one plan to the next.
        settings: tolerance and limits.

    Raises:
        SettingError: if the road bends or its lanes change.
    """
    if len(around.road.rows) > 1:
        raise SettingError("the general solver plans on straight roads of even lanes only; take another planner")
    around = around._replace(boxes=padded(around.boxes), likely=padded(around.likely))
    posed, constants = (problem, period, around.boxes.shape[2], around.likely.shape[2]), constants_of(problem, period)
    program, given = compiled_program(*posed), parameters(targets, around)
    values = start_values(program, start, given, around, constants)
    run = compiled_solver(*posed, settings, _BARRIERS[int(values[-program.slacks :].max() > _FAR)])
    low, high = bounds(program, around, constants)
    least = np.full(program.nlp["g"].numel(), -np.inf)
    least[: program.equalities] = 0.0
    result = run(x0=values, p=given, lbx=low, ubx=high, lbg=least, ubg=0.0)
    found = np.asarray(result["x"]).ravel()[: start.size].reshape(start.shape)
    return found if run.stats()["success"] and np.isfinite(found).all() else None
