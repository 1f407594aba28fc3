"""Every method by its name: the same claim kept on the same samples, and what they refuse.

What can be proved with so many units is known before anything is scored, and no method proves more.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from certificates_fakes import Task, certify, conformal, post_bloat

from coverdrive.certificates.calibration import Claim, ScoredSamples
from coverdrive.certificates.certificate import Unit
from coverdrive.certificates.evaluation import evaluate
from coverdrive.certificates.methods import Method, provable_epsilon, smallest_epsilon, to_two_digits
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


BASES = 3


def provable(asked: float | Literal["auto"], bases: int, count: int, uncovered: int = 0) -> float | None:
    return provable_epsilon(asked, Method.PAC_POOLED, Claim(), bases, count, uncovered, "vehicle")


def test_by_hand() -> None:
    assert smallest_epsilon(Method.PAC_POOLED, Claim(), BASES, 100) == pytest.approx(1 - 0.01 ** (1 / 100))
    assert smallest_epsilon(Method.POOLED, Claim(), BASES, 99) == 0.01
    assert smallest_epsilon(Method.POOLED, Claim(), BASES, 99, uncovered=2) == 0.03
    assert smallest_epsilon(Method.DISCARDING, Claim(), BASES, 2) == 1


def samples_of(count: int, outside: int, seed: int = 0) -> ScoredSamples:
    """Easy samples, all of the first base, the first few of which leave the tube."""
    scores = np.random.default_rng(seed).uniform(0.5, 1, (count, BASES))
    distance = np.where(np.arange(count) < outside, 2.0, 0.0)
    return ScoredSamples(scores, np.zeros(count, int), distance, np.arange(count))


@pytest.mark.parametrize("outside", [0, 2])
@pytest.mark.parametrize("method", [method for method in Method if not method.computes_epsilon])
def test_no_method_proves_less_than_that_and_one_group_proves_that(method: Method, outside: int) -> None:
    least = smallest_epsilon(method, Claim(), BASES, 60, outside)

    def proved(epsilon: float) -> bool:
        training = samples_of(200, 0, 1)
        training = ScoredSamples(training.scores, training.base, training.distance, training.vehicle + 1000)
        task = Task(samples_of(60, outside), 1.0, training.vehicle, epsilon, training=training)
        try:
            certify(method, task)
        except CertificateError:
            return False
        return True

    assert not proved(least * 0.99)
    assert proved(to_two_digits(least)) or (outside and "pooled" not in method)


def test_post_bloating_computes_its_bound_and_may_prove_nothing() -> None:
    few = Method.POST_BLOATING
    task = Task(samples_of(60, 2), 1.0, np.zeros(0, int))
    assert certify(Method.POST_BLOATING, task)[1].epsilon == smallest_epsilon(few, Claim(), BASES, 60, 2)
    assert provable_epsilon(0.1, few, Claim(), BASES, 60) is None
    with pytest.raises(CertificateError, match=r"4 calibration windows, of which 2 leave the tube .* prove nothing"):
        provable_epsilon(0.1, few, Claim(), BASES, 4, 2)
    with pytest.raises(CertificateError, match=r"4 calibration windows, 2 leave the tube .* nothing is proved"):
        certify(Method.POST_BLOATING, Task(samples_of(4, 2), 1.0, np.zeros(0, int)))


def test_auto_is_the_usual_bound_or_the_smallest_that_the_number_proves() -> None:
    assert provable("auto", BASES, 44) == 0.1
    assert provable("auto", BASES, 43) == 0.11
    assert provable("auto", BASES, 20) == 0.21
    assert smallest_epsilon(Method.PAC_POOLED, Claim(), BASES, 20) == pytest.approx(0.2057, abs=1e-4)
    with pytest.raises(CertificateError, match=r"20 calibration vehicles, of which 1 leave .* cannot prove ε = 0.21"):
        provable("auto", BASES, 20, 1)
    with pytest.raises(CertificateError, match=r"prove nothing"):
        provable("auto", BASES, 0)


def test_what_cannot_be_proved_is_refused_with_what_can() -> None:
    with pytest.raises(CertificateError, match=r"43 calibration vehicles cannot prove ε = 0.1 by pac-pooled with 99 %"):
        provable(0.1, BASES, 43)
    with pytest.raises(CertificateError, match=r"possible with them is 0.11: ask for it with `--epsilon 0.11` or"):
        provable(0.1, BASES, 43)


@pytest.mark.parametrize(("value", "rounded"), [(0.1021, 0.11), (0.1, 0.11), (0.25, 0.25), (0.0101, 0.011), (0.991, 1)])
def test_rounding_up_to_two_digits(value: float, rounded: float) -> None:
    assert to_two_digits(value) == rounded >= value
