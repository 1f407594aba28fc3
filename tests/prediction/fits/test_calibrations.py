"""All methods side by side where only two groups of scenes are left: what calibrates must not test itself."""

from types import SimpleNamespace

import numpy as np
import pytest

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.evaluation import evaluate
from coverdrive.certificates.methods import Method
from coverdrive.prediction.certifying.calibrate import CertificateSettings, calibrate, held_back
from coverdrive.prediction.certifying.scored import ScoredSides
from coverdrive.prediction.fits.calibrations import certify

TUBE = 0.5


def drawn(vehicles: int, seed: int, first: int) -> ScoredSamples:
    """Windows of vehicles whose driven base, of four, scores higher than the others."""
    random = np.random.default_rng(seed)
    base = random.integers(0, 4, vehicles)
    scores = random.beta(1, 4, (vehicles, 4))
    scores[np.arange(vehicles), base] = random.beta(4, 1, vehicles)
    return ScoredSamples(scores, base, np.zeros(vehicles), first + np.arange(vehicles), scores)


@pytest.fixture(scope="module")
def sides() -> ScoredSides:
    """Of a fit of two groups, by the default method: one trains, and the other calibrates and tests."""
    training, samples, settings = drawn(400, 0, 0), drawn(1000, 1, 1000), CertificateSettings(unit="window")
    rule, _ = calibrate(TUBE, training, samples, settings)
    return ScoredSides(training, samples, held_back(rule, TUBE, training, samples, settings, 0), "fit")


def test_every_method_is_tested_on_vehicles_that_did_not_calibrate_it(sides: ScoredSides) -> None:
    predictor = SimpleNamespace(tube=TUBE, trained_on=sides.train.vehicle)
    settings = SimpleNamespace(certificate=CertificateSettings(unit="window"))
    fitted = SimpleNamespace(predictor=predictor, scored=sides, settings=settings, seed=0)
    compared = certify(fitted, [0.1])
    new = drawn(20_000, 2, 100_000)
    for each in compared:
        if each.method is Method.SVM:
            assert each.certificate is None and "hyperplanes do not allow" in each.refusal
        elif each.certificate is not None:
            asked = CertificateSettings(method=each.method, epsilon=each.target or "auto", unit="window")
            rule, _ = calibrate(TUBE, sides.train, sides.calibration, asked)
            assert each.missed is not None
            assert each.missed.low <= evaluate(rule, new).windows.value <= each.missed.high, each.method
    post_bloating = next(each for each in compared if each.method is Method.POST_BLOATING)
    rule, _ = calibrate(TUBE, sides.train, sides.calibration, asked.model_copy(update={"method": Method.POST_BLOATING}))
    assert evaluate(rule, sides.calibration).windows.value == 0  # as it must, on what calibrated it
    assert post_bloating.missed is not None and post_bloating.missed.value > 0


def test_what_calibrates_and_what_tests_can_be_taken_apart(sides: ScoredSides) -> None:
    calibration, test = sides.apart(0)
    assert len(calibration) == len(test) == 500
    assert np.array_equal(np.union1d(calibration.vehicle, test.vehicle), sides.calibration.vehicle)
    rows = np.searchsorted(sides.calibration.vehicle, test.vehicle)
    assert np.array_equal(test.scores, sides.calibration.scores[rows])  # not those that were moved
    apart = ScoredSides(sides.train, calibration, test, "fit")
    assert apart.apart(0) == (calibration, test)
