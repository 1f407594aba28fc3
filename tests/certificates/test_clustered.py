"""An interval over clusters: by hand, Clopper and Pearson's where it has to be that, and by simulation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm
from scipy.stats import t as student

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.certificates.clustered import clustered_interval
from coverdrive.errors import CertificateError

TOTALS = {
    "equal": lambda random, clusters: np.full(clusters, 20.0),
    "uniform": lambda random, clusters: random.integers(5, 61, clusters).astype(float),
    "lognormal": lambda random, clusters: np.ceil(random.lognormal(2.5, 1.0, clusters)),
}
SHARES = {
    "spread": lambda random, totals: random.beta(0.3, 3.0, len(totals)),
    "few miss most": lambda random, totals: random.beta(0.1, 1.9, len(totals)),
    "few miss": lambda random, totals: np.where(random.random(len(totals)) < 0.1, 0.6, 0.0),
    "alike": lambda random, totals: np.full(len(totals), 0.05),
    "most miss": lambda random, totals: random.beta(3.0, 0.3, len(totals)),
    "seen long": lambda random, totals: np.minimum(random.beta(0.3, 3.0, len(totals)) * totals / 20, 1.0),
}


def by_variance(hits: np.ndarray, totals: np.ndarray) -> tuple[float, float]:
    """Korn and Graubard's interval, of as many independent trials as have the variance over clusters."""
    count, rate = len(hits), hits.sum() / totals.sum()
    variance = count / (count - 1) * ((hits - rate * totals) ** 2).sum() / totals.sum() ** 2
    if variance <= 1e-12 * rate**2:
        return clopper_pearson(rate * count, count)
    fewer = (norm.ppf(0.975) / student.ppf(0.975, count - 1)) ** 2
    trials = min(rate * (1 - rate) / variance * fewer, totals.sum())
    return clopper_pearson(rate * trials, trials)


@given(st.integers(0, 30), st.integers(0, 30), st.floats(0.5, 0.999), st.floats(0.5, 300))
def test_of_clusters_that_are_hit_or_not_it_is_clopper_and_pearsons(
    hit: int, missed: int, confidence: float, total: float
) -> None:
    if hit + missed < 2:
        return
    hits, totals = total * np.repeat([1.0, 0.0], [hit, missed]), np.full(hit + missed, total)
    expected = clopper_pearson(hit, hit + missed, confidence)
    assert clustered_interval(hits, totals, confidence) == pytest.approx(expected, abs=1e-9)


def test_two_clusters_by_hand() -> None:
    """The weight w of one more among three that are drawn alike is below w with probability 1 − (1 − w)²."""
    assert clustered_interval(np.zeros(2), np.ones(2)) == pytest.approx((0, 1 - np.sqrt(0.025)))
    halves = clustered_interval(np.array([4.0, 4.0]), np.array([8.0, 8.0]))
    assert halves == pytest.approx((np.sqrt(0.025) / 2, 1 - np.sqrt(0.025) / 2))


def test_it_is_what_random_weights_say() -> None:
    random = np.random.default_rng(0)
    totals, shares = TOTALS["lognormal"](random, 30), random.beta(0.3, 3.0, 30)
    weights, size = random.exponential(size=(200_000, 31)), (totals**2).sum() / totals.sum()
    low, high = clustered_interval(shares * totals, totals)
    for end, more, share in ((low, 0.0, 0.025), (high, size, 0.975)):
        rates = (weights @ np.append(shares * totals, more)) / (weights @ np.append(totals, size))
        assert np.quantile(rates, share) == pytest.approx(end, rel=0.02)


@given(st.lists(st.tuples(st.floats(0, 1), st.integers(1, 500)), min_size=2, max_size=40), st.floats(0.5, 0.99))
def test_it_holds_what_was_seen_turns_with_hits_and_asks_for_no_order(
    clusters: list[tuple[float, int]], confidence: float
) -> None:
    shares, totals = np.array(clusters).T
    low, high = clustered_interval(shares * totals, totals, confidence)
    seen = (shares * totals).sum() / totals.sum()
    assert 0 <= low <= seen + 1e-9 and seen - 1e-9 <= high <= 1 and low < high
    turned = clustered_interval(((1 - shares) * totals)[::-1], totals[::-1], confidence)
    assert turned == pytest.approx((1 - high, 1 - low), abs=1e-9)
    wider = clustered_interval(shares * totals, totals, 0.995)
    assert wider[0] <= low and wider[1] >= high
    assert clustered_interval(3 * shares * totals, 3 * totals, confidence) == pytest.approx((low, high), abs=1e-9)


