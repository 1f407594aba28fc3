"""Post-bloating: thresholds so low that no calibration sample is missed (paper §3.2).

Decision variables are the threshold c_j of each of the M bases and one radius ρ of the tube around all of them:
c_j is the smallest score of base j among the calibration samples that drove it, ρ the largest distance of a sample
to its base. Both are convex programs, and every calibration sample is one constraint on a single c_j and on ρ, so
that at most M + 1 samples support the solution, whether samples are windows or whole vehicles. A new sample is
missed if its base is not possible or if it leaves the tube; segments that no base covers are in the tube or missed.
"""

import numpy as np
from jaxtyping import Int

from coverdrive.certificates.bounds import violation_bound
from coverdrive.certificates.calibration import ScoredSamples, refuse_trained
from coverdrive.certificates.certificate import Certificate, Unit, fingerprint
from coverdrive.certificates.rule import Thresholds

ROUNDING = 1e-6
"""Thresholds are lowered by this much, so that scores computed in batches of another shape are never missed."""


def post_bloat(
    samples: ScoredSamples,
    trained_on: Int[np.ndarray, " V"],
    confidence: float = 0.99,
    unit: Unit = "window",
) -> tuple[Thresholds, Certificate]:
    """Thresholds and tube that miss no calibration sample, and the bound on missing a new one.

    Args:
        samples: the calibration split Ω₂.
        trained_on: keys of the vehicles that trained the network.
        confidence: of the bound, in (0, 1).
        unit: what the bound counts. The rule is the same for both.

    Raises:
        CertificateError: calibration samples trained the network, or there are too few of them.
    """
    refuse_trained(samples, trained_on)
    bases = samples.scores.shape[1]
    lowest = np.full(bases, np.inf)
    np.minimum.at(lowest, samples.base, samples.score_of_base)
    seen = np.isfinite(lowest)
    values = np.where(seen, np.maximum(lowest - ROUNDING, 0), 0)
    radius = float(samples.distance.max()) * (1 + ROUNDING)
    count = len(samples) if unit == "window" else len(np.unique(samples.vehicle))
    variables = bases + 1
    certificate = Certificate(
        method="post-bloating",
        epsilon=violation_bound(confidence, variables, count),
        confidence=confidence,
        samples=count,
        unit=unit,
        dimension=variables,
        paper_epsilon=violation_bound(confidence, variables + 2, count) if variables + 2 <= count else 1.0,
        bases=bases,
        unseen_bases=int((~seen).sum()),
        discarded=0,
        tube=radius,
        fingerprint=fingerprint(samples.scores, samples.base, samples.distance),
    )
    return Thresholds(values, np.full(bases, radius)), certificate
