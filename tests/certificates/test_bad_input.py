"""What no guarantee could rest on is refused by every method, with what was got and what to try."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from certificates_fakes import Task, certify

from coverdrive.certificates.bounds import judged_bound
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.evaluation import evaluate
from coverdrive.certificates.methods import Method
from coverdrive.errors import CertificateError

TUBE = 0.5
Draw = Callable[..., ScoredSamples]


@pytest.fixture
def task(draw: Draw) -> Task:
    training = draw(300, 3, seed=2, first=5000)
    return Task(draw(600, 3, seed=1, outside=0.005), TUBE, training.vehicle, 0.1, training=training)


def asked(task: Task, method: Method) -> Task:
    return replace(task, epsilon=None) if method.computes_epsilon else task


@pytest.mark.parametrize("base", [-1, 3])
def test_labels_without_a_base(task: Task, base: int) -> None:
    labels = task.samples.base.copy()
    labels[5] = base
    with pytest.raises(CertificateError, match="every sample needs one of the 3 bases as its label"):
        replace(task.samples, base=labels)


@pytest.mark.parametrize("distance", [-0.1, np.nan, np.inf])
def test_distances_that_are_none(task: Task, distance: float) -> None:
    distances = task.samples.distance.copy()
    distances[5] = distance
    with pytest.raises(CertificateError, match="must be finite and not negative"):
        replace(task.samples, distance=distances)


def test_no_samples(task: Task) -> None:
    with pytest.raises(CertificateError, match="no samples to calibrate on or to test; give more recordings"):
        task.samples.of(np.zeros(0, dtype=np.int64))


@pytest.mark.parametrize("confidence", [0.0, 1.0, -0.5, np.nan])
@pytest.mark.parametrize("method", Method)
def test_confidence_outside_the_unit_interval(task: Task, method: Method, confidence: float) -> None:
    with pytest.raises(CertificateError, match="strictly between 0 and 1"):
        certify(method, replace(asked(task, method), confidence=confidence))


@pytest.mark.parametrize("epsilon", [0.0, 1.0, -0.1, np.nan])
@pytest.mark.parametrize("method", [method for method in Method if not method.computes_epsilon])
def test_epsilon_outside_the_unit_interval(task: Task, method: Method, epsilon: float) -> None:
    with pytest.raises(CertificateError, match="must lie between 0 and 1"):
        certify(method, replace(task, epsilon=epsilon))


@pytest.mark.parametrize("method", Method)
def test_a_base_without_calibration_samples_is_never_missed(task: Task, draw: Draw, method: Method) -> None:
    """Base 2 occurs neither in training nor in calibration; whoever drives it later is predicted."""

    def without(samples: ScoredSamples) -> ScoredSamples:
        return replace(samples, base=np.minimum(samples.base, 1))

    assert task.training is not None
    task = replace(asked(task, method), samples=without(task.samples), training=without(task.training))
    rule, certificate = certify(method, task)
    new = draw(500, 3, seed=4, first=9000)
    driving = evaluate(rule, replace(new, base=np.full(500, 2)))
    if method in (Method.POOLED, Method.PAC_POOLED):
        assert driving.not_predicted > 0 or certificate.unseen_bases > 0  # one threshold stands for several bases
    else:
        assert certificate.unseen_bases == 1
        assert driving.not_predicted == 0


def test_judged_bound_checks_its_confidence() -> None:
    with pytest.raises(CertificateError, match="strictly between 0 and 1"):
        judged_bound(1.0, 3, 10)
