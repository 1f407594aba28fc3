"""What so many calibration units can prove at all, whatever their scores turn out to be."""

from decimal import ROUND_CEILING, Decimal
from typing import Literal

import numpy as np

from coverdrive.certificates.bounds import discarding_bound, judged_bound, rate_limit
from coverdrive.certificates.calibration import Claim, check_epsilon
from coverdrive.certificates.certificate import NOUNS, Unit
from coverdrive.certificates.mean_loss import loss_limit, units_needed
from coverdrive.certificates.methods import Method
from coverdrive.errors import CertificateError
from coverdrive.numbers import percent

USUAL = 0.1
"""the bound ε that is asked for where nobody says another"""


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
    if unit in NOUNS:
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
    outside = f", of which {uncovered} leave the tube of every base," if uncovered and unit not in NOUNS else ""
    units = f"{count} calibration {NOUNS.get(unit, unit)}{'s' * (count != 1)}{outside}"
    by = f" by {method}" + ("" if method.marginal else f" with {percent(claim.sure, 4)} confidence")
    more = "give more recordings, or a larger share of them to calibration, or ask for less confidence"
    if method.computes_epsilon and least < 1:
        return None
    if auto := asked == "auto":
        by_number = smallest_epsilon(method, claim, bases, count, unit=unit)
        asked = USUAL if by_number <= USUAL else rounded_up(by_number)
    if method.computes_epsilon or (auto and asked >= 1):
        raise CertificateError(f"{units} prove nothing{by}; {more}")
    check_epsilon(asked)
    if asked >= least:
        return asked
    possible = rounded_up(least)
    advice = f"`--epsilon {possible:g}`" + ("" if uncovered else " or `--epsilon auto`")
    if unit == "group":
        more = f"{units_needed(asked, None if method.marginal else claim.sure)} groups would do: {more}"
    instead = (
        f"the smallest ε possible with them is {possible:g}: ask for it with {advice}, or " if possible < 1 else ""
    )
    raise CertificateError(f"{units} cannot prove ε = {asked:g}{by}; {instead}{more}")


def rounded_up(value: float) -> float:
    """The least number of two digits that is not below a positive one."""
    exact = Decimal(value)
    return float(exact.quantize(Decimal(1).scaleb(exact.adjusted() - 1), ROUND_CEILING))
