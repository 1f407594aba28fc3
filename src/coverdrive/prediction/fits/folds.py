"""How much a fit depends on which scenes train, calibrate and test: the same fit with all roles rotated.

Scene groups differ, and few calibrate: another seed of the training shows nothing of it. The groups are dealt into
K parts of about equal size, and every ordered pair of parts once calibrates and tests while the others train.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coverdrive.arguments import all_of
from coverdrive.certificates.certificate import Certificate, Unit
from coverdrive.certificates.evaluation import Evaluation
from coverdrive.errors import CertificateError
from coverdrive.prediction.certifying.calibrate import Epsilon
from coverdrive.prediction.data.segments import cut_segments
from coverdrive.prediction.data.split import rotations
from coverdrive.prediction.fit import PredictionSettings, fit
from coverdrive.recordings.read import together
from coverdrive.recordings.recording import Recording


@dataclass(frozen=True)
class Fold:
    """What one assignment of scene groups to sides gave."""

    calibration: tuple[int, ...]
    """scene groups that calibrated"""
    test: tuple[int, ...]
    """scene groups that were tested on"""
    certificate: Certificate | None
    """none if the claim could not be proved"""
    evaluation: Evaluation | None
    refusal: str
    """why it could not; empty if it could"""


def fit_folds(
    recordings: Sequence[Recording],
    settings: PredictionSettings | None = None,
    seed: int = 0,
    folds: int = 4,
    *,
    epsilon: Epsilon | None = None,
    confidence: float | None = None,
    unit: Unit | None = None,
) -> list[Fold]:
    """Fit and test with every ordered pair of K = ``folds`` parts as calibration and test side; K (K − 1) fits.

    The rest is as in `fit`; a claim that cannot be proved is a fold without a certificate.
    """
    recordings = together(all_of("recordings", recordings, Recording, "what `coverdrive.read` gives"))
    settings = settings or PredictionSettings()
    segments = cut_segments(recordings, settings.segments)
    sides = rotations(segments.vehicle, segments.group, folds, seed)
    found: list[Fold] = []
    for each in sides:
        calibration, test = (tuple(np.unique(segments.group[side]).tolist()) for side in (each.calibration, each.test))
        try:
            result = fit(recordings, settings, seed, epsilon=epsilon, confidence=confidence, unit=unit, sides=each)
            found.append(Fold(calibration, test, result.certificates[0], result.evaluation, ""))
        except CertificateError as error:
            found.append(Fold(calibration, test, None, None, str(error)))
    return found
