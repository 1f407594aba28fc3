"""The exact tails against the paper's table (with its erratum), SciPy and a direct sum."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy import stats

from coverdrive.certificates.bounds import (
    binomial_tail,
    clopper_pearson,
    discarding_bound,
    discards_allowed,
    judged_bound,
    log_discarding_tail,
    violation_bound,
)
from coverdrive.errors import CertificateError

SIZES = (15946, 23919, 31893, 39866, 47839, 55813, 63786)
BASES = 17


def as_percent(values: list[float], digits: int) -> list[float]:
    return [round(100 * value, digits) for value in values]


def test_paper_table_1_at_99_percent() -> None:
    # The paper prints 0.19, 0.103, 0.077, 0.062, 0.052, 0.044, 0.039: only the first is the 99 % bound.
    bounds = [violation_bound(0.99, BASES + 2, size) for size in SIZES]
    assert as_percent(bounds, 4) == [0.1917, 0.1278, 0.0959, 0.0767, 0.0639, 0.0548, 0.0479]


def test_paper_table_1_rows_2_to_7_are_the_90_percent_bound() -> None:
    bounds = [violation_bound(0.90, BASES + 2, size) for size in SIZES[1:]]
    printed = [0.103, 0.077, 0.062, 0.052, 0.044, 0.039]
    assert as_percent(bounds, 3) == pytest.approx(printed, abs=0.0011)


def test_tight_bound_with_one_constraint_per_threshold() -> None:
    bounds = [violation_bound(0.99, BASES, size) for size in SIZES]
    assert as_percent(bounds, 4) == [0.1757, 0.1172, 0.0879, 0.0703, 0.0586, 0.0502, 0.0439]


def test_one_parameter_family() -> None:
    assert round(100 * violation_bound(0.99, 1, SIZES[0]), 4) == 0.0289
    assert violation_bound(0.99, 1, 100) == pytest.approx(1 - 0.01 ** (1 / 100))


@given(st.floats(0, 1), st.integers(0, 12), st.integers(1, 12))
def test_tail_is_the_sum_of_the_paper(epsilon: float, successes: int, samples: int) -> None:
    direct = sum(
        math.comb(samples, j) * epsilon**j * (1 - epsilon) ** (samples - j) for j in range(min(successes, samples) + 1)
    )
    assert binomial_tail(epsilon, successes, samples) == pytest.approx(direct, abs=1e-12)


@given(st.floats(0.01, 0.999), st.integers(1, 40), st.integers(0, 3000))
def test_bound_inverts_the_tail(confidence: float, support: int, more: int) -> None:
    samples = support + more
    epsilon = violation_bound(confidence, support, samples)
    assert binomial_tail(epsilon, support - 1, samples) == pytest.approx(1 - confidence, abs=1e-9)
    assert epsilon == pytest.approx(stats.beta.ppf(confidence, support, samples - support + 1), rel=1e-9)


@given(st.floats(0.01, 0.9), st.integers(1, 5), st.integers(0, 8), st.integers(14, 60))
def test_discarding_tail_is_the_product_of_its_factors(
    epsilon: float, support: int, discarded: int, samples: int
) -> None:
    most = support + discarded - 1
    direct = math.comb(most, discarded) * binomial_tail(epsilon, most, samples)
    assert math.exp(log_discarding_tail(epsilon, support, discarded, samples)) == pytest.approx(direct, rel=1e-9)


def test_discarding_tail_where_its_factors_overflow() -> None:
    # C(2016, 2000) and the tail of 50 standard deviations; their logarithms by exact integers
    epsilon, support, discarded, samples = 0.5, 17, 2000, 16000
    total = sum(math.comb(samples, j) for j in range(support + discarded))
    exact = math.log(math.comb(support + discarded - 1, discarded)) + _log(total) - samples * math.log(2)
    assert exact < -4000
    assert log_discarding_tail(epsilon, support, discarded, samples) == pytest.approx(exact, rel=1e-9)


def _log(number: int) -> float:
    shift = max(number.bit_length() - 900, 0)
    return math.log(number >> shift) + shift * math.log(2)


@given(st.floats(0.5, 0.999), st.integers(1, 20), st.integers(0, 30), st.integers(50, 2000))
@example(0.5, 19, 30, 50)  # close to 1, where the tail is steep
def test_discarding_bound_inverts_its_tail(confidence: float, support: int, discarded: int, samples: int) -> None:
    bound = discarding_bound(confidence, support, discarded, samples)
    if bound < 1:
        tail = log_discarding_tail(bound, support, discarded, samples)
        assert tail == pytest.approx(math.log1p(-confidence), abs=1e-5)
    assert discarding_bound(confidence, support, 0, samples) == violation_bound(confidence, support, samples)


@given(st.floats(0.001, 0.5), st.integers(1, 20), st.integers(10, 2000))
def test_greatest_number_of_discards(epsilon: float, support: int, samples: int) -> None:
    allowed = discards_allowed(epsilon, 0.99, support, samples)
    goal = math.log1p(-0.99)
    if allowed >= 0:
        assert log_discarding_tail(epsilon, support, allowed, samples) <= goal
    assert log_discarding_tail(epsilon, support, allowed + 1, samples) > goal


def test_judged_bound_solves_its_equation() -> None:
    """The equation of Campi and Garatti in exact rational arithmetic changes its sign at the solution."""
    for samples, support in ((10, 0), (30, 4), (200, 17), (200, 199)):
        epsilon = judged_bound(0.99, support, samples)

        def excess(t: Fraction, samples: int = samples, support: int = support) -> Fraction:
            left = sum(math.comb(m, support) * t ** (m - support) for m in range(support, samples + 1))
            return left / 100 / (samples + 1) - math.comb(samples, support) * t ** (samples - support)

        assert excess(1 - Fraction(epsilon * (1 - 1e-9))) < 0 < excess(1 - Fraction(epsilon + (1 - epsilon) * 1e-9))
    assert judged_bound(0.99, 30, 30) == 1


@given(st.floats(0.5, 0.9999), st.integers(1, 60), st.integers(1, 300))
def test_judged_bound_costs_more_than_a_dimension_known_beforehand(confidence: float, support: int, more: int) -> None:
    """If every draw has exactly k support samples, the bound for a fixed k is exact, and ε(k) may not be less."""
    bound = judged_bound(confidence, support, support + more)
    assert binomial_tail(bound, support - 1, support + more) <= (1 - confidence) * (1 + 1e-9)
    assert judged_bound(confidence, support - 1, support + more) < bound


@pytest.mark.slow
def test_judged_bound_holds_where_the_number_of_support_samples_varies() -> None:
    """The largest value of each of 8 coordinates, where some samples are large in all and others in one of them."""
    random = np.random.default_rng(0)
    repeats, count, dimension, share = 20_000, 60, 8, 0.5
    broken = broken_with_fewer = 0
    supports = set()
    bounds = [judged_bound(0.9, support, count) for support in range(dimension + 1)]
    for _ in range(repeats):
        value = random.random((count, 1)) * np.where(
            random.random((count, 1)) < share, 1, np.eye(dimension)[random.integers(0, dimension, count)]
        )
        support = len(np.unique(value.argmax(0)[value.max(0) > 0]))
        missed = share * (1 - value.max(0).min()) + (1 - share) * (1 - value.max(0)).mean()
        supports.add(support)
        broken += missed > bounds[support]
        broken_with_fewer += missed > bounds[max(support - 4, 0)]
    assert len(supports) > 4
    assert broken <= stats.binom.ppf(0.999, repeats, 0.1)
    assert broken_with_fewer > stats.binom.ppf(0.999, repeats, 0.1)


@pytest.mark.parametrize(("confidence", "samples"), [(1 - 1e-9, 1000), (1 - 1e-6, 100_000), (0.995, 3_000_000)])
def test_judged_bound_of_nearly_all_samples(confidence: float, samples: int) -> None:
    assert judged_bound(confidence, samples - 1, samples) > 0.999


def test_intervals_of_the_papers_collisions() -> None:
    assert as_percent(list(clopper_pearson(7, 1000)), 2) == [0.28, 1.44]
    assert as_percent(list(clopper_pearson(20, 1000)), 2) == [1.23, 3.07]


@given(st.integers(0, 200), st.integers(0, 200), st.floats(0.5, 0.999))
def test_interval_agrees_with_scipy(successes: int, failures: int, confidence: float) -> None:
    trials = successes + failures
    if trials == 0:
        assert clopper_pearson(0, 0, confidence) == (0, 1)
        return
    expected = stats.binomtest(successes, trials).proportion_ci(confidence, method="exact")
    assert clopper_pearson(successes, trials, confidence) == pytest.approx((expected.low, expected.high), abs=1e-9)


@pytest.mark.parametrize("confidence", [0.0, 1.0, -0.1, 1.5, math.nan])
def test_confidence_outside_the_unit_interval_is_refused(confidence: float) -> None:
    with pytest.raises(CertificateError, match="strictly between 0 and 1"):
        violation_bound(confidence, 1, 10)
    with pytest.raises(CertificateError, match="strictly between 0 and 1"):
        clopper_pearson(1, 10, confidence)


def test_too_few_samples_are_refused() -> None:
    with pytest.raises(CertificateError, match="10 calibration samples cannot support a bound with 11"):
        violation_bound(0.99, 11, 10)
