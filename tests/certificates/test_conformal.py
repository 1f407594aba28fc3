"""Split conformal prediction: ranks by hand, other libraries' sets, the exact law of the violation, and refusals."""

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from certificates_fakes import conformal, make_units
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from scipy.spatial import KDTree

from coverdrive.certificates.bounds import binomial_tail, marginal_misses_allowed, misses_allowed
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.errors import CertificateError

TUBE = 0.5
NOBODY = np.array([], dtype=np.int64)
Draw = Callable[..., ScoredSamples]


def one_base(scores: list[float], distance: list[float] | None = None) -> ScoredSamples:
    count = len(scores)
    far = np.zeros(count) if distance is None else np.array(distance)
    return ScoredSamples(np.array(scores)[:, None], np.zeros(count, int), far, np.arange(count))


def broken_at_most(repeats: int, share: float) -> int:
    """Breaches that a claim with this error probability exceeds only once in a thousand experiments."""
    return int(stats.binom.ppf(0.999, repeats, share))


@given(st.integers(1, 999), st.integers(0, 300))
def test_marginal_rank_is_the_papers(permille: int, count: int) -> None:
    rank = math.ceil((count + 1) * (1 - Fraction(permille, 1000)))
    assert marginal_misses_allowed(permille / 1000, count) == count - rank


@given(st.floats(0.001, 0.999), st.floats(0.5, 0.999), st.integers(0, 300))
def test_pac_rank_is_the_greatest_that_proves(epsilon: float, confidence: float, count: int) -> None:
    proves = [k for k in range(count + 1) if binomial_tail(epsilon, k, count) <= 1 - confidence]
    assert misses_allowed(epsilon, confidence, count) == max(proves, default=-1)


def test_pooled_by_hand() -> None:
    scores = [0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1]  # residuals 0.1 … 0.9; rank ⌈10 · 0.7⌉ = 7, so d = 0.7
    rule, certificate = conformal(one_base(scores), TUBE, NOBODY, epsilon=0.3)
    assert rule.values == pytest.approx([0.3], abs=2e-6)
    assert (certificate.samples, certificate.discarded, certificate.confidence) == (9, 2, None)
    assert certificate.sentence.startswith("Over calibration and test together, the probability that a vehicle leaves")
    assert "without confidence" in certificate.sentence


def test_samples_outside_the_tube_have_infinite_residuals() -> None:
    scores = [0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1]
    outside = [1.0] + [0.0] * 8  # one of the two misses allowed is the uncovered sample
    rule, certificate = conformal(one_base(scores, outside), TUBE, NOBODY, epsilon=0.3)
    assert rule.values == pytest.approx([0.2], abs=2e-6)
    assert (certificate.uncovered, certificate.discarded) == (1, 1)
    with pytest.raises(CertificateError, match=r"3 of 9 calibration windows leave the tube .* ε = 0.3"):
        conformal(one_base(scores, [1.0] * 3 + [0.0] * 6), TUBE, NOBODY, epsilon=0.3)


def test_every_base_has_its_own_rank() -> None:
    scores = np.array([[0.9, 0.0], [0.5, 0.0], [0.4, 0.0], [0.0, 0.7]])
    samples = ScoredSamples(scores, np.array([0, 0, 0, 1]), np.zeros(4), np.arange(4))
    rule, certificate = conformal(samples, TUBE, NOBODY, epsilon=0.25, per_base=True)
    assert rule.values == pytest.approx([0.4, 0.0], abs=2e-6)  # base 1: rank ⌈2 · 0.75⌉ = 2 of one sample
    assert (certificate.unseen_bases, certificate.groups) == (1, 2)
    assert "not calibrated, because too few windows stay near them for this ε: 1." in certificate.sentence
    assert rule.possible(np.zeros((1, 2))).tolist() == [[False, True]]


def test_vehicles_count_with_their_worst_window() -> None:
    scores = np.array([[0.9], [0.2], [0.8], [0.7], [0.6]])
    samples = ScoredSamples(scores, np.zeros(5, int), np.zeros(5), np.array([1, 1, 2, 3, 3]))
    rule, certificate = conformal(samples, TUBE, NOBODY, epsilon=0.5, unit="vehicle")  # worst: 0.2, 0.8, 0.6
    assert rule.values == pytest.approx([0.6], abs=2e-6)
    assert certificate.samples == 3


