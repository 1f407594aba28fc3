"""The motion of the Dubins car as a function of its inputs, and what it becomes where the inputs change a little.

Euler steps are linear in speed, inputs and position; the heading alone bends the way. A small change of state follows
x' = A·x + B·u: speed and heading grow by dt times the change of the input, lon and lat by those of speed and heading.
One motion of K steps; its U = 2K inputs are its K accelerations [m/s²] and then its K yaw rates [rad/s].
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled


class Course(NamedTuple):
    """A motion over the horizon: the states after the steps k = 0 … K − 1, and the derivatives of these steps."""

    states: Float[np.ndarray, "K 4"]
    """lon [m], lat [m], speed [m/s], heading [rad]"""
    lon_by: Float[np.ndarray, "K 2"]
    """derivatives of the lon after each step with respect to the speed and the heading before it"""
    lat_by: Float[np.ndarray, "K 2"]
    """derivatives of the lat after each step with respect to the speed and the heading before it"""
    sines: Float[np.ndarray, " K"]
    """[s] sum of the sines of the headings times dt: derivatives of lat with respect to the speed at the start"""


@compiled
def course_of(state: Float[np.ndarray, " 4"], inputs: Float[np.ndarray, " U"], dt: float) -> Course:
    """Where inputs lead to.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] now.
        inputs: U = 2K inputs.
        dt: [s].
    """
    steps = len(inputs) // 2
    course = Course(np.empty((steps, 4)), np.empty((steps, 2)), np.empty((steps, 2)), np.empty(steps))
    lon, lat, speed, heading = state
    sines = 0.0
    for k in range(steps):
        along, across = dt * np.cos(heading), dt * np.sin(heading)
        course.lon_by[k, 0], course.lon_by[k, 1] = along, -speed * across
        course.lat_by[k, 0], course.lat_by[k, 1] = across, speed * along
        sines += across
        lon += speed * along
        lat += speed * across
        speed += dt * inputs[k]
        heading += dt * inputs[steps + k]
        course.states[k, 0], course.states[k, 1], course.states[k, 2], course.states[k, 3] = lon, lat, speed, heading
        course.sines[k] = sines
    return course


@compiled
def changes_of(course: Course, change: Float[np.ndarray, " U"], dt: float) -> Float[np.ndarray, "K 4"]:
    """Changes of the states, to first order, where the inputs change.

    Args:
        course: the motion.
        change: of the inputs.
        dt: [s].
    """
    steps, by_lon, by_lat = len(course.states), course.lon_by, course.lat_by
    result = np.empty((steps, 4))
    lon = lat = speed = heading = 0.0
    for k in range(steps):
        lon += by_lon[k, 0] * speed + by_lon[k, 1] * heading
        lat += by_lat[k, 0] * speed + by_lat[k, 1] * heading
        speed += dt * change[k]
        heading += dt * change[steps + k]
        result[k, 0], result[k, 1], result[k, 2], result[k, 3] = lon, lat, speed, heading
    return result


@compiled
def add_pulled_back(
    course: Course, by_state: Float[np.ndarray, "K 4"], dt: float, by_input: Float[np.ndarray, " U"]
) -> None:
    """Add what derivatives with respect to the states say about the inputs.

    Args:
        course: the motion.
        by_state: derivatives of anything with respect to lon, lat, speed and heading after each step.
        dt: [s].
        by_input: its derivatives with respect to the inputs, to be completed.
    """
    steps, by_lon, by_lat = len(course.states), course.lon_by, course.lat_by
    lon = lat = speed = heading = 0.0
    for k in range(steps - 1, -1, -1):
        lon += by_state[k, 0]
        lat += by_state[k, 1]
        speed += by_state[k, 2]
        heading += by_state[k, 3]
        by_input[k] += dt * speed
        by_input[steps + k] += dt * heading
        speed += by_lon[k, 0] * lon + by_lat[k, 0] * lat
        heading += by_lon[k, 1] * lon + by_lat[k, 1] * lat


@compiled
def add_lat_curvature(
    course: Course, weight: Float[np.ndarray, " K"], dt: float, result: Float[np.ndarray, " U"]
) -> None:
    """Add half the second derivatives (Gauss–Newton) of weighted squares of lat with respect to every single input.

    Args:
        course: the motion.
        weight: of the square of each step.
        dt: [s].
        result: to be completed.
    """
    steps = len(course.states)
    for j in range(steps):
        for k in range(j + 1, steps):
            result[j] += weight[k] * (dt * (course.sines[k] - course.sines[j])) ** 2
            result[steps + j] += weight[k] * (dt * (course.states[k, 0] - course.states[j, 0])) ** 2
