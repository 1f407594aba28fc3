"""Learn then test: the reference that every other method is compared with (Angelopoulos et al. 2021).

Rules are tested one after the other, in an order fixed beforehand, from the one with the largest sets. A rule that
misses k of N₂ units rejects "its miss probability exceeds ε" if Φ(ε, k, N₂) ≤ 1 − confidence, which is the one-sided
Clopper–Pearson test. Testing stops at the first rule that does not reject; the rule before it is returned. Because of
the fixed sequence, the probability of returning a rule that misses more often than ε is at most 1 − confidence,
whatever the rules are: unlike in `family`, they need not be nested.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Int

from coverdrive.certificates.bounds import binomial_tail, check_confidence, rate_limit
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Certificate, Counted
from coverdrive.certificates.family import Family
from coverdrive.certificates.rule import Thresholds
from coverdrive.certificates.units import calibration_units, check_epsilon
from coverdrive.errors import CertificateError


def learn_then_test(
    samples: ScoredSamples,
    tube: float,
    trained_on: Int[np.ndarray, " V"],
    rules: Sequence[Thresholds],
    epsilon: float,
    confidence: float = 0.99,
    unit: Counted = "window",
    seed: int = 0,
) -> tuple[Thresholds, Certificate]:
    """The last of a sequence of rules that is proved to miss at most a share ε of new units.

    Args:
        samples: the calibration split Ω₂.
        tube: radius ρ around every base within which a path is covered, fixed beforehand.
        trained_on: keys of the vehicles that trained the network or shaped the rules.
        rules: in the order of testing, from the largest sets to the smallest, fixed beforehand.
        epsilon: allowed probability of a miss, in (0, 1).
        confidence: of the bound, in (0, 1).
        unit: what the bound counts.
        seed: of the draw of one window of every vehicle, where these are the unit.

    Raises:
        CertificateError: calibration samples trained the network, or not even the first rule passes its test.
    """
    check_epsilon(epsilon)
    check_confidence(confidence)
    units = calibration_units(samples, tube, trained_on, unit, seed)
    passed: Thresholds | None = None
    misses = 0
    for rule in rules:
        misses = int(units.missed(rule).sum())
        if binomial_tail(epsilon, misses, len(units)) > 1 - confidence:
            break
        passed = rule
    if passed is None:
        raise CertificateError(
            f"{misses} misses of the first rule in {len(units)} calibration {unit}s cannot prove ε = {epsilon:g}; the "
            f"smallest ε possible with them is {rate_limit(confidence, misses, len(units)):.3g}, so allow that much or "
            "calibrate on more data"
        )
    return passed, units.certificate(
        "risk control",
        passed,
        epsilon,
        confidence,
        unseen_bases=int((passed.values == 0).sum()),
        tubes="cover" if (passed.tube == tube).all() else "per base",
    )


def rules_of(family: Family, tube: float) -> list[Thresholds]:
    """The rules of a family, in order, without those that repeat the one before."""
    parameters = family.values if family.radii is None else np.c_[family.values, family.radii]
    changes = np.r_[True, (np.diff(parameters, axis=0) != 0).any(1)]
    return [family.rule(int(number), tube) for number in np.flatnonzero(changes)]
