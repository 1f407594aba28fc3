"""A one-parameter family of thresholds: its shape is fixed on training data, one number is calibrated.

The rules of the family are nested: rule l = 0 calls every base possible, and every next rule has thresholds that are
at least as high. A calibration unit that is missed by a rule is missed by all later ones. The last rule that misses at
most r of N₂ units has a miss probability V with P{V > ε} ≤ Φ(ε, r, N₂): the order statistic of one number has that law,
and no binomial factor is needed, because there is one way to discard the r lowest. For M bases this is a far smaller
bound than post-bloating's, paid in larger sets where the shape is wrong. Units that leave the tube are missed by every
rule.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from coverdrive.certificates.bounds import misses_allowed, rate_limit
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Certificate, Counted
from coverdrive.certificates.rule import Thresholds
from coverdrive.certificates.units import Units, calibration_units, number_discarded
from coverdrive.errors import CertificateError


@dataclass(frozen=True)
class Family:
    """Nested rules, checked when made."""

    values: Float[np.ndarray, "L M"]
    """thresholds of every rule, from 0 upwards, not falling from one rule to the next"""

    def __post_init__(self) -> None:
        """Refuse a family in which a missed sample might not stay missed."""
        if len(self.values) == 0 or (self.values[0] != 0).any() or not (np.diff(self.values, axis=0) >= 0).all():
            raise CertificateError("a family of thresholds must start with zeros and must not fall from rule to rule")

    def last_passed(self, units: Units) -> Int[np.ndarray, " N"]:
        """For every unit the last rule that does not miss it; −1 if all do."""
        rules = np.empty(len(units.score))
        for base in range(units.bases):
            asks = units.base == base
            rules[asks] = np.searchsorted(self.values[:, base], units.score[asks], side="right") - 1
        return units.level(rules).astype(np.int64)


def quantile_family(training: ScoredSamples, rules: int = 400) -> Family:
    """Thresholds at equal quantiles of every base's training scores, after proportional ones up to the lowest score.

    A base without training samples is always possible.

    Args:
        training: scores of the training split Ω₁.
        rules: number L ≥ 2 of rules; half of them up to the lowest score of every base, half above, where the
            quantiles are spaced geometrically.
    """
    bases = training.scores.shape[1]
    half = rules // 2
    values = np.zeros((2 * half, bases))
    levels = np.geomspace(1 / len(training), 1, half)
    for base in np.unique(training.base):
        scores = training.score_of_base[training.base == base]
        values[:half, base] = np.linspace(0, scores.min(), half, endpoint=False)
        values[half:, base] = np.quantile(scores, levels)
    return Family(np.maximum.accumulate(values, axis=0))


def calibrate_family(
    samples: ScoredSamples,
    tube: float,
    trained_on: Int[np.ndarray, " V"],
    family: Family,
    discarded: int | None = None,
    epsilon: float | None = None,
    confidence: float = 0.99,
    unit: Counted = "window",
    seed: int = 0,
) -> tuple[Thresholds, Certificate]:
    """The last rule of the family that misses at most r calibration units, and the bound on missing a new one.

    Args:
        samples: the calibration split Ω₂.
        tube: radius ρ around every base within which a path is covered, fixed beforehand.
        trained_on: keys of the vehicles that trained the network or shaped the family.
        family: of nested rules, fixed beforehand.
        discarded: number r ≥ 0 of units that may be missed, fixed beforehand. Give this, or ``epsilon``.
        epsilon: the bound; r is the greatest number that stays within it.
        confidence: of the bound, in (0, 1).
        unit: what the bound counts.
        seed: of the draw of one window of every vehicle, where these are the unit.

    Raises:
        CertificateError: calibration samples trained the network, there are too few of them, or more than r of them
            leave the tube.
    """
    units = calibration_units(samples, tube, trained_on, unit, seed)
    count = len(units)
    least = rate_limit(confidence, 0, count)
    allowed = number_discarded(discarded, epsilon, lambda bound: misses_allowed(bound, confidence, count), least, count)
    last = np.sort(family.last_passed(units))
    chosen = int(last[allowed])
    if chosen < 0:
        raise CertificateError(
            f"{int((last < 0).sum())} of {count} calibration {unit}s leave the tube around their base, but only "
            f"{allowed} may be missed; allow more, or widen the tube or refine the basis"
        )
    values = family.values[chosen]
    rule = Thresholds.at(values, tube)
    bound = rate_limit(confidence, allowed, count)
    never = int((family.values[-1] == 0).sum())
    return rule, units.certificate("one-parameter family of thresholds", rule, bound, confidence, unseen_bases=never)
