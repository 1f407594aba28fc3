"""Base trajectories put on a vehicle: the motion that is predicted, and that the paper's traffic drives (Remark 1).

A state is (lon [m], lat [m], speed [m/s], heading [rad]); n times.
"""

import numpy as np
from jaxtyping import Float

_CREEP = 1.0
"""[m/s] below this speed the direction of motion says little about where a vehicle points"""


def follow(
    state: Float[np.ndarray, "*batch 4"],
    times: Float[np.ndarray, " n"],
    deviation: Float[np.ndarray, "*bases n 2"],
    rate: Float[np.ndarray, "*bases n 2"],
) -> Float[np.ndarray, "*broadcast n 4"]:
    """Base trajectories put on the position and longitudinal speed of vehicles; leading axes are broadcast.

    A vehicle that would go backwards stands still along the road instead. The speed is such that its component along
    the road is exact.

    Args:
        state: of the vehicles at time 0.
        times: ascending, from 0 [s].
        deviation: of the base trajectories from constant velocity, along lon and lat [m].
        rate: of that deviation [m/s].
    """
    lon, lat, speed, heading = (state[..., None, index] for index in range(4))
    initial_speed = speed * np.cos(heading)
    unbounded = initial_speed * times + deviation[..., 0]
    forward = np.maximum.accumulate(unbounded, axis=-1)
    speed_lon = np.where(forward > unbounded, 0.0, np.maximum(initial_speed + rate[..., 0], 0.0))
    heading = np.arctan2(rate[..., 1], np.maximum(speed_lon, _CREEP))
    return np.stack([lon + forward, lat + deviation[..., 1], speed_lon / np.cos(heading), heading], axis=-1)
