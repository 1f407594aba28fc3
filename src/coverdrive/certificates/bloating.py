"""Post-bloating: thresholds so low that no covered calibration sample is missed (paper §3.2).

c_j is the smallest score of base j among the calibration samples that drove it and stayed within its tube. This is a
convex program with M decision variables in which every calibration sample bounds at most one threshold (a vehicle:
several), so that at most M samples support the solution. With a tube for each base, ρ_j is the largest distance of the
same samples: 2M decision variables, and at most 2M samples that support them. How misses of the cover are added is
said in `scenario`.
"""

from functools import partial

from coverdrive.certificates.bounds import rate_limit, violation_bound
from coverdrive.certificates.calibration import Calibration, Claim
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.rule import Thresholds
from coverdrive.certificates.scenario import scenario_certificate


def post_bloat(calibration: Calibration, claim: Claim) -> tuple[Thresholds, Certificate]:
    """Thresholds that miss no covered calibration sample, and the bound on missing a new one.

    The rule is the same for windows and for vehicles.

    Raises:
        CertificateError: there are too few samples for any bound.
    """
    variables = calibration.bases * (2 if claim.tubes == "per base" else 1)
    certificate = scenario_certificate(
        calibration,
        claim,
        method="post-bloating",
        bound=partial(violation_bound, support=variables, samples=len(calibration)),
        paper_epsilon=rate_limit(claim.sure, variables + 1, len(calibration)),
    )
    return Thresholds.at(calibration.lowest, calibration.radii(claim.tubes)), certificate
