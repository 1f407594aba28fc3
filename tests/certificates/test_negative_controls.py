"""What a certificate rests on is needed: without it, calibrations claim more than holds, far too often."""

import numpy as np
import pytest

from coverdrive.certificates.calibration import Calibration, Claim, ScoredSamples
from coverdrive.certificates.evaluation import evaluate
from coverdrive.certificates.methods import Method, certify
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError

NOBODY = np.array([], dtype=np.int64)
CLAIM = Claim(0.2, 0.9)
METHODS = (Method.PAC_POOLED, Method.NESTED_SETS)


def samples_of(scores: np.ndarray, vehicle: np.ndarray) -> ScoredSamples:
    zero = np.zeros(len(scores), dtype=np.int64)
    return ScoredSamples(scores[:, None], zero, 0.0 * zero, vehicle)


def value(method: Method, samples: ScoredSamples, seed: int) -> float:
    training = samples_of(np.random.default_rng([1, seed]).random(500), 10_000 + np.arange(500))
    rule, _ = certify(method, Calibration.of(samples, 1.0, NOBODY, "vehicle", training=training), CLAIM)
    assert isinstance(rule, Thresholds)
    return float(rule.values[0])


@pytest.mark.parametrize("method", [Method.PAC_POOLED, pytest.param(Method.NESTED_SETS, marks=pytest.mark.slow)])
def test_copies_of_a_vehicle_prove_nothing_more(method: Method) -> None:
    """60 vehicles, each in three scenes: with one key each they are 60, with a key for each scene they seem 180.

    A threshold on a uniform score misses a new vehicle with the probability of its value.
    """
    exceeding = {"one key": 0, "copies": 0}
    for seed in range(1000):
        scores, vehicle = np.tile(np.random.default_rng(seed).random(60), 3), np.arange(180)
        exceeding["one key"] += value(method, samples_of(scores, vehicle % 60), seed) > 0.2
        exceeding["copies"] += value(method, samples_of(scores, vehicle), seed) > 0.2
    assert exceeding["one key"] <= 130
    assert exceeding["copies"] > 200


@pytest.mark.parametrize("method", METHODS)
def test_vehicles_that_trained_prove_nothing(method: Method) -> None:
    """A learner that votes by near training vehicles knows what these did, and nothing of new ones."""
    random = np.random.default_rng(0)
    place, base = random.random((2200, 2)), random.integers(0, 2, 2200)
    near = np.exp(-np.linalg.norm(place[:, None] - place[:100], axis=-1) / 0.02)
    scores = (near @ np.eye(2)[base[:100]]) / near.sum(1, keepdims=True)
    everyone = ScoredSamples(scores.clip(0, 1), base, np.zeros(2200), np.arange(2200))
    shaping, calibrating, new = (everyone.of(np.arange(*ends)) for ends in ((100, 150), (150, 250), (250, 2200)))

    def missed(samples: ScoredSamples) -> float:
        rule, _ = certify(method, Calibration.of(samples, 1.0, NOBODY, "vehicle", training=shaping), Claim(0.2, 0.99))
        return evaluate(rule, new).vehicles.value

    trained = everyone.of(np.arange(100))
    assert missed(calibrating) < 0.2
    assert missed(trained) > 0.4
    with pytest.raises(CertificateError, match="100 of 100 calibration vehicles also trained the network"):
        Calibration.of(trained, 1.0, np.arange(100), "vehicle")
