"""Post-bloating: thresholds so low that no covered calibration sample is missed (paper §3.2).

c_j is the smallest score of base j among the calibration samples that drove it and stayed within its tube. This is a
convex program with M decision variables in which every calibration sample bounds at most one threshold (a vehicle:
several), so that at most M samples support the solution.

A new sample is missed if no base covers it, or if it is covered and the rule misses it. The first is bounded by the
one-sided Clopper–Pearson limit of the uncovered calibration units, the second by a scenario bound for the covered ones;
each takes half of the allowed error probability, and ε is their sum.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from coverdrive.certificates.bounds import rate_limit, violation_bound
from coverdrive.certificates.calibration import Calibration, Claim
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError


def post_bloat(calibration: Calibration, claim: Claim) -> tuple[Thresholds, Certificate]:
    """Thresholds that miss no covered calibration sample, and the bound on missing a new one, window or vehicle."""
    certificate = scenario_certificate(
        calibration,
        claim,
        method="post-bloating",
        bound=partial(violation_bound, support=calibration.bases, samples=len(calibration)),
        paper_epsilon=rate_limit(claim.sure, calibration.bases + 1, len(calibration)),
    )
    return Thresholds.at(calibration.lowest, calibration.tube), certificate


def scenario_certificate(
    calibration: Calibration,
    claim: Claim,
    method: str,
    bound: Callable[[float], float],
    paper_epsilon: float | None,
    support: int | None = None,
) -> Certificate:
    """The certificate of a rule that misses no covered window.

    ``bound`` is that on missing a covered unit, by its confidence, ``paper_epsilon`` the same by the paper's dimension,
    and ``support`` the number of units that support the rule, if it was counted.
    """
    shared = (1 + claim.sure) / 2
    epsilon = rate_limit(shared, calibration.uncovered, len(calibration)) + bound(shared)
    if epsilon >= 1:
        supporting = "" if support is None else f" and {support} support the hyperplanes"
        raise CertificateError(
            f"of {len(calibration)} calibration {calibration.kind}s, {calibration.uncovered} leave the tube of every "
            f"base{supporting}, so that nothing is proved; calibrate on more data, or use fewer base trajectories"
            + ("" if support is None else ", fewer hidden neurons, or post-bloating")
        )
    return calibration.certificate(
        method,
        epsilon,
        claim,
        unseen_bases=int(np.isinf(calibration.lowest).sum()),
        prediction_epsilon=bound(claim.sure),
        paper_epsilon=paper_epsilon,
        support=support,
    )
