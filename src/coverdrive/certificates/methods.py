"""Every method of calibration by its name: what each claims, and what so many units can prove by it at all."""

from collections.abc import Callable
from dataclasses import replace
from decimal import ROUND_CEILING, Decimal
from enum import StrEnum
from functools import partial
from typing import Literal

import numpy as np

from coverdrive.certificates.bloating import post_bloat
from coverdrive.certificates.bounds import discarding_bound, judged_bound, rate_limit
from coverdrive.certificates.calibration import Calibration, Claim
from coverdrive.certificates.certificate import NOUNS, Certificate, Unit, of_mean
from coverdrive.certificates.conformal import conformal
from coverdrive.certificates.discarding import discard
from coverdrive.certificates.mean_loss import loss_limit, units_needed
from coverdrive.certificates.nested_sets import nested_sets
from coverdrive.certificates.rule import Rule
from coverdrive.certificates.support_vectors import support_vectors
from coverdrive.errors import CertificateError
from coverdrive.percentages import counted, percent

USUAL = 0.1
"""the bound ε that is asked for where nobody says another"""


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
    if of_mean(calibration.kind) and not Method(method).bounds_losses:
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


def smallest_epsilon(
    method: Method, claim: Claim, bases: int, count: int, uncovered: int = 0, unit: Unit = "window"
) -> float:
    """A bound below which the method can prove nothing; 1 if it can prove nothing at all.

    Of methods that calibrate every base by itself, it is the one that all ``count`` units would prove if they drove one
    base. ``uncovered`` of them leave the tube of every base, so that every rule misses them; of a mean loss they are
    not looked at. The ε of the claim is not used.
    """
    shared = (1 + claim.sure) / 2
    if method == Method.POST_BLOATING:
        return min(1.0, rate_limit(shared, uncovered, count) + _support_limit(shared, bases, 0, count))
    if method == Method.SVM:
        return min(1.0, rate_limit(shared, uncovered, count) + judged_bound(shared, 0, count))
    if method == Method.DISCARDING:
        return _support_limit(claim.sure, bases, uncovered, count)
    if of_mean(unit):
        return loss_limit(np.zeros(count), None if method.marginal else claim.sure)
    if method in (Method.PER_BASE, Method.PAC_PER_BASE):
        uncovered = 0  # they may all have driven another base
    if method.marginal:
        return min(1.0, (uncovered + 1) / (count + 1))
    groups = bases if method == Method.PAC_PER_BASE else 1
    return rate_limit(1 - (1 - claim.sure) / groups, uncovered, count)


def _support_limit(confidence: float, support: int, discarded: int, count: int) -> float:
    return 1.0 if support + discarded > count else discarding_bound(confidence, support, discarded, count)


def provable_epsilon(
    asked: float | Literal["auto"],
    method: Method,
    claim: Claim,
    bases: int,
    count: int,
    uncovered: int = 0,
    unit: Unit = "window",
) -> float | None:
    """The bound ε to claim, `CertificateError` if it cannot be proved; None for methods that compute it.

    "auto" is `USUAL` or, where the number of units cannot prove that, the smallest bound that it can, rounded up to two
    digits. It looks at nothing but the number of units: the bound has to be fixed before their scores are seen. The
    rest is as in `smallest_epsilon`.
    """
    least = smallest_epsilon(method, claim, bases, count, uncovered, unit)
    outside = f", of which {uncovered} leave the tube of every base," if uncovered and not of_mean(unit) else ""
    units = counted(count, f"calibration {NOUNS.get(unit, unit)}") + outside
    by = f" by {method}" + ("" if method.marginal else f" with {percent(claim.sure, 10)} confidence")
    more = "give more recordings, or a larger share of them to calibration, or ask for less confidence"
    if method.computes_epsilon and least < 1:
        return None
    if auto := asked == "auto":
        by_number = smallest_epsilon(method, claim, bases, count, unit=unit)
        asked = USUAL if by_number <= USUAL else to_two_digits(by_number)
    if method.computes_epsilon or (auto and asked >= 1):
        raise CertificateError(f"{units} prove nothing{by}; {more}")
    if asked >= least:
        return asked
    possible = to_two_digits(least)
    advice = f"ask for it with `--epsilon {possible:g}`" + ("" if uncovered else " or `--epsilon auto`")
    if outside:
        advice = "who has seen that can ask for it of other vehicles only"
    if unit == "group":
        more = f"{units_needed(asked, None if method.marginal else claim.sure)} groups would do: {more}"
    instead = f"the smallest ε possible with them is {possible:g}: {advice}, or " if possible < 1 else ""
    raise CertificateError(f"{units} cannot prove ε = {asked:g}{by}; {instead}{more}")


def to_two_digits(value: float, rounding: str = ROUND_CEILING) -> float:
    """The least number of two digits that is not below a positive one, or as another ``rounding`` of decimals says."""
    exact = Decimal(value)
    return float(exact.quantize(Decimal(1).scaleb(exact.adjusted() - 1), rounding))
