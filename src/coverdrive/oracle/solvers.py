"""Solving the nonlinear program with IPOPT.

Solvers are compiled once per process for every size of the problem. They neither pickle nor may be used by two
threads at a time.
"""

from typing import Any

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.errors import SettingError
from coverdrive.extras import require
from coverdrive.oracle.program import Program, bounds, build_program, padded, parameters, start_values
from coverdrive.planning.problem.constants import constants_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.surroundings import Surroundings
from coverdrive.settings import Settings

ca: Any = require("casadi")


class SolverSettings(Settings):
    """When IPOPT is done, and when it gives up."""

    tolerance: float = Field(default=1e-3, gt=0, le=1)
    """largest violation of the optimality conditions"""
    barrier: float = Field(default=0.1, gt=0, le=1e6)
    """barrier parameter to start with if the start is clear of the obstacles"""
    far_barrier: float = Field(default=1000.0, gt=0, le=1e6)
    """barrier parameter if the start is inside an obstacle; of the size of the slack penalty, it lets the solver leave
    the obstacle before it refines (measured: a third of the failures, half the iterations, cheaper plans)"""
    max_iterations: int = Field(default=100, ge=0, le=10_000)
    """at the most"""


_FAR = 0.5
"""slack from which on a start counts as inside an obstacle"""


_PROGRAMS: dict[tuple[Any, ...], Program] = {}
_SOLVERS: dict[tuple[Any, ...], Any] = {}


def compiled_program(problem: ProblemSettings, period: float, boxes: int, likely: int) -> Program:
    """The program of a problem that is posed anew every ``period`` [s], for a number of boxes of either kind."""
    key = (problem, period, boxes, likely)
    if key not in _PROGRAMS:
        _PROGRAMS[key] = build_program(problem, constants_of(problem, period), boxes, likely)
    return _PROGRAMS[key]


def compiled_solver(program: Program, settings: SolverSettings, barrier: float) -> Any:
    """The `casadi.nlpsol` object of such a program, which starts with this barrier parameter."""
    key = (id(program), settings, barrier)  # programs are kept
    if key not in _SOLVERS:
        limits = {"max_iter": settings.max_iterations, "tol": settings.tolerance, "mu_init": barrier}
        quiet = {"print_time": False, "error_on_fail": False, "show_eval_warnings": False}
        options = quiet | {"ipopt": limits | {"print_level": 0, "sb": "yes"}}
        _SOLVERS[key] = ca.nlpsol("plan", "ipopt", program.nlp, options)
    return _SOLVERS[key]


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
    size, constants = (around.boxes.shape[2], around.likely.shape[2]), constants_of(problem, period)
    program, given = compiled_program(problem, period, *size), parameters(targets, around)
    values = start_values(program, start, given, around, constants)
    barrier = settings.far_barrier if values[-program.slacks :].max() > _FAR else settings.barrier
    run = compiled_solver(program, settings, barrier)
    low, high = bounds(program, around, constants)
    least = np.full(program.nlp["g"].numel(), -np.inf)
    least[: program.equalities] = 0.0
    result = run(x0=values, p=given, lbx=low, ubx=high, lbg=least, ubg=0.0)
    found = np.asarray(result["x"]).ravel()[: start.size].reshape(start.shape)
    return found if run.stats()["success"] and np.isfinite(found).all() else None
