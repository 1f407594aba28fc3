"""Vehicles that calibrate are tested by what the others calibrate: by hand, and unlike a test on what calibrated."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr

from coverdrive.certificates import evaluation
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.evaluation import evaluate
from coverdrive.certificates.methods import Method
from coverdrive.certificates.rule import Hyperplanes, Rule, Thresholds
from coverdrive.errors import CertificateError
from coverdrive.prediction.certifying.calibrate import CertificateSettings, calibrate, held_back


def drawn(seed: int, vehicles: int = 60, boxes: bool = True, first: int = 0) -> ScoredSamples:
    """Ten windows of each vehicle, which are alike: a vehicle is in its set for good or not at all."""
    random = np.random.default_rng(seed)
    score = ndtr(np.repeat(random.normal(size=vehicles), 10) + 0.2 * random.normal(size=10 * vehicles))
    zero = np.zeros(len(score), dtype=np.int64)
    vehicle = first + np.arange(len(score)) // 10
    return ScoredSamples(
        score[:, None], zero, 0.0 * zero, vehicle, None, vehicle // 20, np.ones(len(score)) if boxes else None
    )


def rule_of(samples: ScoredSamples, settings: CertificateSettings) -> Rule:
    return calibrate(1.0, drawn(99, first=9000), samples, settings, 0)[0]


SETTINGS = CertificateSettings(epsilon=0.3, confidence=0.9, unit="share")


@pytest.mark.parametrize("boxes", [True, False])
def test_what_is_missed_is_what_the_others_would_miss(boxes: bool) -> None:
    """With ten vehicles in ten parts, each is judged by the other nine."""
    samples = drawn(0, vehicles=10, boxes=boxes)
    settings = SETTINGS.model_copy(update={"epsilon": 0.6})
    rule = rule_of(samples, settings)
    moved = held_back(rule, 1.0, drawn(99, first=9000), samples, settings, seed=0)
    assert isinstance(rule, Thresholds)
    for vehicle in range(10):
        own = np.flatnonzero(samples.vehicle == vehicle)
        others = rule_of(samples.of(np.flatnonzero(samples.vehicle != vehicle)), settings)
        assert evaluate(rule, moved.of(own)).windows.count == evaluate(others, samples.of(own)).windows.count


def test_it_misses_more_than_what_calibrated_and_as_much_as_new_vehicles(monkeypatch: pytest.MonkeyPatch) -> None:
    """Post-bloating misses nothing of what calibrated it; new vehicles it does, with a chance of one in n + 1."""
    monkeypatch.setattr(evaluation, "clustered_interval", lambda *_: (0.0, 1.0))  # nobody looks at it
    settings = CertificateSettings(method=Method.POST_BLOATING, confidence=0.9, unit="vehicle")
    own, held, new = 0.0, 0.0, 0.0
    for seed in range(40):
        samples, others = drawn(seed), drawn(1000 + seed, first=5000)
        rule = rule_of(samples, settings)
        moved = held_back(rule, 1.0, drawn(99, first=9000), samples, settings, seed)
        own, held, new = (
            total + evaluate(rule, each).vehicles.value / 40
            for total, each in ((own, samples), (held, moved), (new, others))
        )
    assert own == 0  # the negative control: a test on what calibrated
    assert abs(held - 1 / 55) < 0.01 and abs(new - 1 / 61) < 0.01


def test_a_claim_that_only_all_can_prove_is_eased_for_the_others() -> None:
    samples = replace(drawn(0), scores=np.full((600, 1), 0.5))
    barely = SETTINGS.model_copy(update={"epsilon": 0.04})  # of 60 vehicles without a miss, not of 54
    rule = rule_of(samples, barely)
    with pytest.raises(CertificateError, match="cannot prove"):
        rule_of(samples.of(np.arange(540)), barely)
    moved = held_back(rule, 1.0, drawn(99, first=9000), samples, barely, seed=0)
    assert evaluate(rule, moved).windows.count == 0


def test_hyperplanes_are_refused() -> None:
    rule = Hyperplanes(np.zeros((1, 2)), np.zeros(1), np.ones(1))
    with pytest.raises(CertificateError, match="hyperplanes do not allow"):
        held_back(rule, 1.0, drawn(99, first=9000), drawn(0), SETTINGS, seed=0)
