"""Nested sets: a line of thresholds, and of tubes, shaped on training data, of which one number is calibrated.

Rule l = 0 calls every base possible, and every next rule has thresholds that are at least as high, and tubes that are
no wider. A calibration unit that is missed by a rule is missed by all later ones. The last rule that misses at most r
of N₂ units has a miss probability V with P{V > ε} ≤ Φ(ε, r, N₂): the order statistic of one number has that law, and no
binomial factor is needed, because there is one way to discard the r lowest. For M bases this is a far smaller bound
than post-bloating's, paid in larger sets where the shape is wrong.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from coverdrive.certificates.bounds import misses_allowed, rate_limit
from coverdrive.certificates.calibration import Calibration, Claim, ScoredSamples
from coverdrive.certificates.certificate import NOUNS, Certificate
from coverdrive.certificates.discarding import number_discarded
from coverdrive.certificates.mean_loss import last_level
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError


@dataclass(frozen=True)
class NestedSets:
    """Nested rules, checked when made."""

    values: Float[np.ndarray, "L M"]
    """thresholds of every rule, from 0 upwards, not falling from one rule to the next"""
    radii: Float[np.ndarray, "L M"] | None = None
    """of the tubes of every rule, not growing from one rule to the next; without them, the tube of the cover"""

    def __post_init__(self) -> None:
        """Refuse rules of which a missed sample might not stay missed."""
        if len(self.values) == 0 or (self.values[0] != 0).any() or not (np.diff(self.values, axis=0) >= 0).all():
            raise CertificateError("nested thresholds must start with zeros and must not fall from rule to rule")
        if self.radii is not None and not (np.diff(self.radii, axis=0) <= 0).all():
            raise CertificateError("the tubes of nested rules must not grow from rule to rule")

    def rule(self, number: int, tube: float) -> Thresholds:
        """One of the rules; ``tube`` is the radius ρ of the cover."""
        return Thresholds.at(self.values[number], tube if self.radii is None else np.minimum(self.radii[number], tube))

    def last_passed(self, calibration: Calibration) -> Int[np.ndarray, " N"]:
        """For every unit the last rule that does not miss it; −1 if all do."""
        _, driven, score, distance = calibration.demands
        rules = np.empty(len(score))
        for base in range(calibration.bases):
            asks = driven == base
            rules[asks] = np.searchsorted(self.values[:, base], score[asks], side="right") - 1
            if self.radii is not None:
                reached = np.searchsorted(-self.radii[:, base], -distance[asks], side="right") - 1
                rules[asks] = np.minimum(rules[asks], reached)
        return calibration.level(rules).astype(np.int64)


def quantile_sets(training: ScoredSamples, rules: int = 400, tube: float | None = None) -> NestedSets:
    """Thresholds at equal quantiles of every base's training scores, after proportional ones up to the lowest score.

    With a ``tube``, the radius of the cover, the radius of every base is the quantile of its training distances that is
    passed as often, after proportional ones down to the largest distance. A base without training samples is always
    possible, within the widest tube. Half of the rules are up to the lowest score of every base, half above, where the
    quantiles are spaced geometrically.
    """
    bases = training.scores.shape[1]
    half = rules // 2
    values = np.zeros((2 * half, bases))
    radii = np.full((2 * half, bases), np.inf if tube is None else tube)
    levels = np.geomspace(1 / len(training), 1, half)
    for base in np.unique(training.base):
        scores = training.score_of_base[training.base == base]
        values[:half, base] = np.linspace(0, scores.min(), half, endpoint=False)
        values[half:, base] = np.quantile(scores, levels)
        if tube is not None:
            distances = np.minimum(training.distance[training.base == base], tube)
            radii[:half, base] = np.linspace(tube, distances.max(), half, endpoint=False)
            radii[half:, base] = np.quantile(distances, 1 - levels)
    shaped = None if tube is None else np.minimum.accumulate(radii, axis=0)
    return NestedSets(np.maximum.accumulate(values, axis=0), shaped)


def nested_sets(
    calibration: Calibration, claim: Claim, nested: NestedSets | None = None, discarded: int | None = None
) -> tuple[Thresholds, Certificate]:
    """The last of nested rules that misses at most r calibration units, and the bound on missing a new one.

    The rules are fixed beforehand, else quantiles of the training scores; r is as in `discard`, and so are errors.
    """
    nested = nested or nested_sets_of(calibration, claim)
    count = len(calibration)
    if calibration.kind in NOUNS:
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
    claim = replace(claim, tubes="cover" if nested.radii is None else "per base")
    return rule, calibration.certificate("nested-sets", bound, claim, rule, unseen_bases=never)


def nested_sets_of(calibration: Calibration, claim: Claim) -> NestedSets:
    """The rules that the training samples shape, with tubes if they are claimed."""
    return quantile_sets(calibration.shaping, tube=calibration.tube if claim.tubes == "per base" else None)
