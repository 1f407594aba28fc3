"""Intervals of observed rates: by clusters, within which samples may be alike."""

import numpy as np
import pytest
from scipy.stats import t as student

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.certificates.clustered import clustered_interval
from coverdrive.certificates.evaluation import Rate


def test_one_sample_in_each_cluster_is_as_good_as_independent() -> None:
    hits = np.arange(400) % 20 == 0
    rate, independent = Rate.by_cluster(hits, np.arange(400)), Rate.of(hits)
    assert (rate.count, rate.total) == (20, 400)
    assert (rate.low, rate.high) == pytest.approx((independent.low, independent.high), abs=3e-4)


def test_copies_change_nothing_and_names_of_clusters_neither() -> None:
    hits, cluster = np.array([1, 0, 0, 1, 0, 0], dtype=bool), np.array([0, 0, 1, 1, 2, 2])
    once, thrice = Rate.by_cluster(hits, cluster), Rate.by_cluster(np.tile(hits, 3), np.tile(7 - cluster, 3))
    assert (once.low, once.high) == pytest.approx((thrice.low, thrice.high))
    assert Rate.of(np.tile(hits, 3)).high < Rate.of(hits).high  # the negative control: windows that are counted


def test_where_nothing_is_missed_clusters_are_counted() -> None:
    assert clustered_interval(np.zeros(20), np.full(20, 100.0)) == pytest.approx(clopper_pearson(0, 20), abs=1e-12)
    assert clustered_interval(np.full(20, 9.0), np.full(20, 9.0)) == pytest.approx(clopper_pearson(20, 20), abs=1e-12)
    assert clustered_interval(np.ones(1), np.full(1, 9.0)) == (0.0, 1.0)


def test_it_holds_the_truth_as_often_as_it_says_and_counting_windows_does_not() -> None:
    """60 vehicles of 5 to 60 windows each, of which a vehicle misses a share of its own, larger if it is seen long."""
    truth, ours, counted = 0.0, 0, 0
    draws = list[tuple[Rate, Rate]]()
    for seed in range(400):
        random = np.random.default_rng(seed)
        windows = random.integers(5, 61, 60)
        share = np.minimum(random.beta(0.3, 3.0, 60) * windows / 30, 1.0)
        vehicle = np.repeat(np.arange(60), windows)
        hits = random.random(len(vehicle)) < share[vehicle]
        truth += (share * windows).sum() / windows.sum() / 400
        draws.append((Rate.by_cluster(hits, vehicle), Rate.of(hits)))
    for by_vehicle, by_window in draws:
        ours += by_vehicle.low <= truth <= by_vehicle.high
        counted += by_window.low <= truth <= by_window.high
    assert ours > 0.92 * 400 and counted < 0.6 * 400


@pytest.mark.parametrize(
    ("clusters", "missing"),
    [
        (5, "few"),
        (50, "all alike"),
        *(
            pytest.param(*each, marks=pytest.mark.slow)
            for each in [(50, "few"), (200, "few"), (5, "all alike"), (200, "all alike")]
        ),
    ],
)
def test_it_holds_where_few_clusters_have_all_that_is_missed_and_student_does_not(clusters: int, missing: str) -> None:
    """Student's interval of the same ratio (Cochran 1977) is the negative control."""
    random, held, students, rate = np.random.default_rng(clusters), 0, 0, 0.03 if missing == "few" else 0.5
    quantile = student.ppf(0.975, clusters - 1)
    for _ in range(1000):
        totals = random.integers(1, 40, clusters)
        share = np.where(random.random(clusters) < rate, 0.6, 0.0) if missing == "few" else random.beta(2, 2, clusters)
        hits = random.binomial(totals, share)
        truth, found = 0.6 * rate if missing == "few" else 0.5, Rate.of_totals(hits, totals)
        held += found.low <= truth <= found.high
        spread = np.std(hits - found.value * totals, ddof=1) * np.sqrt(clusters) / totals.sum()
        students += abs(found.value - truth) <= quantile * spread
    assert held > (0.93 if missing == "few" else 0.9) * 1000
    assert students < held


def test_it_is_never_narrower_than_that_of_independent_windows() -> None:
    for hits, totals in (((1, 1), (100, 101)), ((5,) * 200, (100,) * 200)):
        rate, counted = Rate.of_totals(np.array(hits), np.array(totals)), clopper_pearson(sum(hits), sum(totals))
        assert rate.high > counted[1] and rate.high - rate.low > counted[1] - counted[0]
    shares = Rate.of_losses(np.linspace(0.4, 0.6, 40))  # of which each says more than yes or no
    assert shares.high - shares.low < 0.1


def test_clusters_that_do_not_differ_are_still_no_more_than_their_number() -> None:
    """The weight of ten of eleven that are drawn alike is above w with probability 1 − w^10."""
    weight = 0.025 ** (1 / 10)
    expected = 0.25 * weight, 0.25 * weight + (1 - weight)
    assert clustered_interval(np.full(10, 2.0), np.full(10, 8.0)) == pytest.approx(expected)
    once, (low, high) = Rate.of_losses(np.full(40, 0.125)), clopper_pearson(5, 40)
    assert low < once.low < 0.125 < once.high < high  # losses that are all 0 or 1 say least


def test_every_cluster_has_its_own_total() -> None:
    for hits, totals in (((1, 9, 3), (2, 40, 11)), ((0, 30, 2), (5, 40, 6))):
        found = Rate.of_totals(np.array(hits), np.array(totals))
        assert (found.low, found.high) == clustered_interval(np.array(hits, dtype=float), np.array(totals, dtype=float))
        assert (found.count, found.total) == (sum(hits), sum(totals))


def test_counts_are_written_as_counts_and_means_as_means() -> None:
    assert "(2 of 40; 95 %" in str(Rate.by_cluster(np.arange(40) < 2, np.arange(40)))
    assert "(mean of 40; 95 %" in str(Rate.of_losses(np.full(40, 0.125)))
