"""Which base trajectories would collide if everybody else kept the current speed (paper §2.3).

Every base trajectory is put on the vehicle's position and speed and checked for overlap of boxes against every other
vehicle of the scene, which drives on along the road at its present speed.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int

from coverdrive.prediction.cover.basis import Basis
from coverdrive.scene import Scene

CHECK_INTERVAL = 0.25
"""[s] between two moments at which overlap is checked; relative speeds are far below a car length per interval"""


def colliding_bases(basis: Basis, scene: Scene, own: Int[np.ndarray, " N"]) -> Bool[Array, "N M"]:
    """Whether each base trajectory of one vehicle per scene, in slot ``own``, hits another within the horizon."""
    times = np.arange(CHECK_INTERVAL, basis.horizon + 1e-9, CHECK_INTERVAL)
    deviation, _ = basis.rollout(times)
    return _collides(deviation, times, scene, own)


@jax.jit
def _collides(
    deviation: Float[Array, "M n 2"], times: Float[Array, " n"], scene: Scene, own: Int[Array, " N"]
) -> Bool[Array, "N M"]:
    slots = own[:, None]
    speed = scene.speed * jnp.cos(scene.heading)

    def own_of(values: Array | np.ndarray) -> Array:
        return jnp.take_along_axis(jnp.asarray(values), slots, axis=1)

    others = scene.valid & (jnp.arange(scene.vehicles) != slots)
    lon, lat, closing = (values - own_of(values) for values in (scene.lon, scene.lat, speed))
    length, width = ((sizes + own_of(sizes)) / 2 for sizes in (scene.length, scene.width))
    hit = jnp.zeros((len(own), deviation.shape[0]), dtype=bool)
    for k in range(len(times)):
        apart_lon = (lon + closing * times[k])[:, None, :] - deviation[None, :, k, 0, None]
        apart_lat = lat[:, None, :] - deviation[None, :, k, 1, None]
        overlap = (jnp.abs(apart_lon) < length[:, None, :]) & (jnp.abs(apart_lat) < width[:, None, :])
        hit |= (overlap & others[:, None, :]).any(-1)
    return hit
