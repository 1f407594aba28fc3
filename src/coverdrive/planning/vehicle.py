"""The own car: a Dubins car with a speed, discretised by Euler steps (paper §4).

State: lon [m], lat [m], speed [m/s], heading [rad]. Input: acceleration [m/s²], yaw rate [rad/s], held for dt.
`euler_step` is the one definition of the motion. It knows no array library: the optimisation problem calls it with
CasADi symbols and `casadi`, everything else through `step` and `rollout` with NumPy or JAX arrays.
P = K + 1 is the number of states.
"""

from typing import Any

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.settings import Settings


class VehicleSettings(Settings):
    """Size and limits of the own car."""

    length: float = Field(default=4.8, gt=0)
    """[m] a mid-size sedan (AASHTO Green Book 2018, passenger car: 5.8 m at the most; NGSIM US-101 median: 4.6 m)"""
    width: float = Field(default=1.9, gt=0)
    """[m] a mid-size sedan without mirrors"""
    max_acceleration: float = Field(default=3.0, gt=0)
    """[m/s²] brisk but ordinary (CommonRoad vehicle parameters: up to 11.5; the authors' scripts allow 2000)"""
    max_deceleration: float = Field(default=8.0, gt=0)
    """[m/s²] full braking on dry asphalt (0.8 g; UN R13-H asks for at least 6.43 m/s²)"""
    max_yaw_rate: float = Field(default=0.5, gt=0)
    """[rad/s] bound at low speed; at speed `max_lateral_acceleration` is the tighter one"""
    max_lateral_acceleration: float = Field(default=4.0, gt=0)
    """[m/s²] bound of speed · yaw rate, half of what dry asphalt gives"""
    max_speed: float = Field(default=45.0, gt=0)
    """[m/s] a little above the reference speed of 40 m/s"""
    max_heading: float = Field(default=0.35, gt=0, lt=np.pi / 2)
    """[rad] largest angle between the car and the road"""

    @property
    def half_sizes(self) -> Float[np.ndarray, " 2"]:
        """[m] half length and half width."""
        return np.array([self.length / 2, self.width / 2])


def euler_step(
    lon: Any, lat: Any, speed: Any, heading: Any, acceleration: Any, yaw_rate: Any, dt: float, mathematics: Any = np
) -> tuple[Any, Any, Any, Any]:
    """One Euler step of the Dubins car (paper §4, the model above the optimal control problem).

    Args:
        lon: [m].
        lat: [m].
        speed: [m/s].
        heading: [rad].
        acceleration: [m/s²].
        yaw_rate: [rad/s].
        dt: [s].
        mathematics: the module with ``cos`` and ``sin`` for the arguments: ``numpy`` or ``casadi``.

    Returns:
        The state after dt: lon [m], lat [m], speed [m/s], heading [rad].
    """
    return (
        lon + dt * speed * mathematics.cos(heading),
        lat + dt * speed * mathematics.sin(heading),
        speed + dt * acceleration,
        heading + dt * yaw_rate,
    )


def step(state: Float[Any, "*n 4"], inputs: Float[Any, "*n 2"], dt: float, mathematics: Any = np) -> Float[Any, "*n 4"]:
    """One Euler step of states (lon, lat, speed, heading) under inputs (acceleration, yaw rate) held for dt [s]."""
    lon, lat, speed, heading = (state[..., i] for i in range(4))
    after = euler_step(lon, lat, speed, heading, inputs[..., 0], inputs[..., 1], dt, mathematics)
    return mathematics.stack(after, axis=-1)


def rollout(
    state: Float[np.ndarray, "*n 4"], inputs: Float[np.ndarray, "*n K 2"], dt: float
) -> Float[np.ndarray, "*n P 4"]:
    """The states that K inputs, each held for dt [s], lead to; the first is the given one."""
    states = [np.asarray(state, dtype=float)]
    for k in range(inputs.shape[-2]):
        states.append(step(states[-1], inputs[..., k, :], dt))
    return np.stack(states, axis=-2)


def feasible_inputs(
    state: Float[Any, "*n 4"],
    inputs: Float[Any, "*n 2"],
    dt: float,
    settings: VehicleSettings,
    mathematics: Any = np,
) -> Float[Any, "*n 2"]:
    """The inputs nearest to the given ones that keep the car within its limits for one step of dt [s].

    A state outside the speed or heading bounds is not pushed further out.
    """
    m = mathematics
    speed, heading = state[..., 2], state[..., 3]
    lowest = m.maximum(-settings.max_deceleration, m.minimum(0.0, -speed / dt))
    highest = m.minimum(settings.max_acceleration, m.maximum(0.0, (settings.max_speed - speed) / dt))
    yaw_bound = m.minimum(settings.max_yaw_rate, settings.max_lateral_acceleration / m.maximum(m.abs(speed), 1e-9))
    rightmost = m.maximum(-yaw_bound, m.minimum(0.0, (-settings.max_heading - heading) / dt))
    leftmost = m.minimum(yaw_bound, m.maximum(0.0, (settings.max_heading - heading) / dt))
    return m.stack([m.clip(inputs[..., 0], lowest, highest), m.clip(inputs[..., 1], rightmost, leftmost)], axis=-1)
