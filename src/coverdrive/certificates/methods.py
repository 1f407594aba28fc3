"""Every method of calibration by its name, on the same arrays: what each claims, and what it costs in set size."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from functools import partial

import numpy as np
from jaxtyping import Int

from coverdrive.certificates.bloating import post_bloat
from coverdrive.certificates.bounds import check_confidence
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Certificate, Counted, Tubes
from coverdrive.certificates.conformal import clustered, conformal, per_base, pooled, units_needed
from coverdrive.certificates.discarding import discard
from coverdrive.certificates.family import Family, calibrate_family, quantile_family
from coverdrive.certificates.risk_control import learn_then_test, rules_of
from coverdrive.certificates.rule import Rule
from coverdrive.certificates.support_vectors import support_vectors
from coverdrive.certificates.units import make_units
from coverdrive.errors import CertificateError


class Method(StrEnum):
    """Names of the methods."""

    POST_BLOATING = "post-bloating"
    SVM = "svm"
    DISCARDING = "discarding"
    FAMILY = "family"
    RISK_CONTROL = "risk-control"
    POOLED = "conformal-pooled"
    PER_BASE = "conformal-per-base"
    CLUSTERED = "conformal-clustered"
    PAC_POOLED = "pac-pooled"
    PAC_PER_BASE = "pac-per-base"
    PAC_CLUSTERED = "pac-clustered"

    @property
    def help(self) -> str:
        """The method in one line."""
        return HELP[self]

    @property
    def computes_epsilon(self) -> bool:
        """Whether ε follows from the calibration samples, instead of being asked for."""
        return self in (Method.POST_BLOATING, Method.SVM)

    @property
    def marginal(self) -> bool:
        """Whether the bound is on average over calibrations, without confidence."""
        return self in (Method.POOLED, Method.PER_BASE, Method.CLUSTERED)

    @property
    def calibrates_tubes(self) -> bool:
        """Whether it can give every base a tube of its own."""
        return self in (Method.POST_BLOATING, Method.SVM, Method.DISCARDING, Method.FAMILY, Method.RISK_CONTROL)


HELP = {
    Method.POST_BLOATING: "misses no covered calibration sample; computes ε from their number (the paper's method)",
    Method.SVM: "hyperplanes in the last hidden layer that miss no covered calibration sample (the paper's appendix)",
    Method.DISCARDING: "post-bloating that may miss as many calibration samples as a given ε allows",
    Method.FAMILY: "thresholds at one level of quantiles of the training scores; the level is calibrated for a given ε",
    Method.RISK_CONTROL: "tests the same thresholds one after the other against a given ε (the reference)",
    Method.POOLED: "conformal with one threshold for all bases; ε on average over calibrations",
    Method.PER_BASE: "conformal with ε for every base by itself, on average over calibrations (the paper's appendix)",
    Method.CLUSTERED: "the same, with bases that are rare in training sharing one threshold",
    Method.PAC_POOLED: "conformal with one threshold for all bases; ε with the given confidence",
    Method.PAC_PER_BASE: "conformal with ε for every base by itself, for all of them with the given confidence",
    Method.PAC_CLUSTERED: "the same, with bases that are rare in training sharing one threshold",
}
"""One line about every method."""


@dataclass(frozen=True)
class Task:
    """What every method is given."""

    samples: ScoredSamples
    """the calibration split Ω₂"""
    tube: float
    """radius ρ around every base within which a path is covered, fixed beforehand"""
    trained_on: Int[np.ndarray, " V"]
    """keys of the vehicles that trained the network"""
    epsilon: float | None = None
    """bound on the probability of a miss; all methods need one, except post-bloating, which computes it"""
    confidence: float = 0.99
    """of the bound; conformal methods that are not PAC have none"""
    unit: Counted = "window"
    """what the bound counts"""
    training: ScoredSamples | None = None
    """scores of the training split Ω₁, which shapes families and clusters"""
    seed: int = 0
    """of the draw of one window of every vehicle, where these are the unit, and of the negatives of hyperplanes"""
    tubes: Tubes = "cover"
    """whether the tube of every base is that of the cover, or one of its own, calibrated with its threshold"""


def certify(method: Method | str, task: Task) -> tuple[Rule, Certificate]:
    """Calibrate thresholds by the method of a name.

    Raises:
        CertificateError: no such method, what it needs is not given, or what it would claim does not hold.
    """
    try:
        calibrate = _METHODS[Method(method)]
    except ValueError as error:
        raise CertificateError(f"no method is called {method!r}; choose one of {', '.join(Method)}") from error
    check_confidence(task.confidence)
    if Method(method).computes_epsilon and task.epsilon is not None:
        raise CertificateError(f"{method} computes its ε and takes none; leave it out, or use discarding")
    if task.tubes == "per base" and not Method(method).calibrates_tubes:
        raise CertificateError(
            f"{method} calibrates one number for each group of bases and no tubes; take the cover's tube, or one of "
            f"{', '.join(each for each in Method if each.calibrates_tubes)}"
        )
    return calibrate(task)


def _post_bloating(task: Task) -> tuple[Rule, Certificate]:
    return post_bloat(task.samples, task.tube, task.trained_on, task.confidence, task.unit, task.seed, task.tubes)


def _svm(task: Task) -> tuple[Rule, Certificate]:
    return support_vectors(
        task.samples,
        task.tube,
        _seen(task),
        _training(task),
        confidence=task.confidence,
        unit=task.unit,
        seed=task.seed,
        tubes=task.tubes,
    )


def _discarding(task: Task) -> tuple[Rule, Certificate]:
    return discard(
        task.samples,
        task.tube,
        task.trained_on,
        epsilon=_epsilon(task),
        confidence=task.confidence,
        unit=task.unit,
        seed=task.seed,
        tubes=task.tubes,
    )


def _family(task: Task) -> tuple[Rule, Certificate]:
    return calibrate_family(
        task.samples,
        task.tube,
        _seen(task),
        _family_of(task),
        epsilon=_epsilon(task),
        confidence=task.confidence,
        unit=task.unit,
        seed=task.seed,
    )


def _family_of(task: Task) -> Family:
    return quantile_family(_training(task), tube=task.tube if task.tubes == "per base" else None)


def _risk_control(task: Task) -> tuple[Rule, Certificate]:
    return learn_then_test(
        task.samples,
        task.tube,
        _seen(task),
        rules_of(_family_of(task), task.tube),
        epsilon=_epsilon(task),
        confidence=task.confidence,
        unit=task.unit,
        seed=task.seed,
    )


def _conformal(
    task: Task, group: Callable[[Task, float | None], Int[np.ndarray, " M"]], pac: bool
) -> tuple[Rule, Certificate]:
    confidence = task.confidence if pac else None
    return conformal(
        task.samples,
        task.tube,
        _seen(task),
        epsilon=_epsilon(task),
        confidence=confidence,
        group=group(task, confidence),
        unit=task.unit,
        seed=task.seed,
    )


def _pooled(task: Task, confidence: float | None) -> Int[np.ndarray, " M"]:
    return pooled(task.samples.scores.shape[1])


def _per_base(task: Task, confidence: float | None) -> Int[np.ndarray, " M"]:
    return per_base(task.samples.scores.shape[1])


def _clustered(task: Task, confidence: float | None) -> Int[np.ndarray, " M"]:
    """A group should have, by its share of Ω₁, twice the calibration units that ε needs."""
    bases = task.samples.scores.shape[1]
    training = make_units(_training(task), task.tube, task.unit, task.seed)
    calibrated = make_units(task.samples, task.tube, task.unit, task.seed)
    shared = None if confidence is None else 1 - (1 - confidence) / bases
    least = 2 * units_needed(_epsilon(task), shared) * len(training) / len(calibrated)
    return clustered(np.bincount(training.base, minlength=bases), least)


def _epsilon(task: Task) -> float:
    if task.epsilon is None:
        raise CertificateError(
            "this method needs a bound ε on the probability of a miss; only post-bloating and svm compute it"
        )
    return task.epsilon


def _training(task: Task) -> ScoredSamples:
    if task.training is None:
        raise CertificateError("this method needs the scores of the training split, which shape its thresholds")
    return task.training


def _seen(task: Task) -> Int[np.ndarray, " V"]:
    """Vehicles that calibration must not contain."""
    return task.trained_on if task.training is None else np.union1d(task.trained_on, task.training.vehicle)


_METHODS: dict[Method, Callable[[Task], tuple[Rule, Certificate]]] = {
    Method.POST_BLOATING: _post_bloating,
    Method.SVM: _svm,
    Method.DISCARDING: _discarding,
    Method.FAMILY: _family,
    Method.RISK_CONTROL: _risk_control,
    Method.POOLED: partial(_conformal, group=_pooled, pac=False),
    Method.PER_BASE: partial(_conformal, group=_per_base, pac=False),
    Method.CLUSTERED: partial(_conformal, group=_clustered, pac=False),
    Method.PAC_POOLED: partial(_conformal, group=_pooled, pac=True),
    Method.PAC_PER_BASE: partial(_conformal, group=_per_base, pac=True),
    Method.PAC_CLUSTERED: partial(_conformal, group=_clustered, pac=True),
}
