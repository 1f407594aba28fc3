"""The motion of the Dubins car as a function of its inputs alone, with its derivatives (condensing).

With Euler steps, speed and heading are sums of the inputs and the position is a sum of their products; so are the
derivatives. All steps of all motions are computed at once. B motions of K steps; the inputs u of a motion are its K
accelerations [m/s²] and then its K yaw rates [rad/s]. Positions are relative to the current one along the road.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float


class Course(NamedTuple):
    """Motions over the horizon: fields of the steps k = 1 … K, but for the last three, of the steps 0 … K − 1."""

    lon: Float[Array, "B K"]
    """[m]"""
    lat: Float[Array, "B K"]
    """[m]"""
    speed: Float[Array, "B K"]
    """[m/s]"""
    heading: Float[Array, "B K"]
    """[rad]"""
    speed_before: Float[Array, "B K"]
    """[m/s]"""
    cosine: Float[Array, "B K"]
    """of the heading before"""
    sine: Float[Array, "B K"]
    """of the heading before"""


def course_of(state: Float[Array | np.ndarray, " 4"], inputs: Float[Array | np.ndarray, "B U"], dt: float) -> Course:
    """Where inputs lead to.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] now.
        inputs: U = 2K inputs of every motion.
        dt: [s].
    """
    steps = inputs.shape[-1] // 2
    speed = state[2] + dt * jnp.cumsum(inputs[:, :steps], -1)
    heading = state[3] + dt * jnp.cumsum(inputs[:, steps:], -1)
    start = jnp.ones((len(inputs), 1))
    speed_before = jnp.concatenate([start * state[2], speed[:, :-1]], -1)
    heading_before = jnp.concatenate([start * state[3], heading[:, :-1]], -1)
    cosine, sine = jnp.cos(heading_before), jnp.sin(heading_before)
    lon = state[0] + dt * jnp.cumsum(speed_before * cosine, -1)
    lat = state[1] + dt * jnp.cumsum(speed_before * sine, -1)
    return Course(lon, lat, speed, heading, speed_before, cosine, sine)


def derivatives(course: Course, dt: float) -> Float[Array, "B K 4 U"]:
    """Derivatives of lon, lat, speed and heading of the steps k = 1 … K with respect to the inputs."""
    motions, steps = course.lon.shape
    earlier = np.tril(np.ones((steps, steps)), -1)
    """[k, j]: the input of step j acts on the position after step k"""

    def between(values: Array) -> Array:
        return (values[:, :, None] - values[:, None, :]) * earlier

    ahead = jnp.concatenate([dt**2 * between(jnp.cumsum(course.cosine, -1)), -dt * between(course.lat)], -1)
    aside = jnp.concatenate([dt**2 * between(jnp.cumsum(course.sine, -1)), dt * between(course.lon)], -1)
    summed = dt * np.tril(np.ones((steps, steps)))
    fixed = np.stack([np.hstack([summed, 0 * summed]), np.hstack([0 * summed, summed])], axis=1)
    turned = jnp.broadcast_to(fixed, (motions, steps, 2, 2 * steps))
    return jnp.concatenate([ahead[:, :, None], aside[:, :, None], turned], axis=2)
