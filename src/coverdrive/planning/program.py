"""The optimal control problem of the paper's §4 as a parametric nonlinear program, compiled once per process.

Decision variables, stage by stage as fatrop wants them: the inputs u_0, then for k = 1 … K the state x_k, the inputs
u_k (k < K) and the slacks γ_k (obstacles) and ρ_k [m] (road edges). The state is (lon, lat, speed, heading) followed
by the inputs applied before, which makes changes of the inputs a cost of one stage. The current state is a
parameter. Constraints, stage by stage: x_{k+1} − f(x_k, u_k) = 0, then lateral acceleration, road edges and one
obstacle constraint per slot. Longitudinal positions are relative to the current one.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.extras import require
from coverdrive.planning.cost import CostSettings, input_cost, state_cost
from coverdrive.planning.merit import KINK
from coverdrive.planning.obstacles import clearance, own_half_sizes, way_to_brake
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.vehicle import VehicleSettings, euler_step

ca: Any = require("casadi")

STATES = 6
"""lon, lat, speed, heading, acceleration and yaw rate applied before"""
INPUTS = 2
SLACKS = 2
PARAMETERS = 9
"""current state (4), previous input (2), lat of the target lane's centre, of the right and of the left road edge"""


_FAR_TURNED = 0.3
"""[rad] beyond which the constraint for the other sign of the heading is none, so that no extent gets negative"""


class Program(NamedTuple):
    """The nonlinear program in symbols, and where its variables are."""

    nlp: dict[str, Any]
    """variables x, parameters p, objective f and constraints g, as `casadi.nlpsol` takes them"""
    equality: list[bool]
    """whether a constraint is an equality; the others are g ≥ 0"""
    stages: list[tuple[int, int, int]]
    """of the stages k = 0 … K: states, inputs with slacks, constraints that do not close a gap"""
    state_index: np.ndarray
    """(K, 6): places of the states of k = 1 … K among the variables"""
    input_index: np.ndarray
    """(K, 2): places of the inputs of k = 0 … K − 1"""
    slack_index: np.ndarray
    """(K, 2): places of the slacks of k = 1 … K"""


def build_program(settings: ProblemSettings, slots: int) -> Program:
    """The nonlinear program for a number of obstacle slots.

    Args:
        settings: horizon, car, weights and shape of the obstacles.
        slots: boxes at every step.
    """
    steps = settings.steps
    parameters = ca.SX.sym("parameters", PARAMETERS)
    boxes = [ca.SX.sym(f"boxes_{k}", 6, slots) for k in range(1, steps + 1)]
    states = [ca.SX.sym(f"x_{k}", STATES) for k in range(1, steps + 1)]
    inputs = [ca.SX.sym(f"u_{k}", INPUTS) for k in range(steps)]
    slacks = [ca.SX.sym(f"slack_{k}", SLACKS) for k in range(1, steps + 1)]
    weights = settings.cost.slack_weights(steps)
    objective, constraints, equality, stages = ca.SX(0), [], [], []
    for k in range(steps + 1):
        state = ca.vertcat(0, parameters[1:6]) if k == 0 else states[k - 1]
        rows: list[Any] = []
        if k < steps:
            constraints.append(states[k] - _successor(state, inputs[k], settings))
            equality += [True] * STATES
            objective += _cost_of_input(state, inputs[k], settings.cost)
            rows += _lateral_acceleration_rows(state, inputs[k], settings.vehicle)
        if k > 0:
            factor = settings.cost.terminal if k == steps else 1.0
            objective += factor * state_cost(state[1] - parameters[6], state[2], state[3], settings.cost)
            obstacle_slack, off_road = ca.vertsplit(slacks[k - 1])
            objective += weights[k - 1] * obstacle_slack**2 + settings.cost.off_road * off_road**2
            rows += _road_rows(state, parameters[7], parameters[8], off_road, settings)
            rows.append(_obstacle_rows(state, parameters[2:4], boxes[k - 1], obstacle_slack, settings))
        path = ca.vertcat(*rows)
        constraints.append(path)
        equality += [False] * path.numel()
        stages.append((STATES * (k > 0), INPUTS * (k < steps) + SLACKS * (k > 0), path.numel()))
    variables = [inputs[0]]
    for k in range(1, steps + 1):
        variables += [states[k - 1], *inputs[k : k + 1], slacks[k - 1]]
    nlp = {
        "x": ca.vertcat(*variables),
        "p": ca.vertcat(parameters, *(ca.vec(box) for box in boxes)),
        "f": objective,
        "g": ca.vertcat(*constraints),
    }
    return Program(nlp, equality, stages, *_places(steps))


