"""Post-bloating: hand-computed thresholds, the exact law of its violation probability, and refusals."""

import numpy as np
import pytest
from certificates_fakes import post_bloat
from scipy import stats

from coverdrive.certificates.bounds import rate_limit, violation_bound
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.evaluation import evaluate
from coverdrive.errors import CertificateError

TUBE = 0.5
NOBODY = np.array([], dtype=np.int64)


def scored(scores: list[list[float]], base: list[int], distance: list[float], vehicle: list[int]) -> ScoredSamples:
    return ScoredSamples(np.array(scores), np.array(base), np.array(distance), np.array(vehicle))


def drawn(count: int, bases: int, seed: int, first_vehicle: int = 0) -> ScoredSamples:
    """Samples whose base is uniform, whose score of it is uniform, and whose path never leaves the tube."""
    random = np.random.default_rng(seed)
    return ScoredSamples(
        random.random((count, bases)),
        random.integers(0, bases, count),
        np.zeros(count),
        first_vehicle + np.arange(count),
    )


def test_thresholds_by_hand() -> None:
    rows = np.arange(12) % 3
    samples = scored([[0.9, 0.1], [0.6, 0.3], [0.2, 0.7]], [0, 0, 1], [0.1, 0.4, 0.2], [1, 1, 2]).of(rows)
    rule, certificate = post_bloat(samples, TUBE, NOBODY, confidence=0.5, unit="window")
    assert rule.values == pytest.approx([0.6, 0.7], abs=2e-6)
    assert rule.tube.tolist() == [0.5, 0.5]
    assert (certificate.samples, certificate.bases, certificate.unseen_bases, certificate.uncovered) == (12, 2, 0, 0)
    assert certificate.prediction_epsilon == violation_bound(0.5, 2, 12)
    assert certificate.epsilon == violation_bound(0.75, 2, 12) + rate_limit(0.75, 0, 12)


def test_no_calibration_sample_is_missed() -> None:
    samples = drawn(500, 7, seed=3)
    rule, _ = post_bloat(samples, TUBE, NOBODY)
    assert evaluate(rule, samples).windows.count == 0


def test_base_without_samples_is_always_possible() -> None:
    samples = scored([[0.9, 0.0]] * 4, [0] * 4, [0.0] * 4, [1, 2, 3, 4])
    rule, certificate = post_bloat(samples, TUBE, NOBODY, confidence=0.5, unit="window")
    assert certificate.unseen_bases == 1
    assert rule.possible(np.zeros((1, 2))).tolist() == [[False, True]]


def test_vehicle_unit_counts_vehicles() -> None:
    samples = drawn(400, 3, seed=0)
    paired = ScoredSamples(samples.scores, samples.base, samples.distance, samples.vehicle // 2)
    windows, by_window = post_bloat(paired, TUBE, NOBODY, unit="window")
    vehicles, by_vehicle = post_bloat(paired, TUBE, NOBODY, unit="vehicle")
    assert np.array_equal(windows.values, vehicles.values)
    assert (by_window.samples, by_vehicle.samples) == (400, 200)
    assert by_vehicle.prediction_epsilon == violation_bound(0.99, 3, 200)
    assert "200 calibration vehicles" in by_vehicle.sentence


def test_uncovered_samples_are_misses_and_no_constraints() -> None:
    scores = [[0.5], [0.6], [0.7], [0.1], [0.8], [0.8]]
    calibration = scored(scores, [0] * 6, [0.1, 0.2, 0.3, 0.9, 0.0, 0.0], [1, 2, 3, 3, 4, 5])
    rule, windows = post_bloat(calibration, TUBE, NOBODY, confidence=0.5)
    assert rule.values == pytest.approx([0.5], abs=2e-6)
    assert (windows.uncovered, windows.samples) == (1, 6)
    assert windows.epsilon == rate_limit(0.75, 1, 6) + violation_bound(0.75, 1, 6)
    _, vehicles = post_bloat(calibration, TUBE, NOBODY, confidence=0.5, unit="vehicle")
    assert (vehicles.uncovered, vehicles.samples) == (1, 5)
    new = scored([[0.5], [0.5], [0.4]], [0] * 3, [0.49, 0.51, 0.0], [5, 6, 7])
    evaluation = evaluate(rule, new)
    assert (evaluation.windows.count, evaluation.outside_tube, evaluation.not_predicted) == (2, 1, 1)


def test_training_vehicles_are_refused() -> None:
    samples = drawn(100, 2, seed=1)
    with pytest.raises(CertificateError, match="1 of 100 calibration vehicles also trained"):
        post_bloat(samples, TUBE, np.array([42]))


@pytest.mark.parametrize("bad", [-0.1, 1.1, np.nan])
def test_bad_scores_are_refused(bad: float) -> None:
    with pytest.raises(CertificateError, match=r"scores must be numbers in \[0, 1\]"):
        scored([[0.5, bad]], [0], [0.0], [1])


@pytest.mark.slow
def test_violation_probability_follows_its_law() -> None:
    """With continuous scores and every base calibrated, the miss probability is Beta(M, N − M + 1)."""
    bases, count, repeats = 5, 300, 1500
    violation = np.empty(repeats)
    for repeat in range(repeats):
        rule, _ = post_bloat(drawn(count, bases, seed=repeat), TUBE, NOBODY)
        violation[repeat] = rule.values.mean()  # P(score < c_j), averaged over equally likely bases
    assert stats.kstest(violation, stats.beta(bases, count - bases + 1).cdf).pvalue > 0.001
    # Negative control: the law of one constraint fewer is rejected.
    assert stats.kstest(violation, stats.beta(bases - 1, count - bases + 2).cdf).pvalue < 0.001


@pytest.mark.slow
def test_bound_holds_on_new_samples_and_fails_without_calibration() -> None:
    """At 90 % confidence the bound may be broken in at most a tenth of the calibrations."""
    broken = broken_by_optimist = 0
    for repeat in range(400):
        calibration = drawn(200, 4, seed=repeat)
        rule, certificate = post_bloat(calibration, TUBE, NOBODY, confidence=0.9)
        new = drawn(20_000, 4, seed=10_000 + repeat, first_vehicle=1000)
        broken += evaluate(rule, new).windows.value > certificate.epsilon
        optimist, _ = post_bloat(
            ScoredSamples(
                1 - (1 - calibration.scores) / 2, calibration.base, calibration.distance, calibration.vehicle
            ),
            TUBE,
            NOBODY,
        )
        broken_by_optimist += evaluate(optimist, new).windows.value > certificate.epsilon
    assert broken <= 400 * 0.1
    assert broken_by_optimist > 400 * 0.9
