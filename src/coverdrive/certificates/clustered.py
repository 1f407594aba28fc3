"""An interval of a pooled share, such as missed windows of all windows, over clusters, such as vehicles.

Clusters are independent and each has anything from none to all of its windows missed; how many windows it has, and
how alike they are, is not known beforehand. A variance over clusters says little where few of them have most of what
is missed, and nothing of those that were not seen; intervals made of it are then too narrow, and most of them end too
low. This one asks, instead, which rates weights that are drawn at random make likely (Gaffke, *Three test statistics
for a nonparametric one-sided hypothesis on the mean of a nonnegative variable*, 2005; Learned-Miller and Thomas, *A new
confidence interval for the mean of a bounded random variable*, 2019):

With independent standard exponential weights E_c, as in the Bayesian bootstrap (Rubin 1981), and one more cluster that
misses all of m windows, the upper end r has P{Σ E_c h_c + E m > r (Σ E_c n_c + E m)} = β, for h_c hits of n_c. The
lower end is that of what is not hit. m is the size of the cluster of a window, on average over windows, Σ n_c² / Σ n_c.

Of clusters that have equal totals, and are hit in all or nothing, it is Clopper and Pearson's interval. For losses in
[0, 1] with equal totals it has no known exception, and no proof; if 1.8 % of all vehicles were missed in all windows,
203 that are drawn would show none of these in one of 40 cases, and so no such interval can end lower than 1.8 %. With
other totals it is an approximation. Simulated were 95 % intervals of 11 laws of the share that a cluster misses (alike,
spread, zero of most, larger or smaller where it is seen long), and 5 of totals: equal, uniform and lognormal, in 33
populations, and so heavy-tailed that a few clusters have most of the windows, in 22. The truth is outside in so many
percent of the cases, on average over populations and in the worst one; beside it that of Korn and Graubard (1998), of
as many independent windows as have the variance over clusters, with Student's quantiles:

| clusters                       |     5    |    20    |    60    |    203   |
|--------------------------------|----------|----------|----------|----------|
| 33 populations                 | 0.6, 2.0 | 1.2, 3.8 | 1.6, 4.0 | 2.4, 6.4 |
| … by the variance              |  5, 21   |  7, 30   |  6, 15   |  5, 14   |
| 22 heavy-tailed ones           |  1, 11   |  2, 11   |  2, 20   |  3, 16   |
| … by the variance              |  8, 42   | 13, 46   | 12, 35   | 11, 50   |
| width of the 33                |   0.61   |   0.27   |   0.13   |   0.060  |
| … by the variance              |   0.41   |   0.16   |   0.09   |   0.049  |
"""

import numpy as np
from jaxtyping import Float
from scipy import optimize, special

from coverdrive.certificates.bounds import check_confidence

_STEP = 0.1
"""of the trapezoidal rule: ends are exact to 1e-5 of themselves for hundreds of clusters, and to 1e-3 for thousands"""
_ALONG = np.split(np.arange(_STEP / 2, 14, _STEP), range(30, 140, 10))
"""where it is evaluated, part by part; the first is enough where the sum is nearly normal"""
_ROUNDING, _NEVER = 1e-12, 1e-300
_NEWTON, _NEAR = 200, 1e-6
"""steps to the saddle at the most, and how near it one has to come, in units of the width there"""


def clustered_interval(
    hits: Float[np.ndarray, " C"], totals: Float[np.ndarray, " C"], confidence: float = 0.95
) -> tuple[float, float]:
    """Interval of the rate Σ hits / Σ totals over C clusters, within which anything may depend on anything.

    ``hits`` of a cluster are from 0 to its total, whole numbers or sums of losses. Clusters of nothing are none; of a
    single one it is [0, 1].
    """
    check_confidence(confidence)
    hits, totals = hits[totals > 0], totals[totals > 0]
    hits = np.clip(hits, 0.0, totals)  # sums of losses are rounded
    if len(hits) < 2:
        return 0.0, 1.0
    tail = (1 - confidence) / 2
    return 1 - _upper_end(totals - hits, totals, tail), _upper_end(hits, totals, tail)


def _upper_end(hits: Float[np.ndarray, " C"], totals: Float[np.ndarray, " C"], tail: float) -> float:
    rate, more = float(hits.sum() / totals.sum()), float((totals**2).sum() / totals.sum())
    if rate >= 1 - _ROUNDING:
        return 1.0

    def excess(end: float) -> float:
        """In standard deviations, in which it is nearly a straight line, so that few rates are tried."""
        above = _exceeds_zero(np.append(hits - end * totals, (1 - end) * more))
        return float(special.ndtri(max(above, _NEVER)) - special.ndtri(tail))

    return float(optimize.root_scalar(excess, bracket=(rate, 1.0), method="brentq", xtol=1e-11).root)


def _exceeds_zero(parts: Float[np.ndarray, " n"]) -> float:
    """P{Σ parts · E > 0} of independent standard exponential E.

    It is the integral of exp(K(s)) / (2πi s), with K(s) = −Σ log(1 − parts · s), along a line on which the real part of
    s is positive, through the point where that is least (Daniels, *Tail probability approximations*, 1987).
    """
    largest = float(parts.max())
    if largest <= 0:
        return 0.0
    part, count = np.unique(parts / largest, return_counts=True)
    mean, square = float(count @ part), float(count @ part**2)
    saddle = min((np.sqrt(mean**2 + 4 * square) - mean) / (2 * square), 0.9)  # of a normal sum
    steep, width = part, np.inf
    for _ in range(_NEWTON):  # damped: K(s) − log s is self-concordant
        steep = part / (1 - part * saddle)
        slope, width = count @ steep - 1 / saddle, (count @ steep**2 + saddle**-2) ** -0.5
        if abs(slope) * width < _NEAR:
            break
        saddle -= slope * width**2 / (1 + abs(slope) * width)
    total = 0.0
    for along in _ALONG:
        y = width * np.sinh(along)
        factors = 1 - np.multiply.outer(steep, 1j * y)
        if len(part) < len(parts):
            factors **= count[:, None]
        terms = np.cosh(along) / (factors.prod(axis=0) * (saddle + 1j * y))
        total += float(terms.real.sum())
        if abs(terms[-1]) < _ROUNDING * abs(total):
            break
    return float(total * width * _STEP / np.pi * np.exp(-np.log1p(-part * saddle) @ count))