def test_impossible_epsilon_names_the_smallest_possible() -> None:
    with pytest.raises(CertificateError, match=r"99 calibration windows .* smallest ε possible with them is 0.01,"):
        conformal(one_base([0.5] * 99), TUBE, NOBODY, epsilon=0.005)
    with pytest.raises(CertificateError, match=r"smallest ε possible with them is 0.0455,"):  # 1 − 0.01^(1/99)
        conformal(one_base([0.5] * 99), TUBE, NOBODY, epsilon=0.01, confidence=0.99)


@pytest.mark.parametrize("bad", [0.0, 1.0, -0.1, math.nan])
def test_epsilon_outside_the_unit_interval_is_refused(bad: float) -> None:
    with pytest.raises(CertificateError, match="must lie between 0 and 1"):
        conformal(one_base([0.5] * 9), TUBE, NOBODY, epsilon=bad)


def test_bases_share_the_allowed_error_probability() -> None:
    """44 units prove ε = 0.1 with 99 % (0.9⁴⁴ = 0.0097), but not with 99.5 %, which each of two bases needs."""

    def two_bases(count: int) -> ScoredSamples:
        base = np.repeat([0, 1], count)
        return ScoredSamples(np.full((2 * count, 2), 0.5), base, np.zeros(2 * count), np.arange(2 * count))

    conformal(one_base([0.5] * 44), TUBE, NOBODY, 0.1, 0.99)
    conformal(two_bases(51), TUBE, NOBODY, 0.1, 0.99, per_base=True)
    with pytest.raises(CertificateError, match="50 calibration windows cannot prove"):
        conformal(two_bases(50), TUBE, NOBODY, 0.1, 0.99, per_base=True)


@pytest.mark.parametrize("epsilon", [0.1, 0.03])
def test_sets_are_those_of_crepes(draw: Draw, epsilon: float) -> None:
    crepes = pytest.importorskip("crepes")
    calibration, new = draw(400, 3, seed=1), draw(300, 3, seed=2)
    residual = 1 - calibration.score_of_base
    rule, _ = conformal(calibration, TUBE, NOBODY, epsilon)
    theirs = crepes.ConformalClassifier().fit(residual)
    sets = theirs.predict_set(1 - new.scores, confidence=1 - epsilon, smoothing=False)
    assert np.array_equal(rule.possible(new.scores), sets == 1)
    rule, _ = conformal(calibration, TUBE, NOBODY, epsilon, per_base=True)
    theirs = crepes.ConformalClassifier().fit(residual, bins=calibration.base)
    for base in range(3):
        sets = theirs.predict_set(1 - new.scores, bins=np.full(300, base), confidence=1 - epsilon, smoothing=False)
        assert np.array_equal(rule.possible(new.scores)[:, base], sets[:, base] == 1)


@pytest.mark.parametrize("epsilon", [0.1, 0.03])
def test_sets_are_those_of_mapie(epsilon: float) -> None:
    classification, base = pytest.importorskip("mapie.classification"), pytest.importorskip("sklearn.base")

    class Given(base.ClassifierMixin, base.BaseEstimator):
        """Takes scores for features."""

        classes_ = np.arange(3)

        def fit(self, scores: np.ndarray, labels: np.ndarray) -> "Given":
            return self

        def predict_proba(self, scores: np.ndarray) -> np.ndarray:
            return scores

        def predict(self, scores: np.ndarray) -> np.ndarray:
            return scores.argmax(1)

        def __sklearn_is_fitted__(self) -> bool:
            return True

    random = np.random.default_rng(5)
    scores, labels, new = (
        random.dirichlet(np.ones(3), 400),
        random.integers(0, 3, 400),
        random.dirichlet(np.ones(3), 300),
    )
    theirs = classification.SplitConformalClassifier(
        Given(), confidence_level=1 - epsilon, conformity_score="lac", prefit=True
    ).conformalize(scores, labels)
    rule, _ = conformal(ScoredSamples(scores, labels, np.zeros(400), np.arange(400)), TUBE, NOBODY, epsilon)
    assert np.array_equal(rule.possible(new), theirs.predict_set(new)[1][:, :, 0])


