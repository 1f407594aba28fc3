"""Motions of the own car within its limits, and what they violate and cost.

Whatever proposes a motion — a rule, the previous plan, a solver — proposes inputs; the states follow from the vehicle
model, and slack and cost from the states. Nothing here trusts what a solver says about its result. P = K + 1 is the
number of states.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.planning.cost import plan_cost
from coverdrive.planning.obstacles import Obstacles, clearances, own_half_sizes, smallest_slack
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.vehicle import VehicleSettings, feasible_inputs, step

_LANE_TIME = 0.8
"""[s] in which a lane-seeking car would be back on the centre of its lane"""
_LATERAL_SPEED = 2.0
"""[m/s] at which a lane-seeking car moves sideways at the most: 3.6 m in about 2.5 s"""
_HEADING_TIME = 0.4
"""[s] in which a lane-seeking car takes the wanted heading"""
_HARMFUL = 20.0
"""[m/s] closing speed at which a contact counts twice as much as at rest"""


class Motion(NamedTuple):
    """Motions over the horizon; m stands for any leading axes."""

    states: Float[np.ndarray, "*m P 4"]
    """lon [m], lat [m], speed [m/s], heading [rad]"""
    inputs: Float[np.ndarray, "*m K 2"]
    """acceleration [m/s²], yaw rate [rad/s]"""
    slack: Float[np.ndarray, "*m K"]
    """smallest γ_k with which the obstacle constraints of the steps k = 1 … K hold, margin included"""
    off_road: Float[np.ndarray, "*m K"]
    """[m] by which the body gets beyond the margin of the road edges at the steps k = 1 … K"""
    cost: Float[Any, "*m"]
    """value of the objective"""
    lasting_cost: Float[Any, "*m"]
    """the objective with every slack, times `harm_of`, held until the end, because a contact cannot be undone; motions
    are compared by it, so that passing through a vehicle does not look better than stopping at it"""

    def at(self, index: int) -> "Motion":
        """One of several motions."""
        return Motion(*(field[index] for field in self))


def drive(
    state: Float[np.ndarray, " 4"],
    wanted: Callable[[int, Float[np.ndarray, "m 4"]], Float[np.ndarray, "m 2"]],
    motions: int,
    steps: int,
    dt: float,
    vehicle: VehicleSettings,
) -> tuple[Float[np.ndarray, "m P 4"], Float[np.ndarray, "m K 2"]]:
    """States and inputs of cars that follow wanted inputs as far as their limits allow.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] now.
        wanted: acceleration [m/s²] and yaw rate [rad/s] wanted at step k in the given states.
        motions: number of motions m.
        steps: K.
        dt: [s].
        vehicle: limits of the own car.
    """
    states, inputs = np.empty((motions, steps + 1, 4)), np.empty((motions, steps, 2))
    states[:, 0] = state
    for k in range(steps):
        inputs[:, k] = feasible_inputs(states[:, k], wanted(k, states[:, k]), dt, vehicle)
        states[:, k + 1] = step(states[:, k], inputs[:, k], dt)
    return states, inputs


def lane_seeking_inputs(
    states: Float[np.ndarray, "m 4"], target_lat: Float[np.ndarray, " m"], acceleration: Float[np.ndarray, " m"]
) -> Float[np.ndarray, "m 2"]:
    """Inputs that steer to the centre of a lane at a given acceleration.

    Args:
        states: lon [m], lat [m], speed [m/s], heading [rad].
        target_lat: [m] centre of the lane.
        acceleration: [m/s²].
    """
    return np.stack([acceleration, lane_seeking(states[:, 1], states[:, 2], states[:, 3], target_lat)], axis=-1)


def lane_seeking(lat: Any, speed: Any, heading: Any, target_lat: Any) -> Any:
    """The yaw rate [rad/s] of `lane_seeking_inputs`, of numbers, or of arrays element by element."""
    sideways = np.minimum(np.maximum((target_lat - lat) / _LANE_TIME, -_LATERAL_SPEED), _LATERAL_SPEED)
    return (np.arctan2(sideways, np.maximum(speed, 2 * _LATERAL_SPEED)) - heading) / _HEADING_TIME


def judged(
    states: Float[np.ndarray, "*m P 4"],
    inputs: Float[np.ndarray, "*m K 2"],
    target_lat: Float[Any, "*m"] | float,
    situation: Situation,
    problem: ProblemSettings,
) -> Motion:
    """Motions with their slacks and costs computed from the states.

    Args:
        states: lon [m], lat [m], speed [m/s], heading [rad].
        inputs: acceleration [m/s²], yaw rate [rad/s].
        target_lat: [m] centre of the target lane.
        situation: what the motions are made for.
        problem: car, weights and shape of the obstacles.
    """
    values = clearances(states, situation.obstacles, problem.vehicle, problem.obstacles)
    slack = smallest_slack(values, problem.obstacles.margin)
    half_width = own_half_sizes(np.abs(states[..., 1:, 3]), problem.vehicle)[1] + problem.obstacles.edge_margin
    right, left = situation.road_edges
    lat = states[..., 1:, 1]
    off_road = np.maximum(0.0, np.maximum(right - (lat - half_width), lat + half_width - left))
    closing = _closing_speeds(states, values, situation.obstacles, problem.dt)
    lasting_slack = np.maximum.accumulate(slack * harm_of(closing), axis=-1)
    cost, lasting_cost = (
        plan_cost(states, inputs, each, off_road, situation.previous_input, target_lat, problem.cost)
        for each in (slack, lasting_slack)
    )
    return Motion(states, inputs, slack, off_road, cost, lasting_cost)


def harm_of(closing_speed: Any) -> Any:
    """How much worse a contact is at a closing speed [m/s] than at none."""
    return 1 + closing_speed / _HARMFUL


def _closing_speeds(
    states: Float[np.ndarray, "*m P 4"], values: Float[np.ndarray, "*m K n"], obstacles: Obstacles, dt: float
) -> Float[np.ndarray, "*m K"]:
    """Difference of the speeds along the road [m/s] from the box that is nearest to contact at every step."""
    speed = states[..., 1:, 2]
    if not obstacles.slots:
        return np.zeros_like(speed)
    moved = np.diff(obstacles.centres[..., 0], axis=0) / dt
    nearest = values.argmin(-1)
    return np.abs(speed - np.concatenate([moved, moved[-1:]])[np.arange(len(moved) + 1), nearest])


def shifted_inputs(inputs: Float[np.ndarray, "K n"], elapsed: float, dt: float) -> Float[np.ndarray, "K n"]:
    """The inputs of a plan as seen some time later: their means over the steps of the new plan.

    Args:
        inputs: acceleration [m/s²] and yaw rate [rad/s], each held for dt; a unit matrix gives the map as a matrix.
        elapsed: [s] since the plan was made; after its end the last inputs are held on.
        dt: [s].
    """
    steps = len(inputs)
    more = int(np.ceil(elapsed / dt))
    held = np.concatenate([inputs, np.repeat(inputs[-1:], more, axis=0)])
    integral = np.concatenate([np.zeros((1, inputs.shape[1])), np.cumsum(held, axis=0)])
    at = elapsed / dt + np.arange(steps + 1)
    known = np.arange(len(integral))
    return np.diff(np.stack([np.interp(at, known, column) for column in integral.T], axis=-1), axis=0)
