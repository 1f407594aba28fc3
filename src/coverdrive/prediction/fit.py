"""From recordings to a certified predictor, in one call.

The basis and the network see only the training split Ω₁, thresholds and tube only the calibration split Ω₂, and the
evaluation only the test split. Every segment counts, whatever it does.
"""

import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field

from coverdrive.certificates.bloating import post_bloat
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Certificate, Unit
from coverdrive.certificates.evaluation import Evaluation, Rate, evaluate
from coverdrive.errors import CertificateError
from coverdrive.prediction.basis import Basis, BasisSettings, make_basis
from coverdrive.prediction.network import Network
from coverdrive.prediction.predictor import Predictor
from coverdrive.prediction.samples import Samples, make_samples
from coverdrive.prediction.segments import Segments, SegmentSettings, cut_segments
from coverdrive.prediction.split import Split, SplitSettings, split
from coverdrive.prediction.training import TrainingSettings, train
from coverdrive.recordings.recording import Recording
from coverdrive.settings import Settings

StageProgress = Callable[[str, float], None]
"""Called with the name of the stage and the share of it that is done."""


class CertificateSettings(Settings):
    """What the certificate claims."""

    confidence: float = Field(default=0.99, gt=0, lt=1)
    """probability with which the bound on the miss rate holds (paper, Table 1)"""
    unit: Unit = "vehicle"
    """what the bound stored with the predictor counts: whole vehicles, or windows as in the paper, which takes the
    windows of one vehicle for independent"""


class PredictionSettings(Settings):
    """Everything that turns recordings into a predictor."""

    segments: SegmentSettings = SegmentSettings()
    basis: BasisSettings = BasisSettings()
    split: SplitSettings = SplitSettings()
    training: TrainingSettings = TrainingSettings()
    certificate: CertificateSettings = CertificateSettings()


@dataclass(frozen=True)
class Fit:
    """A predictor, and what was measured while it was made."""

    predictor: Predictor
    certificates: tuple[Certificate, ...]
    """of the same rule for windows and for vehicles; one is missing if there are too few samples for any bound"""
    evaluation: Evaluation
    """on the test split"""
    uncovered: Rate
    """test windows that no base covers within the basis' ε"""
    segments: Segments
    """all segments cut from the recordings"""
    split: Split
    base_share: Float[np.ndarray, " M"]
    """share of the training windows that are nearest to each base"""
    losses: Float[np.ndarray, " epochs"]
    """mean training loss of every epoch"""
    seconds: dict[str, float]
    """[s] wall time of every stage"""


def fit(
    recordings: Sequence[Recording],
    settings: PredictionSettings | None = None,
    seed: int = 0,
    progress: StageProgress | None = None,
) -> Fit:
    """Learn a predictor, certify it and test it.

    Args:
        recordings: at least three independent groups of scenes.
        settings: of every stage.
        seed: of the split, the cover and the training.
        progress: called with the stage and the share of it that is done.

    Raises:
        DataError: the recordings cannot be split, or hold no segments.
        CertificateError: there are too few calibration samples for a bound in the chosen unit.
    """
    settings = settings or PredictionSettings()
    report = progress or _ignore
    seconds: dict[str, float] = {}
    split_seed, basis_seed, training_seed = np.random.SeedSequence(seed).generate_state(3).tolist()

    with _stage("segments", seconds, report):
        segments = cut_segments(recordings, settings.segments)
        sides = split(segments.vehicle, segments.group, settings.split, split_seed)
    with _stage("basis", seconds, report) as share:
        basis = make_basis(segments.of(sides.train), settings.basis, basis_seed, share)
    with _stage("affordances and labels", seconds, report) as share:
        samples = make_samples(recordings, segments, basis, share)
        training, calibration, test = (samples.of(side) for side in (sides.train, sides.calibration, sides.test))
    with _stage("training", seconds, report) as share:
        network, losses = train(training, settings.training, training_seed, share)
    with _stage("certificate", seconds, report):
        predictor, certificates = certify(
            basis, network, np.unique(training.vehicle), calibration, settings.certificate
        )
        evaluation = evaluate(predictor.rule, score(predictor.network, test))
    return Fit(
        predictor=predictor,
        certificates=certificates,
        evaluation=evaluation,
        uncovered=Rate.of(test.distance > basis.epsilon),
        segments=segments,
        split=sides,
        base_share=np.bincount(training.base, minlength=len(basis)) / len(training),
        losses=losses,
        seconds=seconds,
    )


def certify(
    basis: Basis,
    network: Network,
    trained_on: Int[np.ndarray, " V"],
    calibration: Samples,
    settings: CertificateSettings,
) -> tuple[Predictor, tuple[Certificate, ...]]:
    """Calibrate a trained network by post-bloating.

    Returns:
        The predictor, which carries the certificate in the chosen unit, and the certificates in every unit in which
        there are enough samples.

    Raises:
        CertificateError: a calibration vehicle trained the network, or there are too few for the chosen unit.
    """
    scored = score(network, calibration)
    rule, certificate = post_bloat(scored, basis.epsilon, trained_on, settings.confidence, settings.unit)
    certificates = [certificate]
    other: Unit = "vehicle" if settings.unit == "window" else "window"
    with suppress(CertificateError):  # the rule stands; with too few samples it supports no claim in the other unit
        certificates.append(post_bloat(scored, basis.epsilon, trained_on, settings.confidence, other)[1])
    return Predictor(basis, network, rule, certificate, trained_on), tuple(certificates)


def score(network: Network, samples: Samples) -> ScoredSamples:
    """Scores of samples with a known outcome."""
    scores = np.asarray(network.scores(samples.features))
    return ScoredSamples(scores, samples.base, samples.distance, samples.vehicle)


@contextmanager
def _stage(name: str, seconds: dict[str, float], report: StageProgress) -> Generator[Callable[[float], None]]:
    start = time.perf_counter()
    report(name, 0.0)
    yield lambda share: report(name, share)
    seconds[name] = time.perf_counter() - start
    report(name, 1.0)


def _ignore(stage: str, share: float) -> None:
    """Report to nobody."""
