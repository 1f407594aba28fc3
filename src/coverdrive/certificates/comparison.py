"""All methods on the same scores: what each proves, what happens on unseen samples, and how large its sets are."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from coverdrive.certificates.bounds import check_confidence
from coverdrive.certificates.calibration import ScoredSamples, refuse_trained
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.evaluation import Evaluation, Rate, evaluate
from coverdrive.certificates.methods import Method, Task, certify
from coverdrive.certificates.units import check_epsilon, one_window_each
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
        return self.evaluation.vehicles if self.certificate.unit == "vehicle" else self.evaluation.windows


def compare(
    task: Task,
    test: ScoredSamples,
    targets: Sequence[float],
) -> list[Compared]:
    """Calibrate by every method for every target, and test on unseen samples.

    Args:
        task: calibration samples and what is claimed about them; its own ε is ignored.
        test: samples that neither trained nor calibrated.
        targets: bounds ε to ask for.

    Raises:
        CertificateError: calibration samples trained the network, so that no method can do anything, or a target or the
            confidence is not between 0 and 1.
    """
    refuse_trained(task.samples, task.trained_on)
    check_confidence(task.confidence)
    for target in targets:
        check_epsilon(target)
    runs = [(method, target) for method in Method for target in _targets_of(method, targets)]
    compared: list[Compared] = []
    for method, target in runs:
        compared.append(_compared(method, replace(task, epsilon=target), test))
        done(len(compared), len(runs))
    return compared


def _targets_of(method: Method, targets: Sequence[float]) -> Sequence[float | None]:
    return [None] if method.computes_epsilon else targets


def _compared(method: Method, task: Task, test: ScoredSamples) -> Compared:
    begin = time.perf_counter()
    try:
        rule, certificate = certify(method, task)
    except (CertificateError, MissingExtraError) as error:
        return Compared(method, task.epsilon, None, None, str(error), time.perf_counter() - begin)
    seconds = time.perf_counter() - begin
    unseen = one_window_each(test, task.seed) if task.unit == "drawn window" else test
    return Compared(method, task.epsilon, certificate, evaluate(rule, unseen), "", seconds)
