"""Where the own car can be at every step, whatever it does within its limits: boxes that hold every motion."""

import numpy as np
from jaxtyping import Float

from coverdrive.planning.vehicle import VehicleSettings


def reachable_boxes(
    state: Float[np.ndarray, " 4"], steps: int, dt: float, vehicle: VehicleSettings
) -> tuple[Float[np.ndarray, "K 2"], Float[np.ndarray, "K 2"]]:
    """Boxes around every position of the own centre at the steps k = 1 … K.

    Each of speed, heading and yaw rate takes its extreme on its own, so that the boxes are too large, never too
    small.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] now.
        steps: K.
        dt: [s].
        vehicle: limits of the own car.

    Returns:
        [m] centres (lon, lat) and half sizes of the boxes.
    """
    lon, lat, speed, heading = state
    time = dt * np.arange(steps)
    slowest = np.maximum(speed - vehicle.max_deceleration * time, min(speed, 0.0))
    fastest = np.minimum(speed + vehicle.max_acceleration * time, max(speed, vehicle.max_speed))
    turned = vehicle.max_yaw_rate * time
    leftmost = np.minimum(heading + turned, max(heading, vehicle.max_heading))
    rightmost = np.maximum(heading - turned, min(heading, -vehicle.max_heading))
    widest = np.maximum(np.abs(leftmost), np.abs(rightmost))
    cosine = np.cos(np.minimum(widest, np.pi))
    sines = np.sin(np.clip([rightmost, leftmost], -np.pi / 2, np.pi / 2))
    ends = np.stack([slowest, fastest])
    ahead = _extremes(np.stack([ends * cosine, ends]))
    aside = _extremes(ends[:, None] * sines)
    low = np.stack([lon + dt * np.cumsum(ahead[0]), lat + dt * np.cumsum(aside[0])], axis=-1)
    high = np.stack([lon + dt * np.cumsum(ahead[1]), lat + dt * np.cumsum(aside[1])], axis=-1)
    return (low + high) / 2, (high - low) / 2


def _extremes(velocities: Float[np.ndarray, "2 2 K"]) -> tuple[Float[np.ndarray, " K"], Float[np.ndarray, " K"]]:
    """Lowest and highest of the velocities [m/s] at every step."""
    return velocities.min(axis=(0, 1)), velocities.max(axis=(0, 1))
