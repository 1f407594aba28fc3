"""The optimal control problem of the paper's §4 as a parametric nonlinear program, compiled once per process.

Decision variables, stage by stage as fatrop wants them: the inputs u_0, then for k = 1 … K the state x_k, the inputs
u_k (k < K) and the slacks γ_k (obstacles) and ρ_k [m] (road edges). The state is (lon, lat, speed, heading) followed
by the inputs applied before, which makes changes of the inputs a cost of one stage. The current state is a
parameter. Constraints, stage by stage: x_{k+1} − f(x_k, u_k) = 0, then lateral acceleration, road edges and one
obstacle constraint per slot. Longitudinal positions are relative to the current one.
"""

import functools
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.planning.cost import CostSettings, input_cost, state_cost
from coverdrive.planning.obstacles import Obstacles, ObstacleSettings, clearance, own_half_sizes
from coverdrive.planning.vehicle import VehicleSettings, euler_step
from coverdrive.settings import Settings

STATES = 6
"""lon, lat, speed, heading, acceleration and yaw rate applied before"""
INPUTS = 2
SLACKS = 2
PARAMETERS = 9
"""current state (4), previous input (2), lat of the target lane's centre, of the right and of the left road edge"""


class ProblemSettings(Settings):
    """Everything that the compiled problem depends on, but for the number of obstacle slots."""

    steps: int = Field(12, ge=2)
    """K (authors' scripts: 3 s in steps of 0.25 s)"""
    dt: float = Field(0.25, gt=0)
    """[s] between two steps (authors' scripts)"""
    vehicle: VehicleSettings = VehicleSettings()
    """size and limits of the own car"""
    cost: CostSettings = CostSettings()
    """weights of the objective"""
    obstacles: ObstacleSettings = ObstacleSettings()
    """shape and choice of the obstacles"""


class Situation(NamedTuple):
    """What a plan is made for: the parameters of the nonlinear program."""

    state: Float[np.ndarray, " 4"]
    """lon [m], lat [m], speed [m/s], heading [rad] now"""
    previous_input: Float[np.ndarray, " 2"]
    """acceleration [m/s²] and yaw rate [rad/s] applied before"""
    road_edges: tuple[float, float]
    """[m] lat of the right and of the left edge of the road"""
    obstacles: Obstacles
    """boxes to stay clear of"""


class Program(NamedTuple):
    """The nonlinear program in symbols, in the form that `casadi.nlpsol` takes."""

    nlp: dict[str, Any]
    """variables x, parameters p, objective f, constraints g"""
    equality: list[bool]
    """whether a constraint is an equality; the inequalities are g ≥ 0"""
    states: tuple[int, ...]
    """number of state variables of the stages k = 0 … K"""
    inputs: tuple[int, ...]
    """number of input and slack variables of the stages"""
    constraints: tuple[int, ...]
    """number of constraints of the stages that are not x_{k+1} − f(x_k, u_k) = 0"""


@functools.lru_cache(maxsize=64)
def build_program(settings: ProblemSettings, slots: int) -> Program:
    """The nonlinear program for a number of obstacle slots.

    Args:
        settings: horizon, car, weights and shape of the obstacles.
        slots: boxes at every step.
    """
    parameters = ca.SX.sym("parameters", PARAMETERS)
    boxes = [ca.SX.sym(f"boxes_{k}", 4, slots) for k in range(1, settings.steps + 1)]
    state = [*ca.vertsplit(parameters[:6])]
    target, right, left = ca.vertsplit(parameters[6:])
    state[0] = ca.SX(0)
    variables: list[Any] = []
    constraints: list[Any] = []
    equality: list[bool] = []
    sizes: list[tuple[int, int, int]] = []
    objective = ca.SX(0)
    for k in range(settings.steps + 1):
        stage, objective_k = _Stage([], []), ca.SX(0)
        names = ca.SX.sym(f"x_{k}", STATES) if k else ca.SX(0, 1)
        if k:
            state = ca.vertsplit(names)
    raise NotImplementedError
