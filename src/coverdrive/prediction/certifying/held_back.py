"""Testing on the vehicles that calibrate, where no others are left: each is judged by what the others calibrate.

The calibration vehicles are dealt into parts. For each part, a rule is calibrated on all others, by the same method and
for the same claim, or where they are too few for that, for what so many can prove, and says what it misses in that
part. The network has seen none of them. This is what the procedure misses with a tenth fewer vehicles; the rule that
all of them calibrate, which is the one that is kept, is not tested.
"""

from dataclasses import replace

import numpy as np

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.rule import LEAST, Rule, scale_of
from coverdrive.errors import CertificateError
from coverdrive.prediction.certifying.calibrate import CertificateSettings, calibrate

PARTS = 10
"""into which the vehicles are dealt"""


def held_back(
    rule: Rule, tube: float, training: ScoredSamples, samples: ScoredSamples, settings: CertificateSettings, seed: int
) -> ScoredSamples:
    """The samples that calibrated a rule, moved so that it misses of each vehicle what the rule of the others misses.

    Sets keep the size that the rule gives them. Of samples of boxes, the distances 1 / score − 1 are moved by the ratio
    of the two sizes, of others, scores by the difference of the two thresholds.

    Raises:
        CertificateError: nine tenths of the vehicles can prove nothing, or the rule has no thresholds.
    """
    if "thresholds" not in rule.arrays:
        raise CertificateError(
            "with two groups of scenes that share no vehicle, what calibrates also tests, which hyperplanes do not "
            "allow; give scenes of another time or place as well, or take another method"
        )
    _, vehicle = np.unique(samples.vehicle, return_inverse=True)
    part = np.random.default_rng(seed).permutation(vehicle.max() + 1)[vehicle] % PARTS
    scores = samples.scores.astype(float)
    for number in np.unique(part):
        inside, others = part == number, np.flatnonzero(part != number)
        found = _calibrated(tube, training, samples.of(others), settings, seed)
        if samples.area is None:
            scores[inside] += rule.arrays["thresholds"] - found.arrays["thresholds"]
        else:
            farther = 1 / np.maximum(scores[inside], LEAST) - 1
            scores[inside] = 1 / (1 + farther * scale_of(rule) / max(scale_of(found), LEAST))
    return replace(samples, scores=scores.clip(0, 1))


def _calibrated(
    tube: float, training: ScoredSamples, samples: ScoredSamples, settings: CertificateSettings, seed: int
) -> Rule:
    """The rule that samples calibrate, for the claim, or for the smallest that they prove by their number."""
    try:
        return calibrate(lambda rule, *_: rule, tube, training, samples, settings, seed)[0]
    except CertificateError:
        easier = settings.model_copy(update={"epsilon": "auto"})
        return calibrate(lambda rule, *_: rule, tube, training, samples, easier, seed)[0]
