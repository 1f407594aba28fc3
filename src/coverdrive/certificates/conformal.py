"""Split conformal prediction on the residual 1 − score of the driven base (paper, appendix), pooled or per base.

Of n calibration units, d is the ⌈(n + 1)(1 − ε)⌉-th smallest residual, and the threshold is c = 1 − d: one for all
bases (pooled), or one for every base by itself, of the units that drove it (per base, Mondrian: the paper's). A unit
outside the tube has an infinite residual, so that misses of the cover count like all others. If the rank exceeds n, or
if that residual is infinite, no threshold is valid: the base is always possible, and the certificate excludes it.

The guarantee averages over calibrations. With a confidence, the rank l is instead the least that satisfies Φ(ε, n − l,
n) ≤ 1 − confidence (the miss probability of a continuous score is distributed as Beta(n + 1 − l, l): Vovk 2012,
Proposition 2a); bases by themselves share the allowed error probability equally, so that all hold at once.
"""

import numpy as np
from jaxtyping import Float

from coverdrive.certificates.bounds import marginal_misses_allowed, misses_allowed, rate_limit
from coverdrive.certificates.calibration import Calibration, Claim, refusal
from coverdrive.certificates.certificate import Certificate, of_mean
from coverdrive.certificates.mean_loss import last_level
from coverdrive.certificates.rule import Thresholds


def conformal(calibration: Calibration, claim: Claim, per_base: bool = False) -> tuple[Thresholds, Certificate]:
    """Thresholds that miss at most a share ε of new samples; too few for any of them: `CertificateError`.

    Of a mean loss (`coverdrive.certificates.mean_loss`), ε bounds its mean, for all bases together. Per base, a vehicle
    counts for every base that it drives, with its windows there. Without a confidence, ε is marginal.
    """
    epsilon, bases, promise = claim.bound, calibration.bases, "conformal" if claim.confidence is None else "pac"
    if of_mean(calibration.kind):
        level = last_level(calibration, claim, _scores(calibration.pieces[0]))
        rule = Thresholds.at(np.full(bases, level), calibration.tube)
        return rule, calibration.certificate(f"{promise}-pooled", epsilon, claim, rule, unseen_bases=0)
    groups = bases if per_base else 1
    shared = None if claim.confidence is None else 1 - (1 - claim.confidence) / groups
    scores = [_scores(calibration, base) for base in range(bases)] if per_base else [_scores(calibration)]
    misses = [
        marginal_misses_allowed(epsilon, len(each)) if shared is None else misses_allowed(epsilon, shared, len(each))
        for each in scores
    ]
    pairs = list(zip(scores, misses, strict=True))
    lowest = np.array([np.partition(each, most)[most] if most >= 0 else -np.inf for each, most in pairs])
    if not np.isfinite(lowest).any():
        asked, allowed = max(pairs, key=lambda pair: len(pair[0]))
        count, outside = len(asked), int(np.isinf(asked).sum())
        least = 1 / (count + 1) if shared is None else rate_limit(shared, 0, count)
        raise refusal(calibration.kind, count, outside, epsilon, allowed, least)
    lowest = np.broadcast_to(lowest, bases)
    rule = Thresholds.at(lowest, calibration.tube)
    name = f"{promise}-{'per-base' if groups > 1 else 'pooled'}"
    unseen = int(np.isinf(lowest).sum())
    return rule, calibration.certificate(name, epsilon, claim, rule, groups=groups, unseen_bases=unseen)


def _scores(calibration: Calibration, base: int | None = None) -> Float[np.ndarray, " n"]:
    """Lowest score, in the base or in all that it drove, of every unit that drove it; −∞ if it left the tube there."""
    _, driven, score = calibration.demands
    lowest = calibration.level(score if base is None else np.where(driven == base, score, np.inf))
    return lowest[lowest < np.inf]
