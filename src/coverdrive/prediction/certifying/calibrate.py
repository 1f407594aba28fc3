"""Calibrating a trained network: its scores become a rule with a certificate (paper §3.2)."""

from contextlib import suppress
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Bool, Float, Int
from pydantic import Field

from coverdrive.certificates.calibration import Calibration, Claim, ScoredSamples, unit_of
from coverdrive.certificates.certificate import Certificate, Unit
from coverdrive.certificates.methods import Method, provable_epsilon
from coverdrive.certificates.methods import certify as certify_scores
from coverdrive.certificates.rule import LEAST, Rule, scale_of
from coverdrive.errors import CertificateError
from coverdrive.settings import Settings

_STEPS = 300
"""scales at which they are tried"""

_BOUNDS = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""ε that are proved of boxes that are smaller than those of the claim"""

_PARTS = 10
"""into which vehicles that calibrate are dealt to be tested on"""

Epsilon = Annotated[float, Field(gt=0, lt=1)] | Literal["auto"]
"""A bound on the miss rate, or "auto": one that can be proved"""


class CertificateSettings(Settings):
    """What the certificate claims."""

    method: Method = Method.PAC_POOLED
    """how thresholds are calibrated; `coverdrive calibrations` compares all methods"""
    epsilon: Epsilon = "auto"
    """bound on the miss rate to ask for; "auto" is 0.1 or, where so few calibration samples cannot prove that, the
    smallest that their number can; post-bloating and svm compute their own and ignore it"""
    confidence: float = Field(default=0.99, gt=0, lt=1)
    """probability with which the bound on the miss rate holds (paper, Table 1)"""
    unit: Unit = "share"
    """what the bound stored with the predictor is about: the share of a vehicle's windows (docs/choosing.md says
    why); whole vehicles, missed in any of their windows; windows as in the paper, which
    takes those of one vehicle for independent; or vehicles of a new group of scenes"""


def provable(
    vehicle: Int[np.ndarray, " N"],
    group: Int[np.ndarray, " N"],
    outside: Bool[np.ndarray, " N"],
    bases: int,
    settings: CertificateSettings,
) -> float | None:
    """The bound ε to ask for, None for methods that compute it; `CertificateError` if no network could prove it.

    N samples, those of them outside the tube of every base, and the number of bases are known before a network is
    trained.
    """
    unit = unit_of(vehicle, group, settings.unit)
    count, uncovered = int(unit.max()) + 1, len(np.unique(unit[outside]))
    claim = Claim(confidence=settings.confidence)
    return provable_epsilon(settings.epsilon, settings.method, claim, bases, count, uncovered, settings.unit)


def calibrate(
    tube: float, training: ScoredSamples, calibration: ScoredSamples, settings: CertificateSettings, seed: int = 0
) -> tuple[Rule, tuple[Certificate, ...]]:
    """A rule, and its certificates in every unit that has one, the chosen one first.

    It is made from the scores of the split Ω₁, which trained the network, and of Ω₂; the tube is the radius of the
    cover, and the seed is of methods that draw. Post-bloating and svm certify windows and vehicles, as far as there are
    enough samples.

    Raises:
        CertificateError: a calibration vehicle trained the network, or there are too few for the claim.
    """
    outside, bases = calibration.distance > tube, calibration.scores.shape[1]
    epsilon = provable(calibration.vehicle, calibration.scene, outside, bases, settings)
    claim = Claim(epsilon, settings.confidence)

    def certified(unit: Unit) -> tuple[Rule, Certificate]:
        units = Calibration.of(calibration, tube, training.vehicle, unit, seed, training)
        return certify_scores(settings.method, units, claim)

    rule, certificate = certified(settings.unit)
    certificates = [certificate]
    if settings.method.computes_epsilon:
        with suppress(CertificateError):  # the rule stands; too few samples support no claim in the other unit
            certificates.append(certified("vehicle" if settings.unit == "window" else "window")[1])
    return rule, tuple(certificates)


def proved_scales(
    rule: Rule, trained_on: Int[np.ndarray, " V"], samples: ScoredSamples, certificate: Certificate
) -> Float[np.ndarray, "n 2"]:
    """Bounds ε above that of a certificate, and the scale λ from which on each is proved of boxes, all at once.

    The boxes of the rule that the samples calibrated have λ = 1. Boxes grow with λ, and which λ will be taken is not
    known when they are calibrated: each of the bounds is proved with a share of the error probability, so that all of
    them hold with the confidence of the certificate, which at λ = 1 stands by itself. None hold without a confidence.
    """
    found = list[tuple[float, float]]()
    bounds = [bound for bound in _BOUNDS if bound > certificate.epsilon]
    if certificate.confidence is not None and bounds:
        steps = np.quantile(samples.scores, np.linspace(0, 1, _STEPS), method="lower")
        lower = steps[np.searchsorted(steps, samples.scores, side="right") - 1]  # scores in fewer steps miss no less
        units = Calibration.of(replace(samples, scores=lower), certificate.tube, trained_on, certificate.unit)
        sure = 1 - (1 - certificate.confidence) / len(bounds)
        for bound in bounds:
            with suppress(CertificateError):
                wider, _ = certify_scores(Method.PAC_POOLED, units, Claim(bound, sure))
                found.append((bound, scale_of(wider) / scale_of(rule)))
    return np.array(found).reshape(-1, 2)


def held_back(
    rule: Rule, tube: float, training: ScoredSamples, samples: ScoredSamples, settings: CertificateSettings, seed: int
) -> ScoredSamples:
    """The samples that calibrated a rule, moved so that it misses of each vehicle what the rule of the others misses.

    Where no other vehicles are left to test on, those that calibrate are dealt into parts. For each part, a rule is
    calibrated on all others, by the same method and for the same claim, or where they are too few for that, for what so
    many can prove, and says what it misses there. This is what the procedure misses with a tenth fewer vehicles; the
    rule that all of them calibrate, which is the one that is kept, is not tested. Sets keep the size that it gives
    them: of samples of boxes, the distances 1 / score − 1 are moved by the ratio of the two sizes, of others, scores by
    the difference of the two thresholds.

    Raises:
        CertificateError: nine tenths of the vehicles can prove nothing, or the rule has no thresholds.
    """
    if "thresholds" not in rule.arrays:
        raise CertificateError(
            "with two groups of scenes that share no vehicle, what calibrates also tests, which hyperplanes do not "
            "allow; give scenes of another time or place as well, or take another method"
        )
    _, vehicle = np.unique(samples.vehicle, return_inverse=True)
    part = np.random.default_rng(seed).permutation(vehicle.max() + 1)[vehicle] % _PARTS
    scores = samples.scores.astype(float)
    for number in np.unique(part):
        inside, others = part == number, np.flatnonzero(part != number)
        found = _calibrated(tube, training, samples.of(others), settings, seed)
        if samples.area is None:
            scores[inside] += rule.arrays["thresholds"] - found.arrays["thresholds"]
        else:
            farther = 1 / np.maximum(scores[inside], LEAST) - 1
            scores[inside] = 1 / (1 + farther * scale_of(rule) / max(scale_of(found), LEAST))
    return replace(samples, scores=scores.clip(0, 1))


def _calibrated(
    tube: float, training: ScoredSamples, samples: ScoredSamples, settings: CertificateSettings, seed: int
) -> Rule:
    """The rule that samples calibrate, for the claim, or for the smallest that they prove by their number."""
    try:
        return calibrate(tube, training, samples, settings, seed)[0]
    except CertificateError:
        easier = settings.model_copy(update={"epsilon": "auto"})
        return calibrate(tube, training, samples, easier, seed)[0]
