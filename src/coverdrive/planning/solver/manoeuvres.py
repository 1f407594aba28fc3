"""Simple manoeuvres: steer to a place across the road at a constant acceleration. They are guesses for the search, the
ways to evade where nothing is clear, and how simple drivers change lanes.

g accelerations, L target lanes.
"""

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled
from coverdrive.planning.check.evaluate import Plans, complete, drive_step, hold
from coverdrive.planning.check.merit import input_at
from coverdrive.planning.problem.constants import Constants
from coverdrive.planning.problem.rollout import state_at, write
from coverdrive.planning.problem.vehicle import VehicleSettings
from coverdrive.planning.surroundings import Surroundings
from coverdrive.road_ahead import LEFT, RIGHT, STRAIGHT, bend_at, value_at

_PLACES = 9
"""across the road, to which a car evades"""
_FARTHEST = 4.0
"""[m] across the road to such a place"""
_SHORT = 0.9
"""share of the way there that is steered for, unless more finely: a car that steers in steps swings beyond"""
_HURRY = 1.6
"""times faster than a lane is changed in comfort"""
_HARD = np.array([1.0, 0.5, 0.0])
"""shares of full braking while it evades"""
WAYS = len(_HARD) * (_PLACES + 1)
"""to evade"""
EVASIONS = 2 * WAYS
"""the same steered in steps, followed by those steered more finely"""
_LANE_TIME = 0.8
"""[s] in which a lane-seeking car would be back on the centre of its lane"""
_LATERAL_SPEED = 2.0
"""[m/s] at which a lane-seeking car moves sideways at the most: 3.6 m in about 2.5 s"""
_HEADING_TIME = 0.4
"""[s] in which a lane-seeking car takes the wanted heading"""
_ROUNDING = 1e-9
"""of the number of plans in a step"""


def accelerations_of(vehicle: VehicleSettings, braking: int = 6) -> Float[np.ndarray, " g"]:
    """[m/s²] of the simple manoeuvres: so many from full braking to none, half and full throttle."""
    slower = np.linspace(-vehicle.max_deceleration, 0.0, braking)
    return np.concatenate([slower, [vehicle.max_acceleration / 2, vehicle.max_acceleration]])


@compiled
def lane_seeking(lat: float, speed: float, heading: float, target_lat: float, hurry: float) -> float:
    """The yaw rate [rad/s] that steers from a lat [m], speed [m/s] and heading [rad] to the centre of a lane [m], so
    many times faster than in comfort.
    """
    fastest = hurry * _LATERAL_SPEED
    sideways = min(max((target_lat - lat) * hurry / _LANE_TIME, -fastest), fastest)
    return (np.arctan2(sideways, max(speed, 2 * fastest)) - heading) * hurry / _HEADING_TIME


@compiled
def write_manoeuvre(
    plans: Plans, i: int, place: float, lane: int, target: float, acceleration: float, hurry: float, parts: int,
    around: Surroundings, constants: Constants,
) -> None:  # fmt: skip
    """Write a plan whose branches both steer to a lat at a constant acceleration, and what follows from it.

    Where it steers anew in several parts of each step, as the plans to come may, its inputs are their means, but for
    the first, which is driven now: as they do not lead exactly to its states, it is not called clear.
    """
    tree, dt, straight = constants.tree, constants.dt / parts, len(around.road.rows) == 1
    applied, states = np.zeros((constants.steps, 2)), np.empty((constants.steps, 4))
    state, now = state_at(plans.states[i], -1, around.state), (0.0, 0.0)
    before, elapsed = input_at(applied, -1, around.previous_input), constants.period
    for k in range(constants.steps):
        for part in range(parts):
            wish = acceleration, lane_seeking(state[1], state[2], state[3], place, hurry)
            bend = STRAIGHT if straight else bend_at(state, dt, around.road)
            before, state = drive_step(state, wish, before, elapsed, dt, bend, constants.vehicle)
            if k == 0 and part == 0:
                now, elapsed = before, dt
            applied[k, 0], applied[k, 1] = applied[k, 0] + before[0] / parts, applied[k, 1] + before[1] / parts
        write(states[k], state)
        if k + 1 == constants.held > 1:
            hold(applied, states, around, constants)
            before, state = input_at(applied, k, around.previous_input), state_at(states, k, around.state)
    for n in range(len(tree.parent)):
        write(plans.inputs[i, n], applied[tree.moment[n] - 1])
        write(plans.states[i, n], states[tree.moment[n] - 1])
    aim(plans, i, lane, target)
    complete(plans, i, around, constants)
    if parts > 1:
        plans.clear[i] = False
        for n in range(len(tree.parent)):
            if tree.moment[n] == 1:
                write(plans.inputs[i, n], now)


@compiled
def evade(plans: Plans, first: int, lanes: Float[np.ndarray, " L"], around: Surroundings, constants: Constants) -> int:
    """Append ways to evade: to where the ego is, and across the road as far as it is near; returns their end.

    What is not clear is also looked at as if it were steered as often as there are plans, and then all the way.
    """
    lat, half_width = around.state[1], constants.vehicle.width / 2 + constants.shape.edge_margin
    right = max(lat - _FARTHEST, min(lat, value_at(0.0, RIGHT, around.road)[0] + half_width))
    left = min(lat + _FARTHEST, max(lat, value_at(0.0, LEFT, around.road)[0] - half_width))
    last, parts = first + WAYS, int(np.ceil(constants.dt / constants.period - _ROUNDING))
    for i in range(WAYS):
        place = i // len(_HARD)
        there = lat if place == _PLACES else right + (left - right) * place / (_PLACES - 1)
        at = lat + _SHORT * (there - lat)
        lane = int(np.argmin(np.abs(lanes - at)))
        braking = -constants.vehicle.max_deceleration * _HARD[i % len(_HARD)]
        write_manoeuvre(plans, first + i, at, lane, lanes[lane], braking, _HURRY, 1, around, constants)
        if parts > 1 and not plans.clear[first + i]:
            write_manoeuvre(plans, last, there, lane, lanes[lane], braking, _HURRY, parts, around, constants)
            last += 1
    return last


@compiled
def aim(plans: Plans, i: int, lane: int, target: float) -> None:
    """Let both branches of a plan end in a lane."""
    plans.lane[i] = lane
    plans.targets[i, 0] = plans.targets[i, 1] = target
