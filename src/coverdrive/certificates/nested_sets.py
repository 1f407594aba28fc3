"""Nested sets: a line of thresholds, shaped on training data, of which one number is calibrated.

Rule l = 0 calls every base possible, and every next rule has thresholds that are at least as high. A calibration unit
that is missed by a rule is missed by all later ones. The last rule that misses at most r of N₂ units has a miss
probability V with P{V > ε} ≤ Φ(ε, r, N₂): the order statistic of one number has that law, and no binomial factor is
needed, because there is one way to discard the r lowest. For M bases this is a far smaller bound than post-bloating's,
paid in larger sets where the shape is wrong.
"""

import numpy as np
from jaxtyping import Float, Int

from coverdrive.certificates.bounds import misses_allowed, rate_limit
from coverdrive.certificates.calibration import Calibration, Claim, ScoredSamples, refusal
from coverdrive.certificates.certificate import Certificate, of_mean
from coverdrive.certificates.mean_loss import last_level
from coverdrive.certificates.rule import Thresholds


def quantile_sets(training: ScoredSamples, rules: int = 400) -> Float[np.ndarray, "L M"]:
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
    return np.maximum.accumulate(values, axis=0)


def last_passed(nested: Float[np.ndarray, "L M"], calibration: Calibration) -> Int[np.ndarray, " N"]:
    """For every unit the last of nested rules that does not miss it; −1 if all do."""
    _, driven, score = calibration.demands
    rules = np.empty(len(score))
    for base in range(calibration.bases):
        asks = driven == base
        rules[asks] = np.searchsorted(nested[:, base], score[asks], side="right") - 1
    return calibration.level(rules).astype(np.int64)


def nested_sets(
    calibration: Calibration, claim: Claim, nested: Float[np.ndarray, "L M"] | None = None
) -> tuple[Thresholds, Certificate]:
    """The last of nested rules that misses no more calibration units than ε allows, and the bound on missing a new one.

    The rules are fixed beforehand, else quantiles of the training scores: thresholds that start with zeros and do not
    fall from one rule to the next. Errors are as of `discard`.
    """
    nested = quantile_sets(calibration.shaping) if nested is None else nested
    if of_mean(calibration.kind):
        passed = last_passed(nested, calibration.pieces[0])
        chosen, bound = int(last_level(calibration, claim, np.where(passed < 0, -np.inf, passed))), claim.bound
    else:
        sure, count = claim.sure, len(calibration)
        allowed, outside = misses_allowed(claim.bound, sure, count), calibration.uncovered
        if outside > allowed:
            raise refusal(calibration.kind, count, outside, claim.bound, allowed, least=rate_limit(sure, 0, count))
        chosen, bound = int(np.sort(last_passed(nested, calibration))[allowed]), rate_limit(sure, allowed, count)
    rule = Thresholds.at(nested[chosen], calibration.tube)
    never = int((nested[-1] == 0).sum())
    return rule, calibration.certificate("nested-sets", bound, claim, rule, unseen_bases=never)
