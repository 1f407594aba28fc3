"""Bodies in the boxes of a path: what makes a certificate a statement about what planning keeps clear of.

Around every point of a path there is a box: the vehicle's body, turned as the base trajectory turns, and the tube. A
vehicle in the tube sticks out of the box if it is turned otherwise, so its body has to stay in the boxes as well for a
base to cover what it did. A base that would go backwards is measured as it is; predicted, it stands still
(`motion.follow`), nearer to a vehicle that does not go backwards either: the covered stays in the predicted boxes.
"""

import numpy as np
from jaxtyping import Float

from coverdrive.geometry import turned_half_extents
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.motion import follow
from coverdrive.prediction.segments import Segments

_CHUNK = 65_536


def body_radius(basis: Basis, segments: Segments) -> Float[np.ndarray, "N M"]:
    """The least radius of the tube around every base with which the boxes hold the whole body at every point."""
    parts = (np.arange(i, min(i + _CHUNK, len(segments))) for i in range(0, len(segments), _CHUNK))
    return np.concatenate([np.zeros((0, len(basis))), *(_distance(basis, segments.of(part)) for part in parts)])


def _distance(basis: Basis, segments: Segments) -> Float[np.ndarray, "N M"]:
    """The same of a few segments."""
    tube, (deviation, rate) = basis.tube(basis.times)[1:], basis.rollout(basis.times)
    body = turned_half_extents(segments.half_sizes[:, None], segments.heading)
    still = np.zeros(len(segments))
    state = np.stack([still, still, segments.speed, still], axis=-1)
    result = np.empty((len(segments), len(basis)))
    for base, points in enumerate(basis.points):
        heading = follow(state, basis.times, deviation[base], rate[base])[..., 3]
        beyond = body - turned_half_extents(segments.half_sizes[:, None], heading)
        result[:, base] = ((np.abs(segments.points - points) + beyond)[:, 1:] / tube).max((1, 2))
    return result
