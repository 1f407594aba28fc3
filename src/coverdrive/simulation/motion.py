"""Motion of uncontrolled vehicles: states over time, and base trajectories put on a state.

A state is (lon [m], lat [m], speed [m/s], heading [rad]), as in `coverdrive.planning.plan.Plan`. A vehicle slots,
M base trajectories, n times.
"""

import numpy as np
from jaxtyping import Float

from coverdrive.scene import Scene

_BACKWARDS = -1e-6
"""[m/s] a longitudinal speed below this counts as going backwards; rounding stays above it"""


def states_of(scene: Scene) -> Float[np.ndarray, "*batch A 4"]:
    """The states of all slots of a scene."""
    return np.stack([scene.lon, scene.lat, scene.speed, scene.heading], axis=-1)


def half_sizes_of(scene: Scene) -> Float[np.ndarray, "*batch A 2"]:
    """Half length and half width [m] of all slots of a scene."""
    return np.stack([scene.length, scene.width], axis=-1) / 2


def with_states(scene: Scene, states: Float[np.ndarray, "*batch A 4"]) -> Scene:
    """The same vehicles in other states."""
    lon, lat, speed, heading = np.moveaxis(states, -1, 0)
    return Scene(lon, lat, speed, heading, scene.length, scene.width, scene.valid)


def constant_velocity(
    states: Float[np.ndarray, "*batch 4"], times: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "*batch n 4"]:
    """The states of vehicles that keep speed and heading, at ``times`` [s] from now."""
    lon, lat, speed, heading = (states[..., None, i] for i in range(4))
    ahead = np.zeros((*states.shape[:-1], len(times)))
    return np.stack(
        [
            lon + speed * np.cos(heading) * times,
            lat + speed * np.sin(heading) * times,
            speed + ahead,
            heading + ahead,
        ],
        axis=-1,
    )


def follow(
    state: Float[np.ndarray, " 4"],
    times: Float[np.ndarray, " n"],
    deviation: Float[np.ndarray, "M n 2"],
    rate: Float[np.ndarray, "M n 2"],
) -> Float[np.ndarray, "M n 4"]:
    """Every base trajectory put on a vehicle's position and longitudinal speed (Remark 1).

    A vehicle that would go backwards stops instead, and stays where it is for the rest of the base trajectory.

    Args:
        state: of the vehicle at time 0.
        times: ascending, from 0 [s].
        deviation: of the base trajectories from constant velocity, along lon and lat [m].
        rate: of that deviation [m/s].
    """
    speed_lon = state[2] * np.cos(state[3])
    velocity = rate + np.array([speed_lon, 0.0])
    position = state[:2] + deviation + speed_lon * times[:, None] * np.array([1.0, 0.0])
    stopped = np.logical_or.accumulate(velocity[..., 0] < _BACKWARDS, axis=1)
    last = np.maximum.accumulate(np.where(stopped, 0, np.arange(len(times))), axis=1)
    position, velocity = (np.take_along_axis(array, last[..., None], axis=1) for array in (position, velocity))
    speed = np.where(stopped, 0.0, np.hypot(velocity[..., 0], velocity[..., 1]))
    heading = np.arctan2(velocity[..., 1], np.maximum(velocity[..., 0], 0.0))
    return np.concatenate([position, speed[..., None], heading[..., None]], axis=-1)
