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
from jaxtyping import Float, Float32

from coverdrive.compiled import compiled
from coverdrive.prediction.learning.affordance import FEATURES

Inputs = Literal["affordance", "derived", "motion", "urgency"]
"""The paper's features; what is derived from them as well; and the lateral speed of the vehicle itself; or of all that
only what tells how urgent it is to do something"""

_NEIGHBOURS = ("front", "left front", "right front", "left rear", "right rear")
_OWN = ("speed", "distance to lane centre", "front clearance")
_URGENT = [FEATURES.index(name) for name in (*_OWN, *(f"{each} relative speed" for each in _NEIGHBOURS))]
"""columns of the features that are left where only the urgency counts"""
_CLEARANCE, _FASTER = (
    tuple(FEATURES.index(f"{each} {measure}") for each in _NEIGHBOURS) for measure in ("clearance", "relative speed")
)
"""their columns"""
_SIGNS = tuple(1 if "rear" in each else -1 for each in _NEIGHBOURS)
_APPROACHING = np.array(_SIGNS, dtype=np.float32)
"""sign of the relative speed at which their clearance shrinks"""
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
    clearance, relative = values[..., list(_CLEARANCE)], values[..., list(_FASTER)]
    inverse = 1 / jnp.maximum(clearance, _CLOSEST)
    pairs = jnp.stack([inverse, jnp.clip(_APPROACHING * relative, -_FASTEST, _FASTEST) * inverse], axis=-1)
    gaps = [jnp.clip(clearance[..., i] / jnp.maximum(speed, 1.0), -1, 5)[..., None] for i in range(len(_NEIGHBOURS))]
    if inputs == "urgency":
        others = pairs[..., 1:, :].reshape(*speed.shape, -1)
        own = jnp.stack([offset, crawls], axis=-1)
        return jnp.concatenate([values[..., _URGENT], pairs[..., 0, :], gaps[0], others, own, motion], axis=-1)
    urgency = [column for i, gap in enumerate(gaps) for column in (pairs[..., i, :], gap)]
    own = jnp.stack([offset, jnp.log1p(jnp.maximum(speed, 0)), crawls], axis=-1)
    derived = [values, *urgency, own]
    return jnp.concatenate([*derived, motion] if inputs == "motion" else derived, axis=-1)


COLUMNS: dict[Inputs, list[int]] = {
    "affordance": list(range(21)),
    "derived": list(range(39)),
    "motion": list(range(40)),
    "urgency": [*_URGENT, 21, 22, 23, *(column + 3 * i for i in range(1, 5) for column in (21, 22)), 36, 38, 39],
}
"""which of those that `write_inputs` writes a network sees"""


@compiled
def write_inputs(features: Float32[np.ndarray, "N F"], result: Float32[np.ndarray, "N I"]) -> None:
    """Write the `network_inputs` of kind "motion", among which are those of all other kinds."""
    for row in range(len(features)):
        speed = features[row, 0]
        for i in range(21):
            result[row, i] = features[row, i]
        for i in range(5):
            clearance, relative = features[row, _CLEARANCE[i]], features[row, _FASTER[i]]
            inverse = 1 / np.maximum(clearance, _CLOSEST)
            result[row, 21 + 3 * i] = inverse
            result[row, 22 + 3 * i] = np.minimum(np.maximum(_SIGNS[i] * relative, -_FASTEST), _FASTEST) * inverse
            result[row, 23 + 3 * i] = np.minimum(np.maximum(clearance / np.maximum(speed, 1.0), -1.0), 5.0)
        result[row, 36], result[row, 37] = abs(features[row, 1]), np.log1p(np.maximum(speed, 0.0))
        result[row, 38], result[row, 39] = 1.0 if speed < _CRAWLING else 0.0, features[row, 21]
