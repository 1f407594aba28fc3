"""Split conformal prediction on the residual 1 − score of the driven base (paper, appendix), for groups of bases.

In every group on its own, d is the ⌈(n + 1)(1 − ε)⌉-th smallest residual of its n calibration units, and the threshold
of its bases is c = 1 − d. Groups are all bases (pooled), every base by itself (per base, Mondrian: the paper's), or
every frequent base by itself and the rare ones together (clustered). A unit outside the tube has an infinite residual,
so that misses of the cover count like all others. If the rank exceeds n, or if that residual is infinite, no threshold
of the group is valid: its bases are always possible, and the certificate excludes them.

The guarantee averages over calibrations. With a confidence, the rank l is instead the least that satisfies Φ(ε, n − l,
n) ≤ 1 − confidence (the miss probability of a continuous score is distributed as Beta(n + 1 − l, l): Vovk 2012,
Proposition 2a); the groups share the allowed error probability equally, so that all hold at once.
"""

import numpy as np
from jaxtyping import Float, Int

from coverdrive.certificates.bounds import marginal_misses_allowed, misses_allowed, rate_limit
from coverdrive.certificates.calibration import Calibration, Claim, check_epsilon
from coverdrive.certificates.certificate import NOUNS, Certificate
from coverdrive.certificates.mean_loss import last_level
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError


def conformal(
    calibration: Calibration, claim: Claim, group: Int[np.ndarray, " M"] | None = None
) -> tuple[Thresholds, Certificate]:
    """Thresholds that miss at most a share ε of new samples of every group; all groups too small: `CertificateError`.

    Of a mean loss (`coverdrive.certificates.mean_loss`), ε bounds its mean, for all bases in one group. With several
    groups, a vehicle counts in every group that it drives, with its windows there. The ``group`` of every
    base is fixed without looking at the calibration scores, else there is one; without a confidence, ε is marginal.
    """
    epsilon, bases = claim.bound, calibration.bases
    member = np.unique(np.zeros(bases) if group is None else group, return_inverse=True)[1]
    if len(member) != bases:
        raise CertificateError(f"every one of the {bases} bases needs a group, got {len(member)} groups")
    groups, promise = int(member.max()) + 1, "conformal" if claim.confidence is None else "pac"
    if calibration.kind in NOUNS:
        level = last_level(calibration, claim, _scores(calibration.pieces[0], member == 0))
        rule = Thresholds.at(np.full(bases, level), calibration.tube)
        return rule, calibration.certificate(f"{promise}-pooled", epsilon, claim, rule, unseen_bases=0)
    shared = None if claim.confidence is None else 1 - (1 - claim.confidence) / groups
    scores = [_scores(calibration, member == number) for number in range(groups)]
    lowest = np.array([_threshold(score, epsilon, shared) for score in scores])
    if not np.isfinite(lowest).any():
        raise CertificateError(_refusal(max(scores, key=len), epsilon, shared, calibration))
    rule = Thresholds.at(lowest[member], calibration.tube)
    kind = {1: "pooled", bases: "per-base"}.get(groups, "clustered") if bases > 1 else "pooled"
    unseen = int(np.isinf(lowest[member]).sum())
    more = {"groups": groups, "unseen_bases": unseen}
    return rule, calibration.certificate(f"{promise}-{kind}", epsilon, claim, rule, **more)


def per_base(bases: int) -> Int[np.ndarray, " M"]:
    """Every base by itself."""
    return np.arange(bases)


def clustered(training_count: Int[np.ndarray, " M"], least: float) -> Int[np.ndarray, " M"]:
    """Rare bases in one group, every other base by itself.

    Bases with fewer than ``least`` units of the training split Ω₁ are rare; if they have fewer than that even together,
    the next rarest bases join them.
    """
    rarest = np.argsort(training_count, kind="stable")
    before = np.cumsum(training_count[rarest]) - training_count[rarest]
    few = training_count[rarest] < least
    group = np.arange(len(training_count))
    group[rarest[few | (few.any() & (before < least))]] = -1
    return group


def units_needed(epsilon: float, confidence: float | None = None) -> int:
    """The smallest number of calibration units of a group with which ε is possible; confidence of this group alone."""
    check_epsilon(epsilon)
    estimate = 1 / epsilon - 1 if confidence is None else np.log1p(-confidence) / np.log1p(-epsilon)
    needed = max(int(estimate) - 2, 0)
    while _misses(epsilon, confidence, needed) < 0:
        needed += 1
    return needed


def _misses(epsilon: float, confidence: float | None, count: int) -> int:
    """Greatest number of calibration units that may be missed; negative if ε is impossible."""
    if confidence is None:
        return marginal_misses_allowed(epsilon, count)
    return misses_allowed(epsilon, confidence, count)


def _scores(calibration: Calibration, bases: np.ndarray) -> Float[np.ndarray, " n"]:
    """Lowest score, in the driven bases of a group, of every unit that drove one; −∞ if it left the tube there."""
    unit, base, score, _ = calibration.demands
    asks = bases[base]
    lowest = np.full(len(calibration), np.inf)
    np.minimum.at(lowest, unit[asks], score[asks])
    return lowest[lowest < np.inf]


def _threshold(scores: Float[np.ndarray, " n"], epsilon: float, confidence: float | None) -> float:
    """1 − d, or −∞ if there is no valid one."""
    misses = _misses(epsilon, confidence, len(scores))
    return float(np.partition(scores, misses)[misses]) if misses >= 0 else -np.inf


def _refusal(
    scores: Float[np.ndarray, " n"], epsilon: float, confidence: float | None, calibration: Calibration
) -> str:
    """Why not even the group with the most units can be calibrated."""
    count, outside = len(scores), int(np.isinf(scores).sum())
    if _misses(epsilon, confidence, count) >= 0:
        return (
            f"{outside} of {count} calibration {calibration.kind}s leave the tube around their base, more than ε = "
            f"{epsilon:g} allows; allow a larger ε, or widen the tube or refine the basis"
        )
    least = 1 / (count + 1) if confidence is None else rate_limit(confidence, 0, count)
    return (
        f"{count} calibration {calibration.kind}s cannot prove ε = {epsilon:g}; the smallest ε possible with them is "
        f"{least:.3g}, so allow that much or calibrate on more data"
    )
