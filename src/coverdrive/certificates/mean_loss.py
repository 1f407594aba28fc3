"""Bounds on a mean loss: the share of a vehicle's windows, or of a scene group's vehicles, that are missed.

Windows of a vehicle, and vehicles of a group, may depend on each other as they like: only the vehicles, or the groups,
have to be independent. Of n units, unit i has the loss L_i in [0, 1], and the mean of a new one is to be at most ε.

With a confidence, a bettor who starts with 1 stakes the fraction c of what can be staked on every unit, so that its
capital is Π (1 + c·(ε − L_i) / (1 − ε)). If the mean were at least ε, that capital would be expected to be at most 1:
it is an e-value, in whatever order units come, and so is its mean over several fractions that are fixed before the
losses are seen. That it reaches 1 / (1 − confidence) has at most the probability 1 − confidence (Markov; Waudby-Smith
and Ramdas 2024, §4). Where units lose everything or nothing, the best fraction is c = 1 − p/ε, with the share p of
them that loses. Fractions go in equal ratios from the least that can pay, of the p with n·KL(p‖ε) = log 1 / (1 −
confidence), up to nearly 1, because losses that are spread less allow larger ones. Capital grows with ε: a factor is
linear in L_i, and both of its ends grow, since 1 − 1/x ≤ log x ≤ x − 1. Where few units lose much, as few vehicles do,
other bounds were larger in simulation: stakes that are learned from the units before, averaged over orders, Hoeffding's
and Bentkus'. Without a confidence, (Σ L_i + 1) / (n + 1) ≤ ε (conformal risk control, Angelopoulos et al. 2024; for
groups, hierarchical conformal prediction, Lee, Barber and Willett 2023).

Rules are nested, so that losses only grow from one to the next: the last one before the first that does not pass is
valid, wherever the rules to try are (Bates et al. 2021, Theorem 1).
"""

import math
from bisect import bisect_left
from functools import lru_cache

import numpy as np
from jaxtyping import Float
from scipy import optimize, special

from coverdrive.certificates.calibration import Calibration, Claim
from coverdrive.certificates.certificate import NOUNS
from coverdrive.errors import CertificateError
from coverdrive.percentages import counted

_MOST_STAKED, _FRACTIONS = 0.99, 6
"""the largest fraction, and how many there are"""

_EXACT = 1e-6
"""within which a smallest bound is found"""


def proves(losses: Float[np.ndarray, " n"], epsilon: float, confidence: float | None, times: int = 1) -> bool:
    """Whether losses, each so many times, prove that their mean is at most ε; the larger ε, the sooner."""
    count = len(losses) * times
    if confidence is None:
        return bool((losses.sum() * times + 1) / (count + 1) <= epsilon)
    goal = -math.log1p(-confidence)
    staked = fractions(count, epsilon, goal)[:, None]
    capital = np.log1p(staked * ((epsilon - np.sort(losses)) / (1 - epsilon))).sum(1) * times
    return bool(np.logaddexp.reduce(capital) - np.log(len(capital)) >= goal)


@lru_cache(maxsize=64)
def fractions(count: int, epsilon: float, goal: float) -> Float[np.ndarray, " K"]:
    """What to stake of what can be staked on each of ``count`` losses against a mean of ε, to reach a log-capital."""

    def short(share: float) -> float:
        return float(special.rel_entr(share, epsilon) + special.rel_entr(1 - share, 1 - epsilon)) - goal / max(count, 1)

    share = optimize.root_scalar(short, bracket=(0.0, epsilon), method="brentq").root if short(0.0) > 0 else 0.0
    least = 1 - float(share) / epsilon
    return np.geomspace(min(least, _MOST_STAKED), _MOST_STAKED, _FRACTIONS)


def loss_limit(losses: Float[np.ndarray, " n"], confidence: float | None) -> float:
    """The smallest bound on the mean that losses prove; 1 if they prove none."""
    low, high = 0.0, 1.0
    while high - low > _EXACT:
        middle = (low + high) / 2
        low, high = (low, middle) if proves(losses, middle, confidence) else (middle, high)
    return high


def units_needed(epsilon: float, confidence: float | None) -> int:
    """How many units without any loss prove ε."""

    def enough(count: int) -> bool:
        return proves(np.zeros(1), epsilon, confidence, count)

    most = 1
    while not enough(most):
        most *= 2
    return bisect_left(range(most), True, 1, key=enough)


def last_level(calibration: Calibration, claim: Claim, level: Float[np.ndarray, " P"]) -> float:
    """The highest level of nested rules of which the mean loss is proved to be at most ε, else `CertificateError`.

    A rule misses the pieces (`Calibration.pieces`) whose level is below its own; every rule misses those of level −∞.
    More losses never prove what fewer do not, so that it is found by halving.
    """
    owner, values = calibration.pieces[1], np.unique(level[np.isfinite(level)])
    weight = 1 / np.bincount(owner)[owner]

    def losses(value: float) -> Float[np.ndarray, " n"]:
        return np.bincount(owner, weight * (level < value))

    passed = bisect_left(values, True, key=lambda value: not proves(losses(value), claim.bound, claim.confidence))
    if passed == 0:
        raise CertificateError(_refusal(calibration, claim, losses(values[0] if len(values) else np.inf)))
    return float(values[passed - 1])


def _refusal(calibration: Calibration, claim: Claim, losses: Float[np.ndarray, " n"]) -> str:
    asked = f"{counted(len(losses), f'calibration {NOUNS[calibration.kind]}')} cannot prove ε = {claim.bound:g}"
    needed = units_needed(claim.bound, claim.confidence)
    if needed > len(losses):
        least = loss_limit(np.zeros(len(losses)), claim.confidence)
        smallest = f"the smallest ε possible with them is {least:.3g}" if least < 1 else "they prove no ε"
        return f"{asked}; {smallest}, and {needed} of them would do: give more recordings, or allow a larger ε"
    return f"{asked}: {losses.mean():.3g} of them is lost with the widest sets; allow a larger ε, or widen the tube"
