"""Boxes that are to hold the body of a vehicle, how far segments are outside, and the family of sets that scale them.

A box has a centre, as deviation from constant velocity, and half sizes by which it is larger than the body, at each of
the P points after the start; between them there are more (`between`). Instead of it there may be the A arms of a cross:
boxes around its centre, each of which has some share of its length and of its width. The sets are nested in one number:
all half sizes are r times as large as they were learned. A segment is in the set from the least r on with which its
whole body is in the boxes, of one arm, at every moment at which it is watched. Its score is 1/(1 + r), so that every
method of calibration (`coverdrive.certificates`) finds a threshold as for one base.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.rule import LEAST
from coverdrive.geometry import turned_half_extents
from coverdrive.prediction.data.parts import PART, parts
from coverdrive.prediction.data.segments import Segments, watched
from coverdrive.recordings.recording import Recording

TUBE = 1.0
"""distance from which on a segment counts as outside every set"""

WHOLE = np.ones((1, 2))
"""arms of boxes that are no crosses"""

_CLOSEST = 1e-6
"""[m] below which a reach counts as this"""

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
    early: Float[np.ndarray, " 2"] = field(default_factory=lambda: np.zeros(2))
    """share of the first half sizes that the boxes of now have: where a vehicle is is not known exactly"""

    @property
    def areas(self) -> Float[np.ndarray, "N P"]:
        """[m²] that the centre of the vehicle may be in: the union of the arms."""
        along, across = self.arms[np.argsort(-self.arms[:, 0])].T
        taken = -np.diff(along, append=0) @ np.maximum.accumulate(across)
        return 4 * taken * self.half_sizes.prod(-1)


def beyond_box(segments: Segments, centre: Float[np.ndarray, "#N #P 2"]) -> Float[np.ndarray, "N P 2"]:
    """[m] from a centre to the farthest side of the body along lon and lat, less the half sizes of the body."""
    return np.abs(segments.points[:, 1:] - centre) + body_excess(segments)


def body_excess(segments: Segments) -> Float[np.ndarray, "N P 2"]:
    """[m] by which a body reaches farther along lon and lat because it is turned."""
    straight = segments.half_sizes[:, None]
    return turned_half_extents(straight, segments.heading[:, 1:]) - straight


@cache
def between(
    points: int, step: float, times: tuple[float, ...]
) -> tuple[Float[np.ndarray, "K P"], Float[np.ndarray, "K P"], Float[np.ndarray, " K"]]:
    """What boxes at any times are made of, if they were learned at P points ``step`` apart after now.

    The first two say how much of each point is in the centre and in the half size, the third, in which part of the
    first half size they begin. Halfway between two points, centres are on cubic splines; all the rest are lines, so
    that a planner that looks at every half step, and goes straight in between, sees the same boxes.
    """
    knots, grid = step * np.arange(points + 1), step / 2 * np.arange(2 * points + 1)
    unit = np.eye(points + 1)[1:]
    halfway = CubicSpline(knots, unit.T)(grid)
    place, size = (
        np.stack([np.interp(times, known, each) for each in values], axis=-1)
        for known, values in ((grid, halfway.T), (knots, unit))
    )
    return place, size, np.maximum(1 - np.array(times) / step, 0)


def scored_by(boxes: Boxes, segments: Segments, recordings: Sequence[Recording] = ()) -> ScoredSamples:
    """The scores of segments; they all drove the one base that there is. The boxes of one moment may stand for all.

    Bodies are watched at all moments of the recordings that they were cut from, without these at their points alone.
    """
    count, shape = len(segments), segments.points[:, 1:].shape
    centre, half_sizes = (np.broadcast_to(each, shape) for each in (boxes.centre, boxes.half_sizes))
    ratio = np.empty(count)
    for part in parts(count):
        seen = watched(recordings, segments.of(part))
        times = seen.step * np.arange(1, seen.points.shape[1])
        place, size, early = between(shape[1], segments.step, tuple(times.tolist()))
        room = size @ half_sizes[part] + early[:, None] * (boxes.early * half_sizes[part, :1])
        farthest = (beyond_box(seen, place @ centre[part]) / room).max(1)
        ratio[part] = (farthest[:, None] / boxes.arms).max(2).min(1)
    score = 1 / (1 + np.maximum(ratio, 0))
    outside = np.where(score < LEAST, 2 * TUBE, 0.0)
    nobody, area = np.zeros(count, dtype=np.int64), np.broadcast_to(boxes.areas.mean(1), count)
    return ScoredSamples(score[:, None], nobody, outside, segments.vehicle, None, segments.group, area)


def constant_velocity(training: Segments, early: Float[np.ndarray, " 2"] | None = None) -> Boxes:
    """The trivial predictor: around constant velocity, by the quantiles of the training deviations at every point.

    The boxes of one moment, which are those of all.
    """
    common = np.quantile(np.abs(training.points[:, 1:]), _COMMON, axis=0, keepdims=True)
    early = np.zeros(2) if early is None else early
    return Boxes(np.zeros(common.shape), np.maximum(common, _NARROWEST), early=early)


def early_share(training: Segments, recordings: Sequence[Recording]) -> Float[np.ndarray, " 2"]:
    """Share of the first half sizes that the boxes of now have, measured: so much is not known of a position.

    It is how far bodies reach along and across the road when they are first watched, as share of how far they do at the
    first point, or zero if they are not watched before.
    """
    chosen = training.of(np.linspace(0, len(training) - 1, min(len(training), PART)).astype(int))
    seen = watched(recordings, chosen)
    if seen.step == training.step:
        return np.zeros(2)
    first = round(training.step / seen.step) - 1
    reach = np.quantile(beyond_box(seen, np.zeros((1, 1, 2)))[:, [0, first]], _COMMON, axis=0)
    return np.minimum(reach[0] / np.maximum(reach[1], _CLOSEST), 1)