@pytest.mark.slow
@pytest.mark.parametrize("confidence", [None, 0.9])
def test_violation_probability_follows_its_law(draw: Draw, confidence: float | None) -> None:
    """Beta(n + 1 − l, l), the tube's misses included; the laws of one rank more or less are rejected."""
    count, outside, epsilon, repeats = 200, 0.03, 0.15, 1500
    violation = np.empty(repeats)
    for repeat in range(repeats):
        rule, _ = conformal(draw(count, 2, repeat, outside), TUBE, NOBODY, epsilon, confidence)
        violation[repeat] = outside + (1 - outside) * rule.values.mean()
    misses = misses_allowed(epsilon, 0.9, count) if confidence else marginal_misses_allowed(epsilon, count)
    rank = count - misses
    assert stats.kstest(violation, stats.beta(count + 1 - rank, rank).cdf).pvalue > 0.001
    assert stats.kstest(violation, stats.beta(count + 2 - rank, rank - 1).cdf).pvalue < 0.001
    assert stats.kstest(violation, stats.beta(count - rank, rank + 1).cdf).pvalue < 0.001
    if confidence is None:
        assert violation.mean() < epsilon + 4 * violation.std() / math.sqrt(repeats)
        assert (violation > epsilon).mean() > 0.3  # a marginal guarantee is no guarantee with confidence
    else:
        assert (violation > epsilon).sum() <= broken_at_most(repeats, 0.1)


@pytest.mark.slow
def test_every_base_follows_its_own_law(draw: Draw) -> None:
    """Given its number of samples, the violation of every base is Beta distributed: its CDF is uniform."""
    uniform: list[float] = []
    shifted: list[float] = []
    all_hold = 0
    for repeat in range(1000):
        samples = draw(240, 3, repeat)
        rule, _ = conformal(samples, TUBE, NOBODY, 0.1, per_base=True)
        count = np.bincount(samples.base, minlength=3)[repeat % 3]
        misses = marginal_misses_allowed(0.1, int(count))
        uniform.append(stats.beta.cdf(rule.values[repeat % 3], misses + 1, count - misses))
        shifted.append(stats.beta.cdf(rule.values[repeat % 3], misses + 2, count - misses - 1))
        pac, _ = conformal(samples, TUBE, NOBODY, 0.1, confidence=0.9, per_base=True)
        all_hold += bool((pac.values <= 0.1).all())
    assert stats.kstest(uniform, "uniform").pvalue > 0.001
    assert stats.kstest(shifted, "uniform").pvalue < 0.001
    assert 1000 - all_hold <= broken_at_most(1000, 0.1)


@pytest.mark.slow
def test_calibrating_on_training_data_fails() -> None:
    """Scores are the shares of the labels among the three nearest training points; labels are pure chance."""
    held = failed = 0
    for repeat in range(1000):
        random = np.random.default_rng(repeat)
        place, label = random.random(500), random.integers(0, 3, 500)

        def scored(where: np.ndarray, base: np.ndarray, first: int, places=place, labels=label) -> ScoredSamples:
            nearest = KDTree(places[:, None]).query(where[:, None], 3)[1]
            scores = (labels[nearest][:, :, None] == np.arange(3)).mean(1)
            return ScoredSamples(scores, base, np.zeros(len(base)), first + np.arange(len(base)))

        new = make_units(scored(random.random(150), random.integers(0, 3, 150), 5000), TUBE, "window")
        fresh = scored(random.random(150), random.integers(0, 3, 150), 9000)
        trained = scored(place[:150], label[:150], 0)
        if repeat == 0:
            with pytest.raises(CertificateError, match="also trained the network"):
                conformal(trained, TUBE, np.arange(500), 0.1, 0.9)
        failed += new.missed(conformal(trained, TUBE, NOBODY, 0.1, 0.9)[0]).mean() > 0.1
        held += new.missed(conformal(fresh, TUBE, NOBODY, 0.1, 0.9)[0]).mean() <= 0.1
    assert held >= 900
    assert failed > 900


@pytest.mark.slow
def test_counting_windows_fails_where_they_depend(draw: Draw) -> None:
    """Twenty windows of a vehicle that are all alike are one sample, not twenty."""
    repeats, epsilon = 1000, 0.1
    broken = {"window": 0, "vehicle": 0, "share": 0}
    for repeat in range(repeats):
        samples = draw(60, 1, repeat, windows=20)
        for unit in broken:
            rule, _ = conformal(samples, TUBE, NOBODY, epsilon, 0.9, unit=unit, seed=repeat)
            broken[unit] += bool(rule.values[0] > epsilon)  # the probability that a new vehicle is missed
    assert broken["vehicle"] <= broken_at_most(repeats, 0.1)
    assert broken["share"] <= broken_at_most(repeats, 0.1)
    assert broken["window"] > 2 * broken_at_most(repeats, 0.1)
