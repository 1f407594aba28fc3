"""Learn then test: by hand, equal to the nested where rules are nested, and its error probability by experiment."""

from collections.abc import Callable

import numpy as np
import pytest
from certificates_fakes import learn_then_test, nested_sets
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Unit
from coverdrive.certificates.learn_then_test import rules_of
from coverdrive.certificates.nested_sets import NestedSets
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError

TUBE = 0.5
NOBODY = np.array([], dtype=np.int64)
Draw = Callable[..., ScoredSamples]
UNITS: list[Unit] = ["window", "vehicle", "share"]


def at(*values: float) -> list[Thresholds]:
    return [Thresholds(np.array([value]), np.array([TUBE])) for value in values]


def one_base(scores: list[float]) -> ScoredSamples:
    count = len(scores)
    return ScoredSamples(np.array(scores)[:, None], np.zeros(count, int), np.zeros(count), np.arange(count))


def test_testing_stops_at_the_first_rule_that_fails() -> None:
    samples = one_base([0.1] * 5 + [0.9] * 95)  # Φ(0.1, 0, 100) = 3e-5, Φ(0.1, 5, 100) = 0.058
    rule, certificate = learn_then_test(samples, TUBE, NOBODY, at(0.0, 0.05, 0.5, 0.01), epsilon=0.1, confidence=0.95)
    assert rule.values.tolist() == [0.05]
    assert (certificate.epsilon, certificate.discarded) == (0.1, 0)
    rule, certificate = learn_then_test(samples, TUBE, NOBODY, at(0.0, 0.5, 0.95), epsilon=0.1, confidence=0.94)
    assert rule.values.tolist() == [0.5]
    assert certificate.discarded == 5


def test_a_first_rule_that_fails_is_refused() -> None:
    with pytest.raises(CertificateError, match=r"5 misses of the first rule in 100 .* smallest ε possible .* 0.1"):
        learn_then_test(one_base([0.1] * 5 + [0.9] * 95), TUBE, NOBODY, at(0.5), epsilon=0.05)


@given(st.integers(0, 10_000), st.sampled_from(UNITS), st.floats(0.05, 0.4))
def test_nested_rules_give_the_familys_result(seed: int, unit: Unit, epsilon: float) -> None:
    random = np.random.default_rng(seed)
    samples = ScoredSamples(
        random.random((300, 2)), random.integers(0, 2, 300), np.zeros(300), random.integers(0, 120, 300)
    )
    nested = NestedSets(np.sort(np.r_[np.zeros((1, 2)), random.random((30, 2))], axis=0))
    tested, _ = learn_then_test(samples, TUBE, NOBODY, rules_of(nested, TUBE), epsilon, 0.9, unit, seed)
    calibrated, _ = nested_sets(samples, TUBE, NOBODY, nested, None, epsilon, 0.9, unit, seed)
    assert np.array_equal(tested.values, calibrated.values)


def test_repeated_rules_are_tested_once() -> None:
    nested = NestedSets(np.array([[0.0], [0.0], [0.3], [0.3], [0.5]]))
    assert [rule.values[0] for rule in rules_of(nested, TUBE)] == pytest.approx([0, 0.3, 0.5], abs=2e-6)


@pytest.mark.slow
def test_error_probability_in_a_fixed_sequence_and_in_a_chosen_one(draw: Draw) -> None:
    """Trying many unrelated rules and keeping the best that passes is no fixed sequence, and breaks the bound."""
    repeats, epsilon, fixed, chosen = 1000, 0.1, 0, 0
    corners = np.random.default_rng(1).dirichlet(np.ones(10), 40)  # rules with miss probability 0.11, each its own way
    rules = [Thresholds(corner * 1.1, np.full(10, TUBE)) for corner in corners]
    nested = rules_of(NestedSets(np.repeat(np.linspace(0, 1, 101)[:, None], 10, axis=1)), TUBE)
    for repeat in range(repeats):
        samples = draw(200, 10, repeat)
        rule, _ = learn_then_test(samples, TUBE, NOBODY, nested, epsilon, 0.9)
        fixed += rule.values.mean() > epsilon
        missed = [(samples.score_of_base < rule.values[samples.base]).sum() for rule in rules]
        chosen += stats.binom.cdf(min(missed), 200, epsilon) <= 0.1
    assert fixed <= stats.binom.ppf(0.999, repeats, 0.1)
    assert chosen > stats.binom.ppf(0.999, repeats, 0.1)
