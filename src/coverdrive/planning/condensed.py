"""The motion of the Dubins car as a function of its inputs alone, with its derivatives (condensing).

With Euler steps, speed and heading are sums of the inputs and the position is a sum of their products; so are the
derivatives. One motion of K steps; its U = 2K inputs are its K accelerations [m/s²] and then its K yaw rates [rad/s].
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.planning.compiled import compiled


class Course(NamedTuple):
    """A motion over the horizon: the states of the steps k = 1 … K, and what their derivatives are made of."""

    lon: Float[np.ndarray, " K"]
    """[m]"""
    lat: Float[np.ndarray, " K"]
    """[m]"""
    speed: Float[np.ndarray, " K"]
    """[m/s]"""
    heading: Float[np.ndarray, " K"]
    """[rad]"""
    cosines: Float[np.ndarray, " K"]
    """sum of the cosines of the headings of the steps 0 … k − 1"""
    sines: Float[np.ndarray, " K"]
    """sum of their sines"""


@compiled
def course_of(state: Float[np.ndarray, " 4"], inputs: Float[np.ndarray, " U"], dt: float) -> Course:
    """Where inputs lead to.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] now.
        inputs: U = 2K inputs.
        dt: [s].
    """
    steps = len(inputs) // 2
    values = np.empty((6, steps))
    lon, lat, speed, heading = state
    cosines = sines = 0.0
    for k in range(steps):
        cosine, sine = np.cos(heading), np.sin(heading)
        cosines += cosine
        sines += sine
        lon += dt * speed * cosine
        lat += dt * speed * sine
        speed += dt * inputs[k]
        heading += dt * inputs[steps + k]
        values[0, k], values[1, k], values[2, k], values[3, k] = lon, lat, speed, heading
        values[4, k], values[5, k] = cosines, sines
    return Course(values[0], values[1], values[2], values[3], values[4], values[5])


@compiled
def pull_back(
    course: Course, k: int, state: tuple[float, float, float, float], dt: float, result: Float[np.ndarray, " U"]
) -> None:
    """Derivatives with respect to the inputs of anything that depends on the state of one step.

    Args:
        course: the motion.
        k: index of the step, from 0.
        state: derivatives with respect to lon, lat, speed and heading.
        dt: [s].
        result: where the derivatives with respect to the inputs are written.
    """
    steps = len(course.lon)
    by_lon, by_lat, by_speed, by_heading = state
    for j in range(k):
        along = by_lon * (course.cosines[k] - course.cosines[j]) + by_lat * (course.sines[k] - course.sines[j])
        across = by_lat * (course.lon[k] - course.lon[j]) - by_lon * (course.lat[k] - course.lat[j])
        result[j] = dt * (dt * along + by_speed)
        result[steps + j] = dt * (across + by_heading)
    result[k] = dt * by_speed
    result[steps + k] = dt * by_heading
    result[k + 1 : steps] = 0.0
    result[steps + k + 1 :] = 0.0
