"""One-parameter families: by hand, the exact law of their violation probability, and refusals."""

from collections.abc import Callable

import numpy as np
import pytest
from certificates_fakes import learn_then_test, make_units, nested_sets
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from coverdrive.certificates.bounds import misses_allowed, rate_limit
from coverdrive.certificates.calibration import Claim, ScoredSamples
from coverdrive.certificates.certificate import Unit
from coverdrive.certificates.nested_sets import last_passed, quantile_sets
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError

TUBE = 0.5
NOBODY = np.array([], dtype=np.int64)
Draw = Callable[..., ScoredSamples]


def ladder() -> np.ndarray:
    return np.array([[0.0, 0.0], [0.2, 0.1], [0.4, 0.2], [0.8, 0.2]])


def three_windows(third: float = 0.0) -> ScoredSamples:
    """They pass the ladder up to rules 2, 1 and 3."""
    scores = np.array([[0.5, 0.0], [0.0, 0.1], [0.0, 0.9]])
    return ScoredSamples(scores, np.array([0, 1, 1]), np.array([0.0, 0.0, third]), np.array([4, 5, 4]))


def test_levels_by_hand() -> None:
    assert last_passed(ladder(), make_units(three_windows(), TUBE, "window")).tolist() == [2, 1, 3]
    assert last_passed(ladder(), make_units(three_windows(), TUBE, "vehicle")).tolist() == [2, 1]
    assert last_passed(ladder(), make_units(three_windows(0.9), TUBE, "vehicle")).tolist() == [-1, 1]


@pytest.mark.parametrize(("discarded", "values"), [(0, [0.2, 0.1]), (1, [0.4, 0.2]), (2, [0.8, 0.2])])
def test_the_last_rule_that_misses_no_more(discarded: int, values: list[float]) -> None:
    rule, certificate = nested_sets(three_windows(), TUBE, NOBODY, ladder(), discarded, confidence=0.5)
    assert rule.values == pytest.approx(values, abs=2e-6)
    assert certificate.epsilon == rate_limit(0.5, discarded, 3)
    assert certificate.discarded == discarded


def test_last_passed_is_the_last_rule_that_does_not_miss(draw: Draw) -> None:
    units = make_units(draw(100, 3, seed=1, outside=0.1, windows=2), TUBE, "vehicle")
    nested = quantile_sets(draw(300, 3, seed=2), rules=40)
    last = last_passed(nested, units)
    for number in range(100):
        asks = units.demands.unit == number
        passes = [bool((units.demands.score[asks] >= values[units.demands.base[asks]]).all()) for values in nested]
        assert passes == [rule <= last[number] for rule in range(len(passes))]


def test_quantile_sets_passes_through_the_lowest_training_score() -> None:
    scores = np.array([[0.4, 0.0, 0.3], [0.8, 0.0, 0.3], [0.5, 0.9, 0.3]])
    training = ScoredSamples(scores, np.array([0, 0, 1]), np.zeros(3), np.arange(3))
    nested = quantile_sets(training, rules=10)
    assert nested.shape == (10, 3)
    assert nested[0].tolist() == [0, 0, 0]
    assert nested[4] == pytest.approx([0.32, 0.72, 0])
    assert nested[-1] == pytest.approx([0.8, 0.9, 0])  # base 2 never occurred: always possible


@given(st.integers(0, 10_000), st.sampled_from(["window", "vehicle", "share"]), st.floats(0.05, 0.4))
def test_testing_one_rule_after_the_other_gives_the_same(seed: int, unit: Unit, epsilon: float) -> None:
    random = np.random.default_rng(seed)
    samples = ScoredSamples(
        random.random((300, 2)), random.integers(0, 2, 300), np.zeros(300), random.integers(0, 120, 300)
    )
    nested = np.sort(np.r_[np.zeros((1, 2)), random.random((30, 2))], axis=0)
    tested = learn_then_test(
        make_units(samples, TUBE, unit), Claim(epsilon, 0.9), [Thresholds.at(values, TUBE) for values in nested]
    )
    calibrated, _ = nested_sets(samples, TUBE, NOBODY, nested, None, epsilon, 0.9, unit, seed)
    assert tested is not None and np.array_equal(tested.values, calibrated.values)


def test_impossible_requests_are_refused(draw: Draw) -> None:
    with pytest.raises(CertificateError, match=r"1 of 3 calibration windows leave the tube .* only 0 may be missed"):
        nested_sets(three_windows(0.9), TUBE, NOBODY, ladder(), discarded=0)
    with pytest.raises(CertificateError, match=r"cannot prove ε = 0.01; the smallest ε possible with them is 0.045"):
        nested_sets(draw(100, 2, seed=0), TUBE, NOBODY, ladder(), epsilon=0.01)
    with pytest.raises(CertificateError, match="also trained the network"):
        nested_sets(three_windows(), TUBE, np.array([5]), ladder(), discarded=0)


@pytest.mark.slow
def test_violation_probability_follows_its_law(draw: Draw) -> None:
    """With fine steps, Beta(r + 1, N − r), whatever the shape; the law of one discard more or less is rejected."""
    count, discarded, outside, repeats = 200, 12, 0.01, 1200
    steps = np.linspace(0, 1, 20_001)
    nested = np.stack([steps**2, steps, np.sqrt(steps)], axis=1)
    violation = np.empty(repeats)
    for repeat in range(repeats):
        rule, _ = nested_sets(draw(count, 3, repeat, outside), TUBE, NOBODY, nested, discarded)
        violation[repeat] = outside + (1 - outside) * rule.values.mean()
    assert stats.kstest(violation, stats.beta(discarded + 1, count - discarded).cdf).pvalue > 0.001
    assert stats.kstest(violation, stats.beta(discarded + 2, count - discarded - 1).cdf).pvalue < 0.001
    assert stats.kstest(violation, stats.beta(discarded, count - discarded + 1).cdf).pvalue < 0.001


@pytest.mark.slow
def test_bound_holds_and_a_shape_taken_from_the_calibration_samples_breaks_it(draw: Draw) -> None:
    """Quantiles of the calibration samples themselves cut more of the bases by chance than one parameter may."""
    repeats, epsilon, count, bases = 1000, 0.1, 120, 20
    limit = stats.binom.ppf(0.999, repeats, 0.1)
    honest = dishonest = 0
    for repeat in range(repeats):
        samples, training = draw(count, bases, repeat), draw(600, bases, 10_000 + repeat, first=1000)
        rule, certificate = nested_sets(samples, TUBE, NOBODY, quantile_sets(training), epsilon=epsilon, confidence=0.9)
        honest += rule.values.mean() > epsilon
        assert certificate.epsilon == rate_limit(0.9, misses_allowed(epsilon, 0.9, count), count)
        own, _ = nested_sets(samples, TUBE, NOBODY, quantile_sets(samples), epsilon=epsilon, confidence=0.9)
        dishonest += own.values.mean() > epsilon
    assert honest <= limit
    assert dishonest > limit