def _places(steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where the states, inputs and slacks are among the variables."""
    start = INPUTS + (STATES + INPUTS + SLACKS) * np.arange(steps)[:, None]
    first_input = np.concatenate([[[0]], start[:-1] + STATES])
    first_slack = start + STATES + INPUTS
    first_slack[-1] -= INPUTS  # the last stage has no inputs
    return start + np.arange(STATES), first_input + np.arange(INPUTS), first_slack + np.arange(SLACKS)


def _successor(state: Any, inputs: Any, settings: ProblemSettings) -> Any:
    """The state one step later, with the inputs that led to it."""
    lon, lat, speed, heading = ca.vertsplit(state[:4])
    direction = ca.cos(heading), ca.sin(heading)
    after = euler_step((lon, lat, speed, heading), direction, (inputs[0], inputs[1]), settings.dt)
    return ca.vertcat(*after, inputs)


def _cost_of_input(state: Any, inputs: Any, settings: CostSettings) -> Any:
    """Cost of the inputs of a step and of their changes; the state holds those of the step before."""
    changes = inputs - state[4:]
    return input_cost(inputs[0], inputs[1], changes[0], changes[1], settings)


def _lateral_acceleration_rows(state: Any, inputs: Any, vehicle: VehicleSettings) -> list[Any]:
    """The lateral acceleration speed · yaw rate stays within its bounds."""
    lateral = state[2] * inputs[1]
    return [vehicle.max_lateral_acceleration - lateral, vehicle.max_lateral_acceleration + lateral]


def _turned(heading: Any) -> tuple[Any, Any]:
    """The heading for either sign; the constraints are posed for both."""
    return ca.fmax(heading, -_FAR_TURNED), ca.fmax(-heading, -_FAR_TURNED)


def _road_rows(state: Any, right: Any, left: Any, off_road: Any, settings: ProblemSettings) -> list[Any]:
    """The turned body stays within the margins of the road edges, up to the slack ρ_k."""
    rows: list[Any] = []
    for heading in _turned(state[3]):
        half_width = own_half_sizes(heading, settings.vehicle)[1] + settings.obstacles.edge_margin
        rows += [left - state[1] - half_width + off_road, state[1] - half_width - right + off_road]
    return rows


def _obstacle_rows(state: Any, start: Any, boxes: Any, slack: Any, settings: ProblemSettings) -> Any:
    """The obstacle constraints of one step, two rows per slot; the body is longer by the lag, as in the search."""
    now, before = (each[0] * ca.vertcat(ca.cos(each[1]), ca.sin(each[1])) for each in (state[2:4], start))
    lag = settings.dt / 2 * (now - before)
    longer = ca.sqrt(lag**2 + KINK**2) - KINK
    centre_lon, centre_lat, half_length, half_width, speed, deceleration = (boxes[i, :].T for i in range(6))
    offset = (state[0] + lag[0] / 2 - centre_lon, state[1] + lag[1] / 2 - centre_lat)
    other, hardest = ca.fmin(state[2], speed), settings.vehicle.max_deceleration
    way = way_to_brake(state[2], other, deceleration, hardest, ca.if_else)
    half_sizes, margin = (half_length, half_width), settings.obstacles.margin
    rows: list[Any] = []
    for heading in _turned(state[3]):
        half = own_half_sizes(heading, settings.vehicle)
        own = half[0] + longer[0] / 2, half[1] + longer[1] / 2
        value = clearance(offset, half_sizes, own, way, settings.obstacles)
        rows.append(value + slack - 1 - margin)
    return ca.vertcat(*rows)


def parameter_values(situation: Situation, target_lat: float) -> Float[np.ndarray, " P"]:
    """The parameters of the program, in its order; longitudinal positions relative to the current one.

    Args:
        situation: what the plan is made for.
        target_lat: [m] centre of the target lane.
    """
    origin = situation.state[0]
    obstacles = situation.obstacles
    centres = obstacles.centres - [origin, 0.0]
    ends = obstacles.speed[..., None], obstacles.deceleration[..., None]
    boxes = np.concatenate([centres, obstacles.half_sizes, *ends], axis=-1)[1:]
    scalars = [0.0, *situation.state[1:], *situation.previous_input, target_lat, *situation.road_edges]
    return np.concatenate([scalars, boxes.ravel()])


def variable_bounds(
    program: Program, state: Float[np.ndarray, " 4"], vehicle: VehicleSettings
) -> tuple[Float[np.ndarray, " V"], Float[np.ndarray, " V"]]:
    """Lower and upper bounds of the variables; a current state beyond a bound widens it, so that a plan exists.

    Args:
        program: says where the variables are.
        state: lon [m], lat [m], speed [m/s], heading [rad] now.
        vehicle: limits of the own car.
    """
    speed, heading = state[2:]
    low = np.full(program.nlp["x"].numel(), -np.inf)
    high = -low
    low[program.slack_index] = 0.0
    low[program.input_index] = [-vehicle.max_deceleration, -vehicle.max_yaw_rate]
    high[program.input_index] = [vehicle.max_acceleration, vehicle.max_yaw_rate]
    low[program.state_index[:, 2:4]] = [min(0.0, speed), min(-vehicle.max_heading, heading)]
    high[program.state_index[:, 2:4]] = [max(vehicle.max_speed, speed), max(vehicle.max_heading, heading)]
    return low, high


def pack(
    program: Program,
    states: Float[np.ndarray, "P 4"],
    inputs: Float[np.ndarray, "K 2"],
    slack: Float[np.ndarray, " K"],
    off_road: Float[np.ndarray, " K"],
) -> Float[np.ndarray, " V"]:
    """A motion as values of the variables, to start a solver from.

    Args:
        program: says where the variables are.
        states: lon [m], lat [m], speed [m/s], heading [rad].
        inputs: acceleration [m/s²], yaw rate [rad/s].
        slack: γ_k of the steps k = 1 … K.
        off_road: ρ_k [m] of the steps k = 1 … K.
    """
    values = np.empty(program.nlp["x"].numel())
    values[program.state_index] = np.concatenate([states[1:] - [states[0, 0], 0, 0, 0], inputs], axis=1)
    values[program.input_index] = inputs
    values[program.slack_index] = np.stack([slack, off_road], axis=1)
    return values
