"""The certificate that post-bloating and support vectors share: misses of the cover, and of what is covered.

A new sample is missed if no base covers it, or if it is covered and the rule misses it. The first is bounded by the
one-sided Clopper–Pearson limit of the uncovered calibration units, the second by a scenario bound for the covered ones;
each takes half of the allowed error probability, and ε is their sum.
"""

from collections.abc import Callable

import numpy as np

from coverdrive.certificates.bounds import rate_limit
from coverdrive.certificates.calibration import Calibration, Claim
from coverdrive.certificates.certificate import Certificate
from coverdrive.errors import CertificateError


def scenario_certificate(
    calibration: Calibration,
    claim: Claim,
    method: str,
    bound: Callable[[float], float],
    paper_epsilon: float | None,
    support: int | None = None,
) -> Certificate:
    """The certificate of a rule that misses no covered window.

    Args:
        calibration: the windows.
        claim: of the bound.
        method: its name.
        bound: on the probability that a new unit is covered and missed, by its confidence.
        paper_epsilon: the same by the paper's dimension, at the confidence of the claim.
        support: number of units that support the rule, if it was counted.

    Raises:
        CertificateError: nothing is proved.
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
