"""How far along the road the own car can be at every step, whatever it does within its limits."""

import numpy as np
from jaxtyping import Float

from coverdrive.planning.vehicle import VehicleSettings


def reachable_range(
    state: Float[np.ndarray, " 4"], steps: int, dt: float, vehicle: VehicleSettings
) -> tuple[Float[np.ndarray, " K"], Float[np.ndarray, " K"]]:
    """Interval that holds every position of the own centre along the road at the steps k = 1 … K.

    Speed and heading take their extremes each on its own, so that the interval is too long, never too short.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] now.
        steps: K.
        dt: [s].
        vehicle: limits of the own car.

    Returns:
        [m] least and largest lon.
    """
    lon, _, speed, heading = state
    time = dt * np.arange(steps)
    slowest = np.maximum(speed - vehicle.max_deceleration * time, min(speed, 0.0))
    fastest = np.minimum(speed + vehicle.max_acceleration * time, max(speed, vehicle.max_speed))
    cosine = np.cos(max(abs(heading), vehicle.max_heading))
    low, high = np.minimum(slowest, slowest * cosine), np.maximum(fastest, fastest * cosine)
    return lon + dt * np.cumsum(low), lon + dt * np.cumsum(high)
