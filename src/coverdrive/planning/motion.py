"""Motions of the ego within its limits. P = K + 1 is the number of states."""

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float

from coverdrive.planning.vehicle import VehicleSettings, feasible_inputs, step

_LANE_TIME = 0.8
"""[s] in which a lane-seeking car would be back on the centre of its lane"""
_LATERAL_SPEED = 2.0
"""[m/s] at which a lane-seeking car moves sideways at the most: 3.6 m in about 2.5 s"""
_HEADING_TIME = 0.4
"""[s] in which a lane-seeking car takes the wanted heading"""


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
        vehicle: limits of the ego.
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


def lane_seeking(lat: Any, speed: Any, heading: Any, target_lat: Any, hurry: float = 1.0) -> Any:
    """The yaw rate [rad/s] of `lane_seeking_inputs`, of numbers, or of arrays element by element.

    Args:
        lat: [m].
        speed: [m/s].
        heading: [rad].
        target_lat: [m] centre of the lane.
        hurry: how many times faster than in comfort.
    """
    fastest = hurry * _LATERAL_SPEED
    sideways = np.minimum(np.maximum((target_lat - lat) * hurry / _LANE_TIME, -fastest), fastest)
    return (np.arctan2(sideways, np.maximum(speed, 2 * fastest)) - heading) * hurry / _HEADING_TIME
