"""What can be proved with so many units is known before anything is scored, and no method proves more."""

from typing import Literal

import numpy as np
import pytest
from certificates_fakes import Task, certify

from coverdrive.certificates.calibration import Claim, ScoredSamples
from coverdrive.certificates.methods import Method
from coverdrive.certificates.provable import provable_epsilon, rounded_up, smallest_epsilon
from coverdrive.errors import CertificateError

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
    assert proved(rounded_up(least)) or (outside and "pooled" not in method)


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
    for wrong in (0.0, 1.0, -1.0, 1.5, float("nan")):
        with pytest.raises(CertificateError, match=r"between 0 and 1"):
            provable(wrong, BASES, 43)


@pytest.mark.parametrize(("value", "rounded"), [(0.1021, 0.11), (0.1, 0.11), (0.25, 0.25), (0.0101, 0.011), (0.991, 1)])
def test_rounding_up_to_two_digits(value: float, rounded: float) -> None:
    assert rounded_up(value) == rounded >= value
