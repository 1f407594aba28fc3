"""Nested sets: a line of thresholds, shaped on training data, of which one number is calibrated.

Rule l = 0 calls every base possible, and every next rule has thresholds that are at least as high. A calibration unit
that is missed by a rule is missed by all later ones. The last rule that misses at most r of N₂ units has a miss
probability V with P{V > ε} ≤ Φ(ε, r, N₂): the order statistic of one number has that law, and no binomial factor is
needed, because there is one way to discard the r lowest. For M bases this is a far smaller bound than post-bloating's,
paid in larger sets where the shape is wrong.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from coverdrive.certificates.bounds import misses_allowed, rate_limit
from coverdrive.certificates.calibration import Calibration, Claim, ScoredSamples
from coverdrive.certificates.certificate import Certificate, of_mean
from coverdrive.certificates.discarding import number_discarded
from coverdrive.certificates.mean_loss import last_level
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError


@dataclass(frozen=True)
class NestedSets:
    """Nested rules, checked when made."""

    values: Float[np.ndarray, "L M"]
    """thresholds of every rule, from 0 upwards, not falling from one rule to the next"""

    def __post_init__(self) -> None:
        """Refuse rules of which a missed sample might not stay missed."""
        if len(self.values) == 0 or (self.values[0] != 0).any() or not (np.diff(self.values, axis=0) >= 0).all():
            raise CertificateError("nested thresholds must start with zeros and must not fall from rule to rule")

    def rule(self, number: int, tube: float) -> Thresholds:
        """One of the rules; ``tube`` is the radius ρ of the cover."""
        return Thresholds.at(self.values[number], tube)

    def last_passed(self, calibration: Calibration) -> Int[np.ndarray, " N"]:
        """For every unit the last rule that does not miss it; −1 if all do."""
        _, driven, score, _ = calibration.demands
        rules = np.empty(len(score))
        for base in range(calibration.bases):
            asks = driven == base
            rules[asks] = np.searchsorted(self.values[:, base], score[asks], side="right") - 1
        return calibration.level(rules).astype(np.int64)


def quantile_sets(training: ScoredSamples, rules: int = 400) -> NestedSets:
    """Thresholds at equal quantiles of every base's training scores, after proportional ones up to the lowest score.

    A base without training samples is always possible. Half of the rules are up to the lowest score of every base, half
    above, where the quantiles are spaced geometrically.
    """
    bases = training.scores.shape[1]
    half = rules // 2
    values = np.zeros((2 * half, bases))
    levels = np.geomspace(1 / len(training), 1, half)
    for base in np.unique(training.base):
        scores = training.score_of_base[training.base == base]
        values[:half, base] = np.linspace(0, scores.min(), half, endpoint=False)
        values[half:, base] = np.quantile(scores, levels)
    return NestedSets(np.maximum.accumulate(values, axis=0))


def nested_sets(
    calibration: Calibration, claim: Claim, nested: NestedSets | None = None, discarded: int | None = None
) -> tuple[Thresholds, Certificate]:
    """The last of nested rules that misses at most r calibration units, and the bound on missing a new one.

    The rules are fixed beforehand, else quantiles of the training scores; r is as in `discard`, and so are errors.
    """
    nested = nested or quantile_sets(calibration.shaping)
    count = len(calibration)
    if of_mean(calibration.kind):
        passed = nested.last_passed(calibration.pieces[0])
        chosen, bound = int(last_level(calibration, claim, np.where(passed < 0, -np.inf, passed))), claim.bound
    else:
        sure, least = claim.sure, rate_limit(claim.sure, 0, count)
        allowed = number_discarded(discarded, claim.epsilon, lambda e: misses_allowed(e, sure, count), least, count)
        last = np.sort(nested.last_passed(calibration))
        chosen, bound = int(last[allowed]), rate_limit(sure, allowed, count)
        if chosen < 0:
            raise CertificateError(
                f"{int((last < 0).sum())} of {count} calibration {calibration.kind}s leave the tube around their base, "
                f"but only {allowed} may be missed; allow more, or widen the tube or refine the basis"
            )
    rule = nested.rule(chosen, calibration.tube)
    never = int((nested.values[-1] == 0).sum())
    return rule, calibration.certificate("nested-sets", bound, claim, rule, unseen_bases=never)