@given(st.lists(st.floats(0, 1), min_size=2, max_size=40))
def test_more_of_what_is_hit_raises_both_ends(shares: list[float]) -> None:
    some = np.array(shares)
    one, other = (clustered_interval(each, np.ones(len(some))) for each in (some, np.minimum(1.2 * some + 0.01, 1)))
    assert one[0] <= other[0] + 1e-9 and one[1] <= other[1] + 1e-9


def test_losses_that_are_rounded_and_clusters_of_nothing() -> None:
    assert clustered_interval(np.full(30, 1e-15), np.ones(30))[0] == 0.0
    assert clustered_interval(np.full(30, 1 + 1e-15), np.ones(30))[1] == 1.0
    some = clustered_interval(np.zeros(21), np.r_[np.full(20, 3.0), 0.0])
    assert some == pytest.approx(clustered_interval(np.zeros(20), np.ones(20)))
    assert clustered_interval(np.zeros(0), np.zeros(0)) == (0.0, 1.0)
    with pytest.raises(CertificateError, match="confidence"):
        clustered_interval(np.zeros(3), np.ones(3), 1.0)


def test_many_clusters_are_as_many_normal_ones() -> None:
    random = np.random.default_rng(0)
    totals = random.integers(5, 2000, 3000).astype(float)
    hits = random.beta(0.1, 2.0, 3000) * totals
    rate = hits.sum() / totals.sum()
    error = np.sqrt(((hits - rate * totals) ** 2).sum()) / totals.sum()
    low, high = clustered_interval(hits, totals)
    assert (high - low) / 2 == pytest.approx(1.96 * error, rel=0.08)


def outside(name: str, share: str, clusters: int, draws: int) -> tuple[np.ndarray, np.ndarray]:
    """Share of the draws in which the truth is below and above the interval, ours and by variance; and mean widths."""
    random = np.random.default_rng(clusters)
    many = TOTALS[name](random, 400_000)
    truth = (SHARES[share](random, many) * many).sum() / many.sum()
    found = list[list[tuple[float, float]]]()
    for _ in range(draws):
        totals = TOTALS[name](random, clusters)
        hits = random.binomial(totals.astype(int), SHARES[share](random, totals)).astype(float)
        found.append([clustered_interval(hits, totals), by_variance(hits, totals)])
    ends = np.array(found)
    missed = np.stack([truth < ends[..., 0], truth > ends[..., 1]], axis=2).mean(0)
    return missed, np.ptp(ends, axis=2).mean(0)


@pytest.mark.slow
@pytest.mark.parametrize("clusters", [5, 20, 60])
def test_the_truth_is_outside_as_seldom_as_is_said_and_by_variance_much_more_often(clusters: int) -> None:
    """The interval by variance, of which most misses are at the upper end, is the negative control."""
    draws = 120
    found = np.array([[outside(name, share, clusters, draws)[0] for share in SHARES] for name in TOTALS])
    ours, others = found[:, :, 0], found[:, :, 1]
    assert ours.sum(-1).mean() < 0.035 and ours.sum(-1).max() < 0.09
    assert ours[..., 1].max() < 0.05  # not too low: at most twice what is said, in the worst of 18 populations
    assert others.sum(-1).mean() > 0.05 and others[..., 1].max() > 0.15


@pytest.mark.slow
def test_at_two_hundred_clusters_it_is_hardly_wider_than_by_variance() -> None:
    for share, most in (("spread", 1.15), ("few miss", 1.15), ("few miss most", 1.2)):
        missed, (ours, others) = outside("equal", share, 203, 200)
        assert missed[0].sum() < 0.07 and ours < most * others
