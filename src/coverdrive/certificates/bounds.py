r"""Exact tail bounds for scenario programs and for observed rates (paper §3.2).

Φ(ε, k, N) is the probability of at most k successes in N trials of success rate ε. If a convex program with N
i.i.d. constraints has at most ζ supporting constraints, then the probability that its violation probability exceeds
ε is at most Φ(ε, ζ − 1, N) (Calafiore 2010, Theorem 3.3).

Post-bloating with M thresholds: every sample bounds exactly one threshold, so ζ ≤ M. The paper uses M + 2
(its Theorem 1 has k = M + 1), which is valid and looser.
"""

from scipy import special, stats

from coverdrive.errors import CertificateError


def binomial_tail(epsilon: float, successes: int, samples: int) -> float:
    """Φ(ε, k, N), by the incomplete beta function.

    Args:
        epsilon: success rate ε in [0, 1].
        successes: k ≥ 0; for k ≥ N the tail is 1.
        samples: number of trials N.
    """
    if successes >= samples:
        return 1.0
    return float(special.betaincc(successes + 1, samples - successes, epsilon))


def violation_bound(confidence: float, support: int, samples: int) -> float:
    """The smallest ε with Φ(ε, ζ − 1, N) ≤ 1 − confidence.

    Args:
        confidence: probability in (0, 1) with which the violation probability is at most ε.
        support: greatest number ζ ≥ 1 of supporting constraints.
        samples: number N of i.i.d. samples.

    Raises:
        CertificateError: confidence outside (0, 1), or fewer samples than supporting constraints.
    """
    if not 1 <= support <= samples:
        raise CertificateError(
            f"{samples} calibration samples cannot support a bound with {support} supporting constraints; "
            "calibrate on more data, or use fewer base trajectories (a larger cover ε)"
        )
    return rate_limit(confidence, support - 1, samples)


def rate_limit(confidence: float, successes: int, trials: int) -> float:
    """The smallest ε with Φ(ε, k, N) ≤ 1 − confidence: the one-sided Clopper–Pearson upper limit of a rate.

    Args:
        confidence: in (0, 1).
        successes: observed number k of successes.
        trials: number N of independent trials.
    """
    check_confidence(confidence)
    return float(special.betaincinv(successes + 1, trials - successes, confidence)) if successes < trials else 1.0


def clopper_pearson(successes: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Exact two-sided interval of a rate (Clopper and Pearson 1934).

    Args:
        successes: observed number of successes.
        trials: number of independent trials; with none, the interval is [0, 1].
        confidence: coverage in (0, 1).

    Returns:
        The lower and the upper end.
    """
    check_confidence(confidence)
    tail = (1 - confidence) / 2
    low = float(stats.beta.ppf(tail, successes, trials - successes + 1)) if successes > 0 else 0.0
    high = float(stats.beta.isf(tail, successes + 1, trials - successes)) if successes < trials else 1.0
    return low, high


def check_confidence(confidence: float) -> None:
    """Raise `CertificateError` unless 0 < confidence < 1."""
    if not 0 < confidence < 1:
        raise CertificateError(f"a confidence must lie strictly between 0 and 1, got {confidence}")
