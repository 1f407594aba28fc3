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

import numpy as np
from jaxtyping import Float, Float32

from coverdrive.compiled import compiled
from coverdrive.prediction.data.parts import aligned
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
"""of the relative speed at which their clearance shrinks"""
_CLOSEST = 1.0
"""[m] clearances below it are taken as this much where they divide"""
_FASTEST = 10.0
"""[m/s] relative speeds are clipped to ± this value"""
_CRAWLING = 3.0
"""[m/s]"""

COLUMNS: dict[Inputs, list[int]] = {
    "affordance": list(range(21)),
    "derived": list(range(39)),
    "motion": list(range(40)),
    "urgency": [*_URGENT, 21, 22, 23, *(column + 3 * i for i in range(1, 5) for column in (21, 22)), 36, 38, 39],
}
"""which of those of kind "motion" a network sees"""


def network_inputs(features: Float[np.ndarray, "N F"], inputs: Inputs) -> Float32[np.ndarray, "N I"]:
    """The features alone, some of them, or all, followed by what is derived from them, and by the lateral speed.

    The features are in the order of `FEATURES`; for "motion" and "urgency", `MOTION` follows them.
    """
    every = aligned(len(features), len(COLUMNS["motion"]))
    _write_inputs(np.ascontiguousarray(features, dtype=np.float32), every)
    return every if inputs == "motion" else every.take(COLUMNS[inputs], axis=1)


@compiled
def _write_inputs(features: Float32[np.ndarray, "N F"], result: Float32[np.ndarray, "N I"]) -> None:
    """Write the inputs of kind "motion", among which are those of all other kinds."""
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
        result[row, 38] = 1.0 if speed < _CRAWLING else 0.0
        result[row, 39] = features[row, 21] if features.shape[1] > 21 else 0.0
