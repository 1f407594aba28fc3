"""Post-bloating with discarded samples: by hand, against a slow loop, and its bound by experiment."""

from collections.abc import Callable

import numpy as np
import pytest
from certificates_fakes import discard, make_units, post_bloat
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from coverdrive.certificates.bounds import discarding_bound, violation_bound
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.errors import CertificateError

TUBE = 0.5
NOBODY = np.array([], dtype=np.int64)
Draw = Callable[..., ScoredSamples]


def two_bases() -> ScoredSamples:
    """Raising c₀ from 0.1 to 0.6 rids three windows of base 0; raising c₁ from 0.2 to 0.3 one window of base 1."""
    scores = [[0.1, 0.0], [0.6, 0.0], [0.7, 0.0], [0.5, 0.2], [0.4, 0.3], [0.0, 0.9]]
    return ScoredSamples(np.array(scores), np.array([0, 0, 0, 1, 1, 1]), np.zeros(6), np.array([0, 0, 1, 2, 3, 4]))


def slow_greedy(samples: ScoredSamples, discarded: int) -> tuple[np.ndarray, int]:
    """Thresholds for windows with distinct scores: one window at a time, trying all."""
    kept = samples.distance <= TUBE
    left = discarded - int((~kept).sum())

    def thresholds(rows: np.ndarray) -> np.ndarray:
        chosen = [samples.score_of_base[rows & (samples.base == base)] for base in range(samples.scores.shape[1])]
        return np.array([scores.min() if len(scores) else np.inf for scores in chosen])

    def size(values: np.ndarray) -> int:
        return int((samples.scores >= np.where(np.isinf(values), 0, values)).sum())

    for _ in range(left):
        now = thresholds(kept)
        options = []
        for row in np.flatnonzero(kept):
            without = kept.copy()
            without[row] = False
            values = thresholds(without)
            if not np.isinf(values[np.isfinite(now)]).any() and size(values) < size(now):
                options.append((size(values), samples.base[row], row))
        if not options:
            break
        kept[min(options)[2]] = False
    values = thresholds(kept)
    return np.where(np.isinf(values), 0, values), int(kept.sum())


def test_greedy_by_hand() -> None:
    rule, certificate = discard(two_bases(), TUBE, NOBODY, discarded=1, confidence=0.5)
    assert rule.values == pytest.approx([0.6, 0.2], abs=2e-6)
    assert (certificate.discarded, certificate.samples) == (1, 6)
    assert certificate.epsilon == discarding_bound(0.5, 2, 1, 6)


def test_a_discarded_vehicle_takes_all_its_windows_along() -> None:
    rule, certificate = discard(two_bases(), TUBE, NOBODY, discarded=1, confidence=0.5, unit="vehicle")
    assert rule.values == pytest.approx([0.7, 0.2], abs=2e-6)  # vehicle 0 asked for 0.1 and for 0.6
    assert (certificate.discarded, certificate.samples) == (1, 5)


@pytest.mark.parametrize("unit", ["window", "vehicle"])
def test_nothing_discarded_is_post_bloating(draw: Draw, unit) -> None:
    samples = draw(200, 4, seed=2, windows=2)
    rule, certificate = discard(samples, TUBE, NOBODY, discarded=0, unit=unit)
    plain, bloated = post_bloat(samples, TUBE, NOBODY, unit=unit)
    assert np.array_equal(rule.values, plain.values)
    assert certificate.epsilon == bloated.prediction_epsilon


@given(st.integers(0, 10_000), st.integers(0, 12))
def test_greedy_is_the_slow_loop(seed: int, discarded: int) -> None:
    random = np.random.default_rng(seed)
    samples = ScoredSamples(
        random.random((30, 3)), random.integers(0, 3, 30), np.where(random.random(30) < 0.05, 1.0, 0.0), np.arange(30)
    )
    outside = int((samples.distance > TUBE).sum())
    if outside > discarded:
        with pytest.raises(CertificateError, match=f"{outside} of 30 calibration windows leave the tube"):
            discard(samples, TUBE, NOBODY, discarded=discarded, confidence=0.5)
        return
    rule, certificate = discard(samples, TUBE, NOBODY, discarded=discarded, confidence=0.5)
    values, kept = slow_greedy(samples, discarded)
    assert rule.values == pytest.approx(np.maximum(values - 1e-6, 0), abs=1e-12)
    assert 30 - kept == certificate.uncovered + certificate.discarded


@given(st.integers(0, 10_000), st.integers(1, 12))
def test_never_more_misses_than_allowed_even_with_ties(seed: int, discarded: int) -> None:
    random = np.random.default_rng(seed)
    samples = ScoredSamples(
        random.integers(0, 6, (60, 3)) / 5, random.integers(0, 3, 60), np.zeros(60), random.integers(0, 25, 60)
    )
    units = make_units(samples, TUBE, "vehicle")
    rule, _ = discard(samples, TUBE, NOBODY, discarded=discarded, confidence=0.5, unit="vehicle")
    assert units.missed(rule).sum() <= discarded


def test_target_epsilon_takes_the_most_discards_it_allows(draw: Draw) -> None:
    samples = draw(2000, 4, seed=1)
    rule, certificate = discard(samples, TUBE, NOBODY, epsilon=0.03)
    assert discarding_bound(0.99, 4, certificate.discarded, 2000) <= 0.03
    assert discarding_bound(0.99, 4, certificate.discarded + 1, 2000) > 0.03
    assert certificate.discarded > 10
    assert rule.values.sum() > post_bloat(samples, TUBE, NOBODY)[0].values.sum()


def test_impossible_requests_are_refused(draw: Draw) -> None:
    samples = draw(100, 4, seed=1)
    with pytest.raises(CertificateError, match=r"cannot prove ε = 0.01; the smallest ε possible with them is 0.097,"):
        discard(samples, TUBE, NOBODY, epsilon=0.01)
    with pytest.raises(CertificateError, match="needs a bound ε"):
        discard(samples, TUBE, NOBODY)


@pytest.mark.parametrize("discarded", [0, 5, 20])
def test_what_is_left_is_tight(draw: Draw, discarded: int) -> None:
    samples = draw(300, 3, seed=4)
    rule, certificate = discard(samples, TUBE, NOBODY, discarded=discarded)
    assert certificate.discarded <= discarded
    kept = ~make_units(samples, TUBE, "window").missed(rule)
    for base in range(3):
        assert rule.values[base] == pytest.approx(samples.score_of_base[kept & (samples.base == base)].min(), abs=2e-6)


@pytest.mark.slow
def test_bound_holds_and_without_the_discards_it_does_not(draw: Draw) -> None:
    repeats, outside, honest, careless = 1000, 0.01, 0, 0
    for repeat in range(repeats):
        samples = draw(300, 3, repeat, outside)
        rule, certificate = discard(samples, TUBE, NOBODY, discarded=12, confidence=0.9)
        violation = outside + (1 - outside) * rule.values.mean()
        honest += violation > certificate.epsilon
        careless += violation > violation_bound(0.9, 3, 300)
    assert honest <= stats.binom.ppf(0.999, repeats, 0.1)
    assert careless > stats.binom.ppf(0.999, repeats, 0.1)
