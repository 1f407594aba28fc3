"""Intervals of observed rates: by clusters, within which samples may be alike."""

import numpy as np
import pytest

from coverdrive.certificates.bounds import clopper_pearson, clustered_interval
from coverdrive.certificates.evaluation import Rate


def test_one_sample_in_each_cluster_is_as_good_as_independent() -> None:
    hits = np.arange(400) % 20 == 0
    rate, independent = Rate.by_cluster(hits, np.arange(400)), Rate.of(hits)
    assert (rate.count, rate.total) == (20, 400)
    assert (rate.low, rate.high) == pytest.approx((independent.low, independent.high), abs=0.006)


def test_copies_change_nothing_and_names_of_clusters_neither() -> None:
    hits, cluster = np.array([1, 0, 0, 1, 0, 0], dtype=bool), np.array([0, 0, 1, 1, 2, 2])
    once, thrice = Rate.by_cluster(hits, cluster), Rate.by_cluster(np.tile(hits, 3), np.tile(7 - cluster, 3))
    assert (once.low, once.high) == pytest.approx((thrice.low, thrice.high))
    assert Rate.of(np.tile(hits, 3)).high < Rate.of(hits).high  # the negative control: windows that are counted


def test_where_nothing_is_missed_clusters_are_counted() -> None:
    assert clustered_interval(np.zeros(20), np.full(20, 100.0)) == clopper_pearson(0, 20)
    assert clustered_interval(np.full(20, 9.0), np.full(20, 9.0)) == clopper_pearson(20, 20)
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
    assert ours > 0.9 * 400 and counted < 0.6 * 400


def test_counts_are_written_as_counts_and_means_as_means() -> None:
    assert "(2 of 40; 95 %" in str(Rate.by_cluster(np.arange(40) < 2, np.arange(40)))
    assert "(mean of 40; 95 %" in str(Rate.of_losses(np.full(40, 0.125)))
