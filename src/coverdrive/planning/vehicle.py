"""The ego: a Dubins car with a speed (paper §4).

State: lon [m], lat [m], speed [m/s], heading [rad]. Input: acceleration [m/s²], yaw rate [rad/s], held for dt.
`moved` is the one definition of the motion, and `within_limits` that of the limits: `moved` is called with CasADi
symbols, too, both are compiled for numbers, and everything else calls `step`, `rollout` and `feasible_inputs` with
NumPy arrays. P = K + 1 is the number of states.
"""

from typing import Any

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.settings import Settings


class VehicleSettings(Settings):
    """Size and limits of the ego."""

    length: float = Field(default=4.8, ge=1, le=30)
    """[m] a mid-size sedan (AASHTO Green Book 2018, passenger car: 5.8 m at the most; NGSIM US-101 median: 4.6 m)"""
    width: float = Field(default=1.9, ge=0.3, le=5)
    """[m] a mid-size sedan without mirrors"""
    max_acceleration: float = Field(default=3.0, gt=0, le=15)
    """[m/s²] brisk but ordinary (CommonRoad vehicle parameters: up to 11.5; the authors' scripts allow 2000)"""
    max_deceleration: float = Field(default=8.0, gt=0, le=15)
    """[m/s²] full braking on dry asphalt (0.8 g; UN R13-H asks for at least 6.43 m/s²)"""
    max_yaw_rate: float = Field(default=0.5, gt=0, le=5)
    """[rad/s] own choice; above 8 m/s `max_lateral_acceleration` is the tighter bound"""
    max_lateral_acceleration: float = Field(default=4.0, gt=0, le=15)
    """[m/s²] bound of speed · yaw rate; own choice, half of what the tyres of `max_deceleration` give"""
    max_jerk: float = Field(default=20.0, gt=0, le=1000)
    """[m/s³] along and across, from one plan to the next that is optimised; a simple manoeuvre, taken where it is the
    cheapest clear one or the least harmful, may change at once. Own choice: 8 m/s² of braking build up in 0.4 s"""
    max_speed: float = Field(default=45.0, gt=0, le=120)
    """[m/s] a little above the reference speed of 40 m/s"""
    max_heading: float = Field(default=0.35, gt=0, lt=np.pi / 2)
    """[rad] largest angle between the car and the road; own choice, 20°, more than a lane change at speed needs"""

    @property
    def half_sizes(self) -> Float[np.ndarray, " 2"]:
        """[m] half length and half width."""
        return np.array([self.length / 2, self.width / 2])


def moved(state: tuple[Any, Any, Any, Any], inputs: tuple[Any, Any], dt: float) -> tuple[Any, Any, Any, Any]:
    """The Dubins car (paper §4) after inputs were held for a time; its way is the mean of those at both velocities.

    The paper takes the velocity at the start (Euler), with which a car that brakes from 40 m/s in steps of 0.25 s comes
    to rest 5 m too late. This is off by less than dt³/12·|f''| in a step, f'' being the jerk that turning makes.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad].
        inputs: acceleration [m/s²], yaw rate [rad/s].
        dt: [s].

    Returns:
        The state after dt: lon [m], lat [m], speed [m/s], heading [rad].
    """
    lon, lat, speed, heading = state
    faster, turned = speed + dt * inputs[0], heading + dt * inputs[1]
    return (
        lon + dt / 2 * (speed * np.cos(heading) + faster * np.cos(turned)),
        lat + dt / 2 * (speed * np.sin(heading) + faster * np.sin(turned)),
        faster,
        turned,
    )


def step(state: Float[np.ndarray, "*n 4"], inputs: Float[np.ndarray, "*n 2"], dt: float) -> Float[np.ndarray, "*n 4"]:
    """`moved` of states (lon, lat, speed, heading) under inputs (acceleration, yaw rate) held for dt [s]."""
    lon, lat, speed, heading = (state[..., i] for i in range(4))
    return np.stack(moved((lon, lat, speed, heading), (inputs[..., 0], inputs[..., 1]), dt), axis=-1)


def rollout(
    state: Float[np.ndarray, "*n 4"], inputs: Float[np.ndarray, "*n K 2"], dt: float
) -> Float[np.ndarray, "*n P 4"]:
    """The states that K inputs, each held for dt [s], lead to; the first is the given one."""
    states = [np.asarray(state, dtype=float)]
    for k in range(inputs.shape[-2]):
        states.append(step(states[-1], inputs[..., k, :], dt))
    return np.stack(states, axis=-2)


def feasible_inputs(
    state: Float[np.ndarray, "*n 4"], inputs: Float[np.ndarray, "*n 2"], dt: float, settings: VehicleSettings
) -> Float[np.ndarray, "*n 2"]:
    """The inputs nearest to the given ones that keep the car within its limits for one step of dt [s].

    A state outside the speed or heading bounds is not pushed further out.
    """
    return np.stack(within_limits(state[..., 2], state[..., 3], inputs[..., 0], inputs[..., 1], dt, settings), axis=-1)


def within_limits(
    speed: Any, heading: Any, acceleration: Any, yaw_rate: Any, dt: float, settings: VehicleSettings
) -> tuple[Any, Any]:
    """`feasible_inputs` of numbers, or of arrays element by element."""
    lowest = np.maximum(-settings.max_deceleration, np.minimum(0.0, -speed / dt))
    highest = np.minimum(settings.max_acceleration, np.maximum(0.0, (settings.max_speed - speed) / dt))
    yaw_bound = np.minimum(settings.max_yaw_rate, settings.max_lateral_acceleration / np.maximum(np.abs(speed), 1e-9))
    rightmost = np.maximum(-yaw_bound, np.minimum(0.0, (-settings.max_heading - heading) / dt))
    leftmost = np.minimum(yaw_bound, np.maximum(0.0, (settings.max_heading - heading) / dt))
    return np.minimum(np.maximum(acceleration, lowest), highest), np.minimum(np.maximum(yaw_rate, rightmost), leftmost)
