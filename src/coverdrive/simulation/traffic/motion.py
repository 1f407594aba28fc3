"""Motion of uncontrolled vehicles: their states over time.

A state is (lon [m], lat [m], speed [m/s], heading [rad]), as in `coverdrive.plan.Plan`. A vehicle slots, n times.
"""

import numpy as np
from jaxtyping import Float

from coverdrive.scene import Scene


def with_states(scene: Scene, states: Float[np.ndarray, "*batch A 4"]) -> Scene:
    """The same vehicles in other states."""
    lon, lat, speed, heading = (states[..., i] for i in range(4))
    return Scene(lon, lat, speed, heading, scene.length, scene.width, scene.valid)


def constant_velocity(
    states: Float[np.ndarray, "*batch 4"], times: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "*batch n 4"]:
    """The states of vehicles that keep speed and heading, at ``times`` [s] from now."""
    lon, lat, speed, heading = (states[..., None, i] for i in range(4))
    result = np.empty((*states.shape[:-1], len(times), 4))
    result[..., 0], result[..., 1] = lon + speed * np.cos(heading) * times, lat + speed * np.sin(heading) * times
    result[..., 2], result[..., 3] = speed, heading
    return result
