"""What the network sees of an affordance: the paper's 21 features alone, or what drivers judge by as well.

The derived inputs are, for each of the five neighbours, the inverse of its clearance, the inverse of the time to
collision (relative speed over clearance, positive while the clearance shrinks) and the clearance as a time gap; and,
for the vehicle itself, its distance from the lane's centre to either side, the logarithm of its speed and whether it
crawls. With the motion, the lateral speed follows them: it shows a lane change that has begun.

Few vehicles are easily learned by heart, by the sizes of those around them and by where they drive in their lanes.
"urgency" leaves these out, and all of what is said twice: of every neighbour it has the relative speed and the inverses
of clearance and time to collision.
"""

from typing import Literal

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from coverdrive.prediction.learning.affordance import FEATURES

Inputs = Literal["affordance", "derived", "motion", "urgency"]
"""The paper's features; what is derived from them as well; and the lateral speed of the vehicle itself; or of all that
only what tells how urgent it is to do something"""

_NEIGHBOURS = ("front", "left front", "right front", "left rear", "right rear")
_OWN = ("speed", "distance to lane centre", "front clearance")
_URGENT = [FEATURES.index(name) for name in (*_OWN, *(f"{each} relative speed" for each in _NEIGHBOURS))]
"""columns of the features that are left where only the urgency counts"""
_CLOSEST = 1.0
"""[m] clearances below it are taken as this much where they divide"""
_FASTEST = 10.0
"""[m/s] relative speeds are clipped to ± this value"""
_CRAWLING = 3.0
"""[m/s]"""


def network_inputs(features: Float[Array | np.ndarray, "*batch F"], inputs: Inputs) -> Float[Array, "*batch I"]:
    """The features alone, some of them, or all, followed by what is derived from them, and by the lateral speed.

    The features are in the order of `FEATURES`; for "motion" and "urgency", `MOTION` follows them.
    """
    values, motion = jnp.split(jnp.asarray(features), [len(FEATURES)], axis=-1)
    if inputs == "affordance":
        return values
    speed, offset = (
        values[..., FEATURES.index("speed")],
        jnp.abs(values[..., FEATURES.index("distance to lane centre")]),
    )
    crawls = jnp.where(speed < _CRAWLING, 1.0, 0.0)
    urgency = [_urgency(values, speed, neighbour) for neighbour in _NEIGHBOURS]
    if inputs == "urgency":
        columns = [*urgency[0], *(column for each in urgency[1:] for column in each[:2]), offset, crawls]
        return jnp.concatenate([values[..., _URGENT], jnp.stack(columns, axis=-1), motion], axis=-1)
    columns = [*(column for each in urgency for column in each), offset, jnp.log1p(jnp.maximum(speed, 0)), crawls]
    derived = [values, jnp.stack(columns, axis=-1)]
    return jnp.concatenate([*derived, motion] if inputs == "motion" else derived, axis=-1)


def _urgency(values: Array, speed: Array, neighbour: str) -> tuple[Array, Array, Array]:
    """Inverse clearance [1/m], inverse time to collision [1/s] and time gap [s] of one neighbour."""
    clearance = values[..., FEATURES.index(f"{neighbour} clearance")]
    relative = values[..., FEATURES.index(f"{neighbour} relative speed")]
    closing = jnp.clip(relative if "rear" in neighbour else -relative, -_FASTEST, _FASTEST)
    inverse = 1 / jnp.maximum(clearance, _CLOSEST)
    return inverse, closing * inverse, jnp.clip(clearance / jnp.maximum(speed, 1.0), -1, 5)
