"""How much of the road predicted sets take: the area that the centre of a vehicle may be in, bodies taken off.

Beside every predictor stands a trivial one with the same claim: constant velocity in one conformal box, whose size is
calibrated on the same units. P points after the start.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.evaluation import Evaluation, evaluate
from coverdrive.certificates.methods import Method
from coverdrive.certificates.rule import Rule, scale_of
from coverdrive.errors import CertificateError
from coverdrive.prediction.boxes.boxes import TUBE, constant_velocity, early_share, scored_by
from coverdrive.prediction.certifying.calibrate import CertificateSettings, calibrate, held_back
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.data.segments import Segments
from coverdrive.prediction.data.split import Split
from coverdrive.recordings.recording import Recording


@dataclass(frozen=True)
class Occupied:
    """Mean areas over the windows of the test split."""

    seconds: tuple[float, ...]
    """[s] after the start"""
    areas: tuple[float, ...]
    """[m²] of the predicted sets then"""
    baseline: tuple[float, ...] = ()
    """[m²] of constant velocity in one conformal box; none if that cannot be proved"""
    baseline_evaluation: Evaluation | None = None
    """of the same"""

    @property
    def mean(self) -> float:
        """[m²] over all times."""
        return float(np.mean(self.areas))

    @property
    def ratio(self) -> float | None:
        """To the trivial predictor's."""
        return self.mean / float(np.mean(self.baseline)) if self.baseline else None


def compared(
    areas: Float[np.ndarray, " P"],
    recordings: Sequence[Recording],
    segments: Segments,
    sides: Split,
    settings: CertificateSettings,
    certificate: Certificate,
    seed: int,
) -> Occupied:
    """Areas, and those of the trivial predictor, for the bound of a certificate by the same method."""
    seconds = tuple((segments.step * np.arange(1, len(areas) + 1)).tolist())
    found = Occupied(seconds, tuple(areas.tolist()))
    with suppress(CertificateError):  # then there is nothing to compare with
        half_sizes, _, evaluation = trivial_box(recordings, segments, sides, settings, certificate, seed)
        baseline = tuple((4 * half_sizes[1:].prod(-1)).tolist())
        found = replace(found, baseline=baseline, baseline_evaluation=evaluation)
    return found


def trivial_box(
    recordings: Sequence[Recording],
    segments: Segments,
    sides: Split,
    settings: CertificateSettings,
    certificate: Certificate,
    seed: int,
) -> tuple[Float[np.ndarray, "Q 2"], Certificate, Evaluation]:
    """Half sizes [m] of the trivial predictor's box beyond the body, for the bound of a certificate by the same method.

    They are those of now and of the points after it, Q = P + 1. With what is proved of it; the evaluation is on the
    test split. A CertificateError if the bound cannot be proved.
    """
    method = Method.PAC_POOLED if settings.method.computes_epsilon else settings.method
    claim = settings.model_copy(update={"method": method, "epsilon": certificate.epsilon})
    learned_from = segments.of(sides.train)
    boxes = constant_velocity(learned_from, early_share(learned_from, recordings))
    training, calibration, test = (
        scored_by(boxes, segments.of(side), recordings) for side in (sides.train, sides.calibration, sides.test)
    )
    rule, (proved, *_) = calibrate(TUBE, training, calibration, claim, seed)
    if sides.crossed:
        test = held_back(rule, TUBE, training, calibration, claim, seed)
    half_sizes = np.vstack([boxes.early * boxes.half_sizes[0, 0], boxes.half_sizes[0]])
    return half_sizes * scale_of(rule), proved, evaluate(rule, test)


def areas_of_bases(basis: Basis, rule: Rule, samples: ScoredSamples) -> Float[np.ndarray, " P"]:
    """[m²] of the union of the tubes of all possible bases, on average over samples."""
    possible = rule.possible(samples.scores, samples.hidden)
    sets, count = np.unique(possible | ~possible.any(1, keepdims=True), axis=0, return_counts=True)
    half_sizes = rule.tube[:, None, None] * basis.tube(basis.times)
    areas = [
        [union_area(basis.points[bases, k], half_sizes[bases, k]) for k in range(1, len(basis.times))] for bases in sets
    ]
    return np.average(areas, axis=0, weights=count)


def union_area(centre: Float[np.ndarray, "S 2"], half_sizes: Float[np.ndarray, "S 2"]) -> float:
    """Area of the union of upright boxes, cell by cell between all their edges."""
    low, high = centre - half_sizes, centre + half_sizes
    edges = [np.unique([low[:, axis], high[:, axis]]) for axis in (0, 1)]
    within = [(low[:, axis, None] <= edge[:-1]) & (edge[1:] <= high[:, axis, None]) for axis, edge in enumerate(edges)]
    taken = np.einsum("sx,sy->xy", *within) > 0
    return float(np.diff(edges[0]) @ taken @ np.diff(edges[1]))
