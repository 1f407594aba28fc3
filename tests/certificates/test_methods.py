"""Every method by its name: the same claim kept on the same samples, and what they refuse."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from certificates_fakes import Task, certify, conformal, post_bloat

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Unit
from coverdrive.certificates.evaluation import evaluate
from coverdrive.certificates.methods import Method
from coverdrive.errors import CertificateError

TUBE = 0.5
NOBODY = np.array([], dtype=np.int64)
Draw = Callable[..., ScoredSamples]
UNITS: list[Unit] = ["window", "vehicle"]


@pytest.fixture
def task(draw: Draw) -> Task:
    return Task(
        samples=draw(800, 4, seed=1, outside=0.005, windows=2),
        tube=TUBE,
        trained_on=np.arange(5000, 5600),
        epsilon=0.1,
        training=draw(600, 4, seed=2, first=5000),
    )


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("method", Method)
def test_every_method_keeps_its_claim(task: Task, draw: Draw, method: Method, unit: Unit) -> None:
    task = replace(task, unit=unit, epsilon=None if method.computes_epsilon else 0.1)
    rule, certificate = certify(method, task)
    assert (certificate.unit, certificate.samples) == (unit, 1600 if unit == "window" else 800)
    new = draw(20_000, 4, seed=3, outside=0.005, first=10_000)
    assert evaluate(rule, new).vehicles.value <= certificate.epsilon * (1 if certificate.confidence else 1.3)
    marginal = method in (Method.POOLED, Method.PER_BASE)
    assert (certificate.confidence is None) == marginal
    assert ("Over calibration and test together" in certificate.sentence) == marginal
    assert ("With 99 % confidence" in certificate.sentence) != marginal
    if not method.computes_epsilon:
        assert certificate.epsilon <= 0.1
        assert certificate.discarded > 0


def test_names_reach_their_methods(task: Task) -> None:
    rule, certificate = certify("conformal-pooled", task)
    expected, same = conformal(task.samples, TUBE, NOBODY, 0.1)
    assert np.array_equal(rule.values, expected.values)
    assert certificate == same
    bloated = certify("post-bloating", replace(task, epsilon=None))[1]
    assert bloated == post_bloat(task.samples, TUBE, NOBODY)[1]

    assert all(method.help for method in Method)


@pytest.mark.parametrize("method", [Method.POOLED, Method.PAC_POOLED, Method.NESTED_SETS])
def test_the_sentence_calls_a_method_as_settings_do(task: Task, method: Method) -> None:
    certificate = certify(method, task)[1]
    assert certificate.method == method.value and f"({method.value}, " in certificate.sentence


def test_the_sentence_says_that_bases_are_by_themselves(task: Task) -> None:
    _, certificate = certify("conformal-per-base", task)
    assert (certificate.groups, certificate.method) == (4, "conformal-per-base")
    assert "whichever calibrated base it drives there" in certificate.sentence


@pytest.mark.parametrize("method", Method)
def test_training_vehicles_are_refused(task: Task, method: Method) -> None:
    task = replace(task, trained_on=np.array([3]), epsilon=None if method.computes_epsilon else 0.1)
    with pytest.raises(CertificateError, match="1 of 800 calibration vehicles also trained"):
        certify(method, task)


def test_vehicles_that_shape_the_thresholds_are_refused(task: Task, draw: Draw) -> None:
    shaping = draw(600, 4, seed=2, first=799)
    with pytest.raises(CertificateError, match="1 of 800 calibration vehicles also trained"):
        certify("nested-sets", replace(task, trained_on=NOBODY, training=shaping))


def test_what_a_method_lacks_is_said(task: Task) -> None:
    with pytest.raises(CertificateError, match="no method is called 'bootstrap'; choose one of post-bloating, "):
        certify("bootstrap", task)
    with pytest.raises(CertificateError, match="post-bloating computes its ε and takes none"):
        certify("post-bloating", task)
    with pytest.raises(CertificateError, match="this method needs a bound ε"):
        certify("pac-pooled", replace(task, epsilon=None))
    with pytest.raises(CertificateError, match="needs the scores of the training split"):
        certify("nested-sets", replace(task, training=None))
    with pytest.raises(CertificateError, match="needs the scores of the training split"):
        certify("svm", replace(task, epsilon=None, training=None))
