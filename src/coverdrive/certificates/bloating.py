"""Post-bloating: thresholds so low that no covered calibration sample is missed (paper §3.2).

c_j is the smallest score of base j among the calibration samples that drove it and stayed within its tube. This is a
convex program with M decision variables in which every calibration sample bounds at most one threshold (a vehicle:
several), so that at most M samples support the solution. With a tube for each base, ρ_j is the largest distance of the
same samples: 2M decision variables, and at most 2M samples that support them. How misses of the cover are added is
said in `covered`.
"""

from functools import partial

import numpy as np
from jaxtyping import Int

from coverdrive.certificates.bounds import rate_limit, violation_bound
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Certificate, Counted, Tubes
from coverdrive.certificates.covered import CoveredSamples
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError


def post_bloat(
    samples: ScoredSamples,
    tube: float,
    trained_on: Int[np.ndarray, " V"],
    confidence: float = 0.99,
    unit: Counted = "window",
    seed: int = 0,
    tubes: Tubes = "cover",
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
        tubes: whether the tube of every base shrinks to what its covered calibration samples need.

    Raises:
        CertificateError: calibration samples trained the network, or there are too few of them.
    """
    covered = CoveredSamples.of(samples, tube, trained_on, unit, seed)
    variables = covered.bases * (2 if tubes == "per base" else 1)
    certificate = covered.certificate(
        method="post-bloating",
        tubes=tubes,
        confidence=confidence,
        bound=partial(violation_bound, support=variables, samples=covered.count),
        paper_epsilon=rate_limit(confidence, variables + 1, covered.count),
    )
    if certificate.epsilon >= 1:
        raise CertificateError(
            f"{covered.count} calibration {unit}s, of which {certificate.uncovered} leave the tube of every base, "
            "prove nothing; calibrate on more data, or use fewer base trajectories (a wider cover)"
        )
    return Thresholds.at(covered.lowest, covered.radii(tubes)), certificate
