"""Base trajectories put on a vehicle: the motion that is predicted, and that the paper's traffic drives (Remark 1).

A state is (lon [m], lat [m], speed [m/s], heading [rad]); n times.
"""

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled
from coverdrive.geometry import turned_extents

_CREEP = 1.0
"""[m/s] below this speed the direction of motion says little about where a vehicle points"""

_turned_extents = compiled(turned_extents)


def follow(
    state: Float[np.ndarray, "*batch 4"],
    times: Float[np.ndarray, " n"],
    deviation: Float[np.ndarray, "*bases n 2"],
    rate: Float[np.ndarray, "*bases n 2"],
) -> Float[np.ndarray, "*broadcast n 4"]:
    """Base trajectories put on the position and longitudinal speed of vehicles; leading axes are broadcast.

    A vehicle that would go backwards stands still along the road instead. The speed is such that its component along
    the road is exact. ``times`` [s] ascend from 0; ``deviation`` [m] is from constant velocity, along lon and lat, and
    ``rate`` [m/s] its rate.
    """
    shape = np.broadcast_shapes(state.shape[:-1], deviation.shape[:-2], rate.shape[:-2])
    result = np.empty((*shape, len(times), 4))
    _follow(_rows(state, shape, 1), times, _rows(deviation, shape, 2), _rows(rate, shape, 2), _rows(result, shape, 2))
    return result


def _rows(values: np.ndarray, shape: tuple[int, ...], own: int) -> np.ndarray:
    """Values with their leading axes broadcast and made one; the ``own`` last axes stay."""
    inner = values.shape[-own:]
    if values.shape != (*shape, *inner):
        values = np.broadcast_to(values, (*shape, *inner))
    return np.ascontiguousarray(values, dtype=float).reshape(-1, *inner)


@compiled
def _follow(
    state: Float[np.ndarray, "m 4"],
    times: Float[np.ndarray, " n"],
    deviation: Float[np.ndarray, "m n 2"],
    rate: Float[np.ndarray, "m n 2"],
    result: Float[np.ndarray, "m n 4"],
) -> None:
    for i in range(len(state)):
        initial_speed, forward = state[i, 2] * np.cos(state[i, 3]), -np.inf
        for k in range(len(times)):
            unbounded = initial_speed * times[k] + deviation[i, k, 0]
            standing = forward > unbounded
            forward = forward if standing else unbounded
            speed_lon = 0.0 if standing else np.maximum(initial_speed + rate[i, k, 0], 0.0)
            heading = np.arctan2(rate[i, k, 1], np.maximum(speed_lon, _CREEP))
            result[i, k, 0], result[i, k, 1] = state[i, 0] + forward, state[i, 1] + deviation[i, k, 1]
            result[i, k, 2], result[i, k, 3] = speed_lon / np.cos(heading), heading


@compiled
def add_bodies(
    half_sizes: Float[np.ndarray, "S n 2"], body: Float[np.ndarray, "S 2"], motion: Float[np.ndarray, "S n 4"]
) -> None:
    """Add the half extents [m] of bodies, turned as in their motions, to ``half_sizes`` of boxes around their centres.

    A body is its half length and half width [m].
    """
    for i in range(len(body)):
        for k in range(motion.shape[1]):
            along, across = _turned_extents(body[i, 0], body[i, 1], motion[i, k, 3])
            half_sizes[i, k, 0] += along
            half_sizes[i, k, 1] += across
