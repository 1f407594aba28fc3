"""Learn then test: the reference that every other method is compared with (Angelopoulos et al. 2021).

Rules are tested one after the other, in an order fixed beforehand, from the one with the largest sets. A rule that
misses k of N₂ units rejects "its miss probability exceeds ε" if Φ(ε, k, N₂) ≤ 1 − confidence; of a mean loss, if the
losses prove ε (`coverdrive.certificates.mean_loss`). The last rule before the
first that does not reject is returned. Because of the fixed sequence, the probability of returning one that misses more
often than ε is at most 1 − confidence, whatever the rules are: unlike in `nested_sets`, they need not be nested.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import takewhile

import numpy as np

from coverdrive.certificates.bounds import binomial_tail, rate_limit
from coverdrive.certificates.calibration import Calibration, Claim
from coverdrive.certificates.certificate import NOUNS, Certificate
from coverdrive.certificates.mean_loss import proves
from coverdrive.certificates.nested_sets import NestedSets, nested_sets_of
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError


def learn_then_test(
    calibration: Calibration, claim: Claim, rules: Sequence[Thresholds] | None = None
) -> tuple[Thresholds, Certificate]:
    """The last of a sequence of rules that is proved to miss at most a share ε of new units.

    The rules are in the order of testing, fixed beforehand; else the nested ones that the training samples shape. If
    not even the first passes its test, this is a `CertificateError`.
    """
    epsilon, count = claim.bound, len(calibration)
    rules = rules_of(nested_sets_of(calibration, claim), calibration.tube) if rules is None else rules

    def passes(rule: Thresholds) -> bool:
        if calibration.kind in NOUNS:
            return proves(calibration.losses(rule), epsilon, claim.sure)
        return binomial_tail(epsilon, int(calibration.missed(rule).sum()), count) <= 1 - claim.sure

    number = fixed_sequence(map(passes, rules))
    if number == 0:
        misses = sum(int(calibration.missed(rule).sum()) for rule in rules[:1])
        raise CertificateError(
            f"{misses} misses of the first rule in {count} calibration {calibration.noun}s cannot prove ε = "
            f"{epsilon:g}; the smallest ε possible with them is {rate_limit(claim.sure, misses, count):.3g}, so allow "
            "that much or calibrate on more data"
        )
    passed = rules[number - 1]
    tubes = "cover" if (passed.tube == calibration.tube).all() else "per base"
    unseen = int((passed.values == 0).sum())
    claim = replace(claim, tubes=tubes)
    return passed, calibration.certificate("learn-then-test", epsilon, claim, passed, unseen_bases=unseen)


def fixed_sequence(proved: Iterable[bool]) -> int:
    """How many hypotheses are proved before the first that is not, in an order fixed beforehand.

    No later one is looked at, so that each may be tested at the full level.
    """
    return sum(1 for _ in takewhile(bool, proved))


def rules_of(nested: NestedSets, tube: float) -> list[Thresholds]:
    """Nested rules, in order, without those that repeat the one before."""
    parameters = nested.values if nested.radii is None else np.c_[nested.values, nested.radii]
    changes = np.r_[True, (np.diff(parameters, axis=0) != 0).any(1)]
    return [nested.rule(int(number), tube) for number in np.flatnonzero(changes)]
