"""A tube for each base: by hand, what discarding and the nested make of it, and the bounds by experiment."""

import numpy as np
import pytest
from certificates_fakes import discard, make_units, nested_sets, post_bloat
from scipy import stats

from coverdrive.certificates.bounds import rate_limit, violation_bound
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.evaluation import evaluate
from coverdrive.certificates.learn_then_test import rules_of
from coverdrive.certificates.nested_sets import NestedSets, quantile_sets
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError

TUBE = 0.5
NOBODY = np.array([], dtype=np.int64)


def drawn(count: int, bases: int, seed: int, first: int = 0, outside: float = 0.0) -> ScoredSamples:
    """Uniform bases with independent uniform scores and distances up to the tube; a share leaves it."""
    random = np.random.default_rng(seed)
    distance = np.where(random.random(count) < outside, 1.0, random.uniform(0, TUBE, count))
    return ScoredSamples(
        random.random((count, bases)), random.integers(0, bases, count), distance, first + np.arange(count)
    )


def missed(rule: Thresholds, outside: float = 0.0) -> float:
    """Probability that the rule misses a new sample of `drawn`."""
    return float(outside + (1 - outside) * (1 - ((1 - rule.values) * rule.tube / TUBE).mean()))


def test_post_bloating_by_hand() -> None:
    scores = np.array([[0.9, 0.1, 0.5], [0.6, 0.3, 0.5], [0.2, 0.7, 0.5], [0.2, 0.8, 0.5]])
    rows = np.arange(40) % 4
    samples = ScoredSamples(scores[rows], rows // 2, np.array([0.1, 0.2, 0.3, 0.6])[rows], np.arange(40))
    rule, certificate = post_bloat(samples, TUBE, NOBODY, confidence=0.5, tubes="per base")
    assert rule.tube == pytest.approx([0.2, 0.3, 0.5], abs=2e-6)  # the last of four leaves the cover
    assert rule.values == pytest.approx([0.6, 0.7, 0.0], abs=2e-6)
    assert (certificate.tubes, certificate.uncovered, certificate.discarded) == ("per base", 10, 0)
    samples = drawn(400, 2, seed=1, outside=0.01)
    rule, certificate = post_bloat(samples, TUBE, NOBODY, tubes="per base")
    assert certificate.prediction_epsilon == violation_bound(0.99, 4, 400)
    assert certificate.epsilon == rate_limit(0.995, certificate.uncovered, 400) + violation_bound(0.995, 4, 400)
    assert evaluate(rule, samples).windows.count == certificate.uncovered
    assert (rule.tube <= TUBE).all()


def test_discarding_trades_an_outlier_for_a_smaller_tube() -> None:
    count = 40
    distance = np.full(count, 0.1)
    distance[7] = 0.5
    samples = ScoredSamples(np.full((count, 1), 0.6), np.zeros(count, int), distance, np.arange(count))
    rule, certificate = discard(samples, TUBE, NOBODY, discarded=1, confidence=0.5, tubes="per base")
    assert rule.tube == pytest.approx([0.1], abs=2e-6)
    assert rule.values == pytest.approx([0.6], abs=2e-6)
    assert certificate.discarded == 1
    rule, _ = discard(samples, TUBE, NOBODY, discarded=0, confidence=0.5, tubes="per base")
    assert rule.tube == pytest.approx([0.5])
    rule, certificate = discard(samples, TUBE, NOBODY, discarded=1, confidence=0.5)
    assert (rule.tube.tolist(), certificate.discarded, certificate.tubes) == ([0.5], 0, "cover")


@pytest.mark.parametrize("discarded", [0, 5, 20])
def test_what_discarding_leaves_is_tight_and_smaller_than_with_the_cover(discarded: int) -> None:
    samples = drawn(300, 3, seed=4)
    rule, certificate = discard(samples, TUBE, NOBODY, discarded=discarded, tubes="per base")
    assert certificate.discarded <= discarded
    kept = ~make_units(samples, TUBE, "window").missed(rule)
    for base in range(3):
        chosen = kept & (samples.base == base)
        assert rule.values[base] == pytest.approx(samples.score_of_base[chosen].min(), abs=2e-6)
        assert rule.tube[base] == pytest.approx(samples.distance[chosen].max(), abs=2e-6)
    cover, _ = discard(samples, TUBE, NOBODY, discarded=discarded)

    def size(rule: Thresholds) -> float:
        return float((rule.possible(samples.scores) @ rule.tube).sum())

    assert size(rule) <= size(cover)


def test_family_shapes_tubes_and_thresholds_together() -> None:
    training = ScoredSamples(
        np.c_[[0.4, 0.8, 0.5], [0.3, 0.3, 0.3]], np.zeros(3, int), np.array([0.1, 0.2, 0.4]), np.arange(3)
    )
    nested = quantile_sets(training, rules=10, tube=TUBE)
    assert nested.radii is not None
    assert nested.radii[0] == pytest.approx([0.5, 0.5])
    assert nested.radii[4] == pytest.approx([0.42, 0.5])
    assert nested.radii[-1] == pytest.approx([0.1, 0.5])  # base 1 never occurred: always possible, within the cover
    assert (np.diff(nested.radii, axis=0) <= 0).all()
    first = rules_of(nested, TUBE)[0]
    assert (first.values == 0).all() and (first.tube == TUBE).all()
    with pytest.raises(CertificateError, match="must not grow"):
        NestedSets(np.zeros((2, 1)), np.array([[0.1], [0.2]]))


def test_last_passed_looks_at_distances() -> None:
    training, samples = drawn(300, 3, seed=1, first=1000), drawn(80, 3, seed=2, outside=0.1)
    nested = quantile_sets(training, rules=40, tube=TUBE)
    units = make_units(samples, TUBE, "window")
    last = nested.last_passed(units)
    asks = np.argsort(units.demands.unit)
    for number in range(80):
        passes = [not units.missed(nested.rule(rule, TUBE))[number] for rule in range(40)]
        assert passes == [rule <= last[number] for rule in range(40)], asks[number]


@pytest.mark.slow
def test_bound_holds_and_that_of_half_as_many_variables_does_not() -> None:
    repeats, bases, count = 1500, 6, 300
    broken = broken_by_half = 0
    for repeat in range(repeats):
        rule, certificate = post_bloat(drawn(count, bases, repeat), TUBE, NOBODY, confidence=0.9, tubes="per base")
        assert certificate.prediction_epsilon == violation_bound(0.9, 2 * bases, count)
        broken += missed(rule) > certificate.prediction_epsilon
        broken_by_half += missed(rule) > violation_bound(0.9, bases, count)
    assert broken <= stats.binom.ppf(0.999, repeats, 0.1)
    assert broken_by_half > stats.binom.ppf(0.999, repeats, 0.1)


@pytest.mark.slow
def test_family_with_tubes_follows_its_law() -> None:
    """Beta(r + 1, N − r), whatever the shape; the law of one discard more or less is rejected."""
    count, discarded, outside, repeats = 200, 12, 0.01, 1200
    steps = np.linspace(0, 1, 20_001)[:, None]
    nested = NestedSets(
        np.hstack([steps**2, steps, np.sqrt(steps)]), TUBE * np.hstack([1 - steps, 1 - steps**3, 1 - steps])
    )
    violation = np.empty(repeats)
    for repeat in range(repeats):
        rule, _ = nested_sets(drawn(count, 3, repeat, outside=outside), TUBE, NOBODY, nested, discarded)
        violation[repeat] = missed(rule, outside)
    assert stats.kstest(violation, stats.beta(discarded + 1, count - discarded).cdf).pvalue > 0.001
    assert stats.kstest(violation, stats.beta(discarded + 2, count - discarded - 1).cdf).pvalue < 0.001
    assert stats.kstest(violation, stats.beta(discarded, count - discarded + 1).cdf).pvalue < 0.001


@pytest.mark.slow
def test_bound_of_discarding_with_tubes_holds() -> None:
    """The bound pays for the greedy choice; the plain order statistic of so many misses would not."""
    repeats, count, bases, discarded = 300, 200, 4, 8
    broken = broken_by_order = 0
    for repeat in range(repeats):
        rule, certificate = discard(drawn(count, bases, repeat), TUBE, NOBODY, discarded, None, 0.9, tubes="per base")
        broken += missed(rule) > certificate.epsilon
        broken_by_order += missed(rule) > rate_limit(0.9, discarded, count)
    assert broken <= stats.binom.ppf(0.999, repeats, 0.1)
    assert broken_by_order > stats.binom.ppf(0.999, repeats, 0.1)
