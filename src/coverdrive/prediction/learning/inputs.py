"""What the network sees of an affordance: the paper's 21 features alone, or what drivers judge by as well.

The derived inputs are, for each of the five neighbours, the inverse of its clearance, the inverse of the time to
collision (relative speed over clearance, positive while the clearance shrinks) and the clearance as a time gap; and,
for the vehicle itself, its distance from the lane's centre to either side, the logarithm of its speed and whether it
crawls. With the motion, the lateral speed follows them: it shows a lane change that has begun.
"""

from typing import Literal

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from coverdrive.prediction.learning.affordance import FEATURES

Inputs = Literal["affordance", "derived", "motion"]
"""The paper's features; what is derived from them as well; and the lateral speed of the vehicle itself"""

_NEIGHBOURS = ("front", "left front", "right front", "left rear", "right rear")
_CLOSEST = 1.0
"""[m] clearances below it are taken as this much where they divide"""
_FASTEST = 10.0
"""[m/s] relative speeds are clipped to ± this value"""
_CRAWLING = 3.0
"""[m/s]"""


def network_inputs(features: Float[Array | np.ndarray, "*batch F"], inputs: Inputs) -> Float[Array, "*batch I"]:
    """The features alone, or followed by what is derived from them, and by the lateral speed.

    The features are in the order of `FEATURES`; for "motion", `MOTION` follows them.
    """
    values, motion = jnp.split(jnp.asarray(features), [len(FEATURES)], axis=-1)
    if inputs == "affordance":
        return values
    speed = values[..., FEATURES.index("speed")]
    columns = [column for neighbour in _NEIGHBOURS for column in _urgency(values, speed, neighbour)]
    columns += [
        jnp.abs(values[..., FEATURES.index("distance to lane centre")]),
        jnp.log1p(jnp.maximum(speed, 0)),
        jnp.where(speed < _CRAWLING, 1.0, 0.0),
    ]
    derived = [values, jnp.stack(columns, axis=-1)]
    return jnp.concatenate([*derived, motion] if inputs == "motion" else derived, axis=-1)


def _urgency(values: Array, speed: Array, neighbour: str) -> tuple[Array, Array, Array]:
    """Inverse clearance [1/m], inverse time to collision [1/s] and time gap [s] of one neighbour."""
    clearance = values[..., FEATURES.index(f"{neighbour} clearance")]
    relative = values[..., FEATURES.index(f"{neighbour} relative speed")]
    closing = jnp.clip(relative if "rear" in neighbour else -relative, -_FASTEST, _FASTEST)
    inverse = 1 / jnp.maximum(clearance, _CLOSEST)
    return inverse, closing * inverse, jnp.clip(clearance / jnp.maximum(speed, 1.0), -1, 5)
