"""Calibrating a trained network: its scores become a rule with a certificate (paper §3.2)."""

from contextlib import suppress
from typing import Annotated, Literal, NamedTuple

import jax
import numpy as np
from jax import Array
from jaxtyping import Float
from pydantic import Field, model_validator

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Certificate, Tubes, Unit
from coverdrive.certificates.methods import Method, Task
from coverdrive.certificates.methods import certify as certify_scores
from coverdrive.errors import CertificateError
from coverdrive.prediction.basis import Basis
from coverdrive.prediction.network import Network
from coverdrive.prediction.predictor import Predictor
from coverdrive.prediction.samples import Samples
from coverdrive.settings import Settings

DEFAULT_EPSILON = 0.1

Epsilon = Annotated[float, Field(gt=0, lt=1)] | Literal["auto"]


class CertificateSettings(Settings):
    """What the certificate claims."""

    method: Method = Method.PAC_POOLED
    """how thresholds are calibrated; `coverdrive certify` compares all methods"""
    epsilon: Epsilon = DEFAULT_EPSILON
    """bound on the miss rate to ask for; ``"auto"``: the default if the calibration data can prove it, else the smallest
    that they can. Post-bloating and svm compute their own and ignore it"""
    confidence: float = Field(default=0.99, gt=0, lt=1)
    """probability with which the bound on the miss rate holds (paper, Table 1)"""
    unit: Unit = "vehicle"
    """what the bound stored with the predictor counts: whole vehicles, or windows as in the paper, which takes the
    windows of one vehicle for independent"""
    tube: Tubes = "cover"
    """radius around every base within which a vehicle has to stay: the ε of the cover, or one of its own, calibrated
    with the threshold of the base and never above ε"""

    @model_validator(mode="after")
    def _asks_for_what_there_is(self) -> "CertificateSettings":
        if self.tube == "per base" and not self.method.calibrates_tubes:
            raise ValueError(f"{self.method.value} calibrates no tubes; take the tube of the cover, or another method")
        return self

    @property
    def asked(self) -> float | None:
        """The bound to ask the method for."""
        if self.method.computes_epsilon:
            return None
        return DEFAULT_EPSILON if self.epsilon == "auto" else self.epsilon


class ScoredSides(NamedTuple):
    """Scores of the samples of each side of a split."""

    train: ScoredSamples
    calibration: ScoredSamples
    test: ScoredSamples


def score(network: Network, samples: Samples, tube: float | None = None) -> ScoredSamples:
    """Scores, and the last hidden layer, of samples with a known outcome.

    Args:
        network: any.
        samples: N samples.
        tube: a vehicle is in its predicted set if it stays within this radius of any possible base: of the bases that
            it stayed that close to, the one with the highest score stands for what it did. Without a tube, and
            where no base is that close, it is the base of the samples.
    """
    scores, hidden = (np.asarray(values) for values in _scores_and_hidden(network, samples.features))
    base = samples.base
    if tube is not None:
        covering = samples.distance <= tube
        base = np.where(covering.any(1), np.where(covering, scores, -1).argmax(1), base)
    distance = samples.distance[np.arange(len(samples)), base]
    return ScoredSamples(scores, base, distance, samples.vehicle, hidden)


@jax.jit
def _scores_and_hidden(
    network: Network, features: Float[Array, "N F"]
) -> tuple[Float[Array, "N M"], Float[Array, "N H"]]:
    return network.scores(features), network.hidden(features)


def calibrate(
    basis: Basis,
    network: Network,
    training: ScoredSamples,
    calibration: ScoredSamples,
    settings: CertificateSettings,
    seed: int = 0,
) -> tuple[Predictor, tuple[Certificate, ...]]:
    """Turn a trained network into a predictor with a certificate.

    Args:
        basis: its radius ε is the tube around every base that vehicles have to stay in.
        network: trained on the vehicles of ``training``.
        training: scores of the training split Ω₁.
        calibration: scores of the calibration split Ω₂.
        settings: what to claim.
        seed: of methods that draw.

    Returns:
        The predictor with its certificate in the chosen unit, and the certificates of its rule in every unit in
        which there is one: of post-bloating and svm in both units, as far as there are enough samples.

    Raises:
        CertificateError: a calibration vehicle trained the network, or there are too few for the claim.
    """
    trained_on = np.unique(training.vehicle)

    def certified(unit: Unit) -> tuple[Predictor, Certificate]:
        task = Task(
            samples=calibration,
            tube=basis.epsilon,
            trained_on=trained_on,
            epsilon=settings.asked,
            confidence=settings.confidence,
            unit=unit,
            training=training,
            seed=seed,
            tubes=settings.tube,
        )
        rule, certificate = certify_scores(settings.method, task)
        return Predictor(basis, network, rule, certificate, trained_on), certificate

    predictor, certificate = certified(settings.unit)
    certificates = [certificate]
    if settings.method.computes_epsilon:
        with suppress(CertificateError):  # the rule stands; too few samples support no claim in the other unit
            certificates.append(certified("vehicle" if settings.unit == "window" else "window")[1])
    return predictor, tuple(certificates)
