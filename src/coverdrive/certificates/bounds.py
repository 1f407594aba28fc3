r"""Exact tail bounds for scenario programs and for observed rates (paper §3.2).

Φ(ε, k, N) is the probability of at most k successes in N trials of success rate ε. If a convex program with N i.i.d.
constraints has at most ζ supporting constraints, then the probability that its violation probability exceeds ε is at
most Φ(ε, ζ − 1, N) (Calafiore 2010, Theorem 3.3). In post-bloating with M thresholds, every sample bounds exactly one
threshold, so ζ ≤ M. The paper uses M + 2 (its Theorem 1 has k = M + 1), which is valid and looser.

In all functions, ε and confidences are in (0, 1); ζ = ``support`` ≥ 1 is the greatest number of supporting constraints
and r = ``discarded`` ≥ 0 of discarded ones, all violated by the solution; N is the number of ``samples`` or ``trials``.
They raise `CertificateError` for another confidence.
"""

import math
from bisect import bisect_left
from fractions import Fraction

import numpy as np
from scipy import optimize, special

from coverdrive.errors import CertificateError

_NEARLY_ALL = 1 - 1e-15
"""the largest bound that is looked for; above it, it is 1"""


def binomial_tail(epsilon: float, successes: int, samples: int) -> float:
    """Φ(ε, k, N) for k ``successes``, by the incomplete beta function; 1 for k ≥ N."""
    if successes >= samples:
        return 1.0
    return float(special.betaincc(successes + 1, samples - successes, epsilon))


def violation_bound(confidence: float, support: int, samples: int) -> float:
    """The smallest ε with Φ(ε, ζ − 1, N) ≤ 1 − confidence; `CertificateError` if N < ζ."""
    if not 1 <= support <= samples:
        raise CertificateError(
            f"{samples} calibration samples cannot support a bound with {support} supporting constraints; "
            "calibrate on more data, or use fewer base trajectories (a larger cover ε)"
        )
    return rate_limit(confidence, support - 1, samples)


def rate_limit(confidence: float, successes: int, trials: int) -> float:
    """The smallest ε with Φ(ε, k, N) ≤ 1 − confidence: the one-sided Clopper–Pearson upper limit of a rate."""
    check_confidence(confidence)
    return float(special.betaincinv(successes + 1, trials - successes, confidence)) if successes < trials else 1.0


def misses_allowed(epsilon: float, confidence: float, trials: int) -> int:
    """The greatest number k of misses in N trials with Φ(ε, k, N) ≤ 1 − confidence; −1 if there is none.

    A rule of one parameter that misses at most k of N calibration units has a miss probability of at most ε with this
    confidence; for a continuous score the probability is distributed as Beta(k + 1, N − k).
    """
    check_confidence(confidence)
    return bisect_left(range(trials + 1), True, key=lambda k: binomial_tail(epsilon, k, trials) > 1 - confidence) - 1


def marginal_misses_allowed(epsilon: float, trials: int) -> int:
    """The same for split conformal prediction, k = N − ⌈(N + 1)(1 − ε)⌉; −1 if that rank exceeds N.

    ε is read as the decimal number that it prints as.
    """
    return math.floor((trials + 1) * Fraction(str(float(epsilon)))) - 1


def log_discarding_tail(epsilon: float, support: int, discarded: int, samples: int) -> float:
    """Logarithm of C(ζ + r − 1, r)·Φ(ε, ζ + r − 1, N), which bounds P{violation > ε}.

    Source: Campi and Garatti 2011, Theorem 2.1. The sum is taken of logarithms, because its factors overflow.
    """
    most = support + discarded - 1
    if most >= samples:
        return math.inf
    ways = special.gammaln(most + 1) - special.gammaln(discarded + 1) - special.gammaln(support)
    terms = np.arange(most + 1)
    choices = special.gammaln(samples + 1) - special.gammaln(terms + 1) - special.gammaln(samples - terms + 1)
    powers = special.xlogy(terms, epsilon) + special.xlog1py(samples - terms, -epsilon)
    return float(ways + np.logaddexp.reduce(choices + powers))


def discarding_bound(confidence: float, support: int, discarded: int, samples: int) -> float:
    """The smallest ε for which `log_discarding_tail` is at most log(1 − confidence); there is none if N < ζ + r."""
    low, high = violation_bound(confidence, support + discarded, samples), 1 - 1e-9
    if discarded == 0 or support == 1:  # one way to discard: the tail has no further factor
        return low
    goal = math.log1p(-confidence)
    if log_discarding_tail(high, support, discarded, samples) > goal:
        return 1.0
    return float(
        optimize.root_scalar(
            lambda epsilon: log_discarding_tail(epsilon, support, discarded, samples) - goal,
            bracket=(low, high),
            method="brentq",
            xtol=1e-15,  # the tail is steep where the bound is close to 1
        ).root
    )


def discards_allowed(epsilon: float, confidence: float, support: int, samples: int) -> int:
    """The greatest number r of discarded samples whose bound is at most ε; −1 if not even none may be discarded."""
    check_confidence(confidence)
    goal = math.log1p(-confidence)
    numbers = range(max(samples - support + 1, 0))
    return bisect_left(numbers, True, key=lambda r: log_discarding_tail(epsilon, support, r, samples) > goal) - 1


def judged_bound(confidence: float, support: int, samples: int) -> float:
    r"""The bound ε(k) on the violation probability for a number k ≥ 0 of support samples found after solving.

    With confidence 1 − β, the violation probability is at most ε(k) whatever k turns out to be, where t = 1 − ε(k)
    solves β/(N + 1)·Σ_{m=k}^{N} C(m, k)·t^(m − k) = C(N, k)·t^(N − k).

    Source: Campi and Garatti 2018, *Wait-and-judge scenario optimization*, Theorem 1, for k up to any number of
    decision variables. It holds wherever the solution is unique and does not change when samples that do not support
    it are left out (Campi and Garatti 2023, *Compression, generalization and learning*); counting too many support
    samples only raises it.
    """
    check_confidence(confidence)
    if support >= samples:
        return 1.0
    terms = np.arange(support, samples + 1)
    choices = special.gammaln(terms + 1) - special.gammaln(terms - support + 1)
    ratios = choices - choices[-1]  # logarithm of C(m, k) / C(N, k)
    share = math.log1p(-confidence) - math.log(samples + 1)

    def excess(epsilon: float) -> float:
        return share + float(np.logaddexp.reduce(ratios - (samples - terms) * math.log1p(-epsilon)))

    if excess(_NEARLY_ALL) < 0:
        return 1.0
    return float(optimize.root_scalar(excess, bracket=(0.0, _NEARLY_ALL), method="brentq", xtol=1e-15).root)


def clopper_pearson(successes: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Exact two-sided interval of a rate (Clopper and Pearson 1934); of no trials, it is [0, 1]."""
    check_confidence(confidence)
    tail = (1 - confidence) / 2
    low = float(special.betaincinv(successes, trials - successes + 1, tail)) if successes > 0 else 0.0
    high = float(special.betainccinv(successes + 1, trials - successes, tail)) if successes < trials else 1.0
    return low, high


def check_confidence(confidence: float) -> None:
    """Raise `CertificateError` unless 0 < confidence < 1."""
    if not 0 < confidence < 1:
        raise CertificateError(f"a confidence must lie strictly between 0 and 1, got {confidence}")
