"""Boxes that are to hold the body of a vehicle, how far segments are outside, and the family of sets that scale them.

A box has a centre, as deviation from constant velocity, and half sizes by which it is larger than the body, at each of
the P points after the start. Instead of it there may be the A arms of a cross: boxes around its centre, each of which
has some share of its length and of its width. The sets are nested in one number: all half sizes are r times as large
as they were learned. A segment is in the set from the least r on with which its whole body is in the boxes, of one arm,
at all points. Its score is 1/(1 + r), so that every method of calibration (`coverdrive.certificates`) finds a threshold
as for one base.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.rule import LEAST
from coverdrive.geometry import turned_half_extents
from coverdrive.prediction.parts import parts
from coverdrive.prediction.segments import Segments

TUBE = 1.0
"""distance from which on a segment counts as outside every set"""

WHOLE = np.ones((1, 2))
"""arms of boxes that are no crosses"""

_COMMON, _NARROWEST = 0.99, 0.05
"""quantile of the deviations from constant velocity that shapes its box, and the least half size [m] of it"""


@dataclass(frozen=True)
class Boxes:
    """Boxes for N moments, at r = 1."""

    centre: Float[np.ndarray, "N P 2"]
    """[m] deviation from constant velocity along lon and lat"""
    half_sizes: Float[np.ndarray, "N P 2"]
    """[m] half extents beyond those of the body"""
    arms: Float[np.ndarray, "A 2"] = field(default_factory=lambda: WHOLE)
    """shares of the half sizes that the arms have along lon and lat"""

    @property
    def areas(self) -> Float[np.ndarray, "N P"]:
        """[m²] that the centre of the vehicle may be in: the union of the arms."""
        along, across = self.arms[np.argsort(-self.arms[:, 0])].T
        taken = -np.diff(along, append=0) @ np.maximum.accumulate(across)
        return 4 * taken * self.half_sizes.prod(-1)


def beyond_box(segments: Segments, centre: Float[np.ndarray, "N P 2"]) -> Float[np.ndarray, "N P 2"]:
    """[m] from a centre to the farthest side of the body along lon and lat, less the half sizes of the body."""
    return np.abs(segments.points[:, 1:] - centre) + body_excess(segments)


def body_excess(segments: Segments) -> Float[np.ndarray, "N P 2"]:
    """[m] by which a body reaches farther along lon and lat because it is turned."""
    straight = segments.half_sizes[:, None]
    return turned_half_extents(straight, segments.heading[:, 1:]) - straight


def scored_by(boxes: Boxes, segments: Segments) -> ScoredSamples:
    """The scores of segments; they all drove the one base that there is. The boxes of one moment may stand for all."""
    count, shape = len(segments), segments.points[:, 1:].shape
    centre, half_sizes = (np.broadcast_to(each, shape) for each in (boxes.centre, boxes.half_sizes))
    ratio = np.empty(count)
    for part in parts(count):
        farthest = (beyond_box(segments.of(part), centre[part]) / half_sizes[part]).max(1)
        ratio[part] = (farthest[:, None] / boxes.arms).max(2).min(1)
    score = 1 / (1 + np.maximum(ratio, 0))
    outside = np.where(score < LEAST, 2 * TUBE, 0.0)
    nobody, area = np.zeros(count, dtype=np.int64), np.broadcast_to(boxes.areas.mean(1), count)
    return ScoredSamples(score[:, None], nobody, outside, segments.vehicle, None, segments.group, area)


def constant_velocity(training: Segments) -> Boxes:
    """The trivial predictor: around constant velocity, by the quantiles of the training deviations at every point.

    The boxes of one moment, which are those of all.
    """
    common = np.quantile(np.abs(training.points[:, 1:]), _COMMON, axis=0, keepdims=True)
    return Boxes(np.zeros(common.shape), np.maximum(common, _NARROWEST))
