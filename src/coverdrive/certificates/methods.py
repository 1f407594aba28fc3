"""Every method of calibration by its name, on the same arrays: what each claims, and what it costs in set size."""

from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from functools import partial

from coverdrive.certificates.bloating import post_bloat
from coverdrive.certificates.calibration import Calibration, Claim
from coverdrive.certificates.certificate import NOUNS, Certificate
from coverdrive.certificates.conformal import conformal
from coverdrive.certificates.discarding import discard
from coverdrive.certificates.nested_sets import nested_sets
from coverdrive.certificates.rule import Rule
from coverdrive.certificates.support_vectors import support_vectors
from coverdrive.errors import CertificateError


class Method(StrEnum):
    """The methods: the name and, in one line, the help of each."""

    help: str

    def __new__(cls, name: str, text: str) -> "Method":
        """Make one member."""
        method = str.__new__(cls, name)
        method._value_, method.help = name, text
        return method

    POST_BLOATING = "post-bloating", "misses no covered calibration sample; computes ε from their number (the paper's)"
    SVM = "svm", "hyperplanes in the last hidden layer that miss no covered calibration sample (the paper's appendix)"
    DISCARDING = "discarding", "post-bloating that may miss as many calibration samples as a given ε allows"
    NESTED_SETS = "nested-sets", "thresholds at one level of quantiles of the training scores, calibrated for a given ε"
    POOLED = "conformal-pooled", "conformal with one threshold for all bases; ε on average over calibrations"
    PER_BASE = "conformal-per-base", "the same, with ε for every base by itself (the paper's appendix)"
    PAC_POOLED = "pac-pooled", "conformal with one threshold for all bases; ε with the given confidence"
    PAC_PER_BASE = "pac-per-base", "the same, with ε for every base by itself, for all of them at once"

    @property
    def computes_epsilon(self) -> bool:
        """Whether ε follows from the calibration samples, instead of being asked for."""
        return self in (Method.POST_BLOATING, Method.SVM)

    @property
    def marginal(self) -> bool:
        """Whether the bound is on average over calibrations, without confidence."""
        return self in (Method.POOLED, Method.PER_BASE)

    @property
    def bounds_losses(self) -> bool:
        """Whether it can bound a share of windows, or of the vehicles of a scene group."""
        return self in (Method.POOLED, Method.PAC_POOLED, Method.NESTED_SETS)


def certify(method: Method | str, calibration: Calibration, claim: Claim) -> tuple[Rule, Certificate]:
    """Calibrate thresholds by the method of a name.

    Raises:
        CertificateError: no such method, what it needs is not given, or what it would claim does not hold.
    """
    try:
        calibrate = _METHODS[Method(method)]
    except ValueError as error:
        raise CertificateError(f"no method is called {method!r}; choose one of {', '.join(Method)}") from error
    if calibration.kind in NOUNS and not Method(method).bounds_losses:
        raise CertificateError(
            f"{method} counts units that are missed or not, and bounds no shares of them; claim vehicles or windows, "
            f"or take one of {', '.join(each for each in Method if each.bounds_losses)}"
        )
    if Method(method).computes_epsilon and claim.epsilon is not None:
        raise CertificateError(f"{method} computes its ε and takes none; leave it out, or use discarding")
    return calibrate(calibration, replace(claim, confidence=None) if Method(method).marginal else claim)


_METHODS: dict[Method, Callable[[Calibration, Claim], tuple[Rule, Certificate]]] = {
    Method.POST_BLOATING: post_bloat,
    Method.SVM: support_vectors,
    Method.DISCARDING: discard,
    Method.NESTED_SETS: nested_sets,
    Method.POOLED: conformal,
    Method.PER_BASE: partial(conformal, per_base=True),
    Method.PAC_POOLED: conformal,
    Method.PAC_PER_BASE: partial(conformal, per_base=True),
}
