"""How far along the road the ego can be at every step, whatever it does within its limits."""

from typing import Any

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled


def reachable_range(
    state: Float[np.ndarray, " 4"], steps: int, dt: float, vehicle: Any
) -> tuple[Float[np.ndarray, " P"], Float[np.ndarray, " P"]]:
    """Interval that holds every position of the ego's centre along the road at the times k·dt, k = 0 … K.

    Speed and heading take their extremes each on its own, so that the interval is too long, never too short; the way is
    the trapezoidal sum that `coverdrive.planning.vehicle.moved` makes.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] now.
        steps: K.
        dt: [s].
        vehicle: limits of the ego.

    Returns:
        [m] least and largest lon.
    """
    lon, _, speed, heading = state
    cosine = np.cos(max(abs(heading), vehicle.max_heading))
    limits = (vehicle.max_deceleration, vehicle.max_acceleration, vehicle.max_speed)
    low, high = _ways(speed, cosine, steps, dt, limits)
    return lon + low, lon + high


@compiled
def _ways(
    speed: float, cosine: float, steps: int, dt: float, limits: tuple[float, float, float]
) -> tuple[Float[np.ndarray, " P"], Float[np.ndarray, " P"]]:
    """[m] least and largest way along the road."""
    deceleration, acceleration, top_speed = limits
    low, high = np.zeros(steps + 1), np.zeros(steps + 1)
    least = most = 0.0
    for k in range(steps):
        slowest = max(speed - deceleration * dt * k, min(speed, 0.0))
        fastest = min(speed + acceleration * dt * k, max(speed, top_speed))
        least += dt * min(slowest, slowest * cosine)
        most += dt * max(fastest, fastest * cosine)
        slowest = max(speed - deceleration * dt * (k + 1), min(speed, 0.0))
        fastest = min(speed + acceleration * dt * (k + 1), max(speed, top_speed))
        low[k + 1] = least - dt / 2 * (abs(speed) - min(slowest, slowest * cosine))
        high[k + 1] = most + dt / 2 * (max(fastest, fastest * cosine) - speed * cosine)
    return low, high
