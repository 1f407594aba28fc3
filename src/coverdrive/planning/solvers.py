"""Solving the nonlinear program: fatrop, which exploits the stages, and IPOPT, which is slower and more robust.

Solvers are compiled once per process for every size of the problem. They neither pickle nor may be used by two
threads at a time.
"""

from typing import Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.extras import require
from coverdrive.planning.evaluate import Motion
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.program import (
    Program,
    build_program,
    pack,
    parameter_values,
    variable_bounds,
)
from coverdrive.settings import Settings

ca: Any = require("casadi")

Solver = Literal["fatrop", "ipopt"]


class SolverSettings(Settings):
    """When a solver is done, and when it gives up."""

    tolerance: float = Field(default=1e-3, gt=0, le=1)
    """largest violation of the optimality conditions"""
    barrier: float = Field(default=0.1, gt=0, le=1e6)
    """barrier parameter that the interior point methods start with if the start is clear of the obstacles"""
    far_barrier: float = Field(default=1000.0, gt=0, le=1e6)
    """barrier parameter if the start is inside an obstacle; of the size of the slack penalty, it lets the solver leave
    the obstacle before it refines (measured: a third of the failures, half the iterations, cheaper plans)"""
    max_iterations: int = Field(default=100, ge=0, le=10_000)
    """of either solver"""


class Compiled(NamedTuple):
    """A solver and the program that it solves."""

    program: Program
    """says where the variables are"""
    run: Any
    """the `casadi.nlpsol` object"""


_FAR = 0.5
"""slack from which on a start counts as inside an obstacle"""

_COMPILED: dict[tuple[Any, ...], Compiled] = {}


def compiled_solver(
    problem: ProblemSettings, slots: int, solver: Solver, settings: SolverSettings, barrier: float
) -> Compiled:
    """The solver of a problem size, compiled when first asked for in a process.

    Args:
        problem: horizon, car, weights and shape of the obstacles.
        slots: boxes at every step.
        solver: which one.
        settings: tolerance and limits.
        barrier: barrier parameter to start with.
    """
    key = (problem, slots, solver, settings, barrier)
    if key not in _COMPILED:
        program = build_program(problem, slots)
        options = _options(program, problem.steps, solver, settings, barrier)
        _COMPILED[key] = Compiled(program, ca.nlpsol("plan", solver, program.nlp, options))
    return _COMPILED[key]


def _options(program: Program, steps: int, solver: Solver, settings: SolverSettings, barrier: float) -> dict[str, Any]:
    """The options of `casadi.nlpsol`; fatrop is told the stages."""
    limits = {"max_iter": settings.max_iterations, "mu_init": barrier, "print_level": 0}
    options: dict[str, Any] = {"print_time": False, "error_on_fail": False, "show_eval_warnings": False}
    if solver == "ipopt":
        options["ipopt"] = limits | {"tol": settings.tolerance, "sb": "yes"}
    else:
        states, inputs, constraints = (list(column) for column in zip(*program.stages, strict=True))
        options |= {"structure_detection": "manual", "equality": program.equality, "N": steps}
        options |= {"nx": states, "nu": inputs, "ng": constraints}
        options["fatrop"] = limits | {"tolerance": settings.tolerance}
    return options


def solve(
    situation: Situation,
    target_lat: float,
    start: Motion,
    solver: Solver,
    problem: ProblemSettings,
    settings: SolverSettings,
) -> Float[np.ndarray, "K 6"] | None:
    """The states and inputs that a solver converges to, or None.

    Args:
        situation: what the plan is made for.
        target_lat: [m] centre of the target lane.
        start: the motion that the solver starts from.
        solver: which one.
        problem: horizon, car, weights and shape of the obstacles.
        settings: tolerance and limits.

    Returns:
        lon [m], lat [m], speed [m/s], heading [rad] at the steps k = 1 … K, and the acceleration [m/s²] and yaw rate
        [rad/s] that led there.
    """
    slots = situation.obstacles.slots
    barrier = settings.far_barrier if start.slack.max() > _FAR else settings.barrier
    program, run = compiled_solver(problem, slots, solver, settings, barrier)
    low, high = variable_bounds(program, situation.state, problem.vehicle)
    result = run(
        x0=pack(program, start.states, start.inputs, start.slack, start.off_road),
        p=parameter_values(situation, target_lat),
        lbx=low,
        ubx=high,
        lbg=0.0,
        ubg=np.where(program.equality, 0.0, np.inf),
    )
    if not run.stats()["success"]:
        return None
    values = np.asarray(result["x"]).ravel()[program.state_index]
    values[:, 0] += situation.state[0]
    return values
