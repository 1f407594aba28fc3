"""All methods on the same scores: what each proves, what happens on unseen samples, and how large its sets are."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from coverdrive.certificates.calibration import Calibration, Claim, ScoredSamples
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.evaluation import Evaluation, Rate, evaluate
from coverdrive.certificates.methods import Method, certify
from coverdrive.certificates.rule import Rule
from coverdrive.errors import CertificateError, MissingExtraError
from coverdrive.progress import done


@dataclass(frozen=True)
class Compared:
    """One method at one target."""

    method: Method
    target: float | None
    """bound ε that was asked for; none for methods that compute it"""
    certificate: Certificate | None
    """none if the method refused"""
    evaluation: Evaluation | None
    """on samples that neither trained nor calibrated"""
    refusal: str
    """why the method refused; empty if it did not"""
    seconds: float
    """[s] wall time of the calibration"""

    @property
    def missed(self) -> Rate | None:
        """Observed misses, counted as the certificate counts."""
        if self.certificate is None or self.evaluation is None:
            return None
        return self.evaluation.missed(self.certificate.unit)


TestOf = Callable[[Method, Claim, Rule], ScoredSamples]
"""Samples to test what a method calibrated for a claim, or a `CertificateError`"""


def compare(
    calibration: Calibration, claim: Claim, test: ScoredSamples | TestOf, targets: Sequence[float]
) -> list[Compared]:
    """Calibrate by every method for every ε of ``targets``, and test on samples that neither trained nor calibrated.

    These may be others for each method. The ε of the claim is ignored; a target that is not in (0, 1) is a
    `CertificateError`.
    """
    asked = {None: replace(claim, epsilon=None)} | {target: replace(claim, epsilon=target) for target in targets}
    runs = [(method, each) for method in Method for each in ([None] if method.computes_epsilon else targets)]
    compared: list[Compared] = []
    for method, target in runs:
        rule, certificate, found, refusal, begin = None, None, None, "", time.perf_counter()
        try:
            rule, certificate = certify(method, calibration, asked[target])
        except (CertificateError, MissingExtraError) as error:
            refusal = str(error)
        seconds = time.perf_counter() - begin
        if rule is not None:
            try:
                found = evaluate(rule, test if isinstance(test, ScoredSamples) else test(method, asked[target], rule))
            except CertificateError as error:
                certificate, refusal = None, str(error)
        compared.append(Compared(method, target, certificate, found, refusal, seconds))
        done(len(compared), len(runs))
    return compared
