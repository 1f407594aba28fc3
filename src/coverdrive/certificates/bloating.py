"""Post-bloating: thresholds so low that no covered calibration sample is missed (paper §3.2).

c_j is the smallest score of base j among the calibration samples that drove it and stayed within its tube. This is a
convex program with M decision variables in which every calibration sample bounds at most one threshold (a vehicle:
several), so that at most M samples support the solution. A new sample is missed if no base covers it, or if its
base is not possible. The first is bounded by the one-sided Clopper–Pearson limit of the uncovered calibration
samples, the second by the scenario bound; each takes half of the allowed error probability, and ε is their sum.
"""

import numpy as np
from jaxtyping import Int

from coverdrive.certificates.bounds import rate_limit, violation_bound
from coverdrive.certificates.calibration import ScoredSamples, refuse_trained
from coverdrive.certificates.certificate import Certificate, Counted, fingerprint
from coverdrive.certificates.rule import Thresholds
from coverdrive.certificates.units import one_window_each


def post_bloat(
    samples: ScoredSamples,
    tube: float,
    trained_on: Int[np.ndarray, " V"],
    confidence: float = 0.99,
    unit: Counted = "window",
    seed: int = 0,
) -> tuple[Thresholds, Certificate]:
    """Thresholds that miss no covered calibration sample, and the bound on missing a new one.

    Args:
        samples: the calibration split Ω₂.
        tube: radius ρ around every base within which a path is covered, fixed before the calibration samples are
            seen (the ε of the cover).
        trained_on: keys of the vehicles that trained the network.
        confidence: of the bound, in (0, 1).
        unit: what the bound counts. The rule is the same for windows and for vehicles.
        seed: of the draw of one window of every vehicle, where these are the unit.

    Raises:
        CertificateError: calibration samples trained the network, or there are too few of them.
    """
    refuse_trained(samples, trained_on)
    if unit == "drawn window":
        samples = one_window_each(samples, seed)
    bases = samples.scores.shape[1]
    covered = samples.distance <= tube
    lowest = np.full(bases, np.inf)
    np.minimum.at(lowest, samples.base[covered], samples.score_of_base[covered])
    key = samples.vehicle if unit == "vehicle" else np.arange(len(samples))
    count, uncovered = len(np.unique(key)), len(np.unique(key[~covered]))
    shared_confidence = (1 + confidence) / 2
    certificate = Certificate(
        method="post-bloating",
        epsilon=rate_limit(shared_confidence, uncovered, count) + violation_bound(shared_confidence, bases, count),
        confidence=confidence,
        samples=count,
        unit=unit,
        bases=bases,
        uncovered=uncovered,
        prediction_epsilon=violation_bound(confidence, bases, count),
        paper_epsilon=rate_limit(confidence, bases + 1, count),
        unseen_bases=int(np.isinf(lowest).sum()),
        discarded=0,
        tube=tube,
        fingerprint=fingerprint(samples.scores, samples.base, samples.distance),
    )
    return Thresholds.at(lowest, tube), certificate
