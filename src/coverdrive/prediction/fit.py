"""From recordings to a certified predictor, in one call.

The basis and the network see only the training split Ω₁, thresholds and tube only the calibration split Ω₂, and the
evaluation only the test split. Every segment counts, whatever it does.
"""

import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.evaluation import Evaluation, Rate, evaluate
from coverdrive.certificates.methods import Method
from coverdrive.prediction.basis import Basis, BasisSettings, make_basis
from coverdrive.prediction.calibrate import CertificateSettings, ScoredSides, calibrate, score
from coverdrive.prediction.foresight import refuse_foresight
from coverdrive.prediction.network import Network
from coverdrive.prediction.predictor import Predictor
from coverdrive.prediction.samples import Assignment, Samples, make_samples
from coverdrive.prediction.segments import Segments, SegmentSettings, cut_segments
from coverdrive.prediction.split import Split, SplitSettings, split
from coverdrive.prediction.training import TrainingSettings, train
from coverdrive.recordings.recording import Recording
from coverdrive.settings import Settings

StageProgress = Callable[[str, float], None]
"""Called with the name of the stage and the share of it that is done."""


class PredictionSettings(Settings):
    """Everything that turns recordings into a predictor."""

    segments: SegmentSettings = SegmentSettings()
    basis: BasisSettings = BasisSettings()
    split: SplitSettings = SplitSettings()
    assignment: Assignment = "covering"
    """what counts as predicted: any possible base that covers what the vehicle did, or only the nearest (the paper)"""
    training: TrainingSettings = TrainingSettings()
    certificate: CertificateSettings = CertificateSettings()

    @staticmethod
    def paper() -> "PredictionSettings":
        """The paper's labels, network and certificate; ε and the split are ours, and no sample is left out."""
        return PredictionSettings(
            basis=BasisSettings(cut=False),
            assignment="nearest",
            training=TrainingSettings.paper(),
            certificate=CertificateSettings(method=Method.POST_BLOATING),
        )


@dataclass(frozen=True)
class Fit:
    """A predictor, and what was measured while it was made."""

    predictor: Predictor
    certificates: tuple[Certificate, ...]
    """of the predictor's rule in every unit in which there is one, that of the predictor first"""
    evaluation: Evaluation
    """on the test split"""
    uncovered: Rate
    """test windows that no base covers within the basis' ε"""
    segments: Segments
    """all segments cut from the recordings"""
    split: Split
    scored: ScoredSides
    """scores of the samples of each side of the split"""
    base_share: Float[np.ndarray, " M"]
    """share of the training windows that each base stands for"""
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
        SettingError: the network would see a motion that was estimated from the future.
        DataError: the recordings cannot be split, or hold no segments.
        CertificateError: there are too few calibration samples for a bound in the chosen unit.
    """
    settings = settings or PredictionSettings()
    report = progress or _ignore
    seconds: dict[str, float] = {}
    _, basis_seed, training_seed = _seeds(seed)

    with _stage("segments", seconds, report):
        segments, sides = cut_and_split(recordings, settings, seed)
    with _stage("basis", seconds, report) as share:
        basis = make_basis(segments.of(sides.train), settings.basis, basis_seed, share)
    with _stage("affordances and labels", seconds, report) as share:
        samples = make_samples(recordings, segments, basis, settings.assignment, progress=share)
        training = samples.of(sides.train)
    if settings.training.mirrored:
        with _stage("mirror images", seconds, report) as share:
            mirrored = make_samples(
                recordings, segments.of(sides.train), basis, settings.assignment, mirrored=True, progress=share
            )
            mirrored = mirrored.of(mirrored.distance.min(1) <= basis.epsilon)
    else:
        mirrored = training.of(np.arange(0))
    with _stage("training", seconds, report) as share:
        network, losses = train(training.and_also(mirrored), settings.training, training_seed, share)
    with _stage("certificate", seconds, report):
        scored = _scored(network, samples, sides, _tube(basis, settings))
        predictor, certificates = calibrate(
            basis, network, scored.train, scored.calibration, settings.certificate, seed
        )
        evaluation = evaluate(predictor.rule, scored.test)
    return Fit(
        predictor=predictor,
        certificates=certificates,
        evaluation=evaluation,
        uncovered=Rate.of(scored.test.distance > basis.epsilon),
        segments=segments,
        split=sides,
        scored=scored,
        base_share=np.bincount(training.base, minlength=len(basis)) / len(training),
        losses=losses,
        seconds=seconds,
    )


def score_sides(
    predictor: Predictor,
    recordings: Sequence[Recording],
    settings: PredictionSettings | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> ScoredSides:
    """Scores on the same split that the same recordings, settings and seed give in `fit`.

    Args:
        predictor: any; a calibrator refuses the split if it is not the one that trained it.
        recordings: what to cut segments from.
        settings: of segments and split.
        seed: of the split.
        progress: called with the share of the recordings that is described.

    Raises:
        SettingError: the predictor sees a motion that was estimated from the future.
    """
    settings = settings or PredictionSettings()
    refuse_foresight(recordings, predictor.network.inputs)
    segments, sides = cut_and_split(recordings, settings, seed)
    samples = make_samples(recordings, segments, predictor.basis, settings.assignment, progress=progress)
    return _scored(predictor.network, samples, sides, _tube(predictor.basis, settings))


def cut_and_split(recordings: Sequence[Recording], settings: PredictionSettings, seed: int) -> tuple[Segments, Split]:
    """The segments of recordings, and which of them train, calibrate and test; the same as in `fit`."""
    refuse_foresight(recordings, settings.training.inputs)
    segments = cut_segments(recordings, settings.segments)
    return segments, split(segments.vehicle, segments.group, settings.split, _seeds(seed)[0])


def _scored(network: Network, samples: Samples, sides: Split, tube: float | None) -> ScoredSides:
    parts = (sides.train, sides.calibration, sides.test)
    return ScoredSides(*(score(network, samples.of(part), tube) for part in parts))


def _tube(basis: Basis, settings: PredictionSettings) -> float | None:
    return basis.epsilon if settings.assignment == "covering" else None


def _seeds(seed: int) -> list[int]:
    """Seeds of the split, the cover and the training."""
    return np.random.SeedSequence(seed).generate_state(3).tolist()


@contextmanager
def _stage(name: str, seconds: dict[str, float], report: StageProgress) -> Generator[Callable[[float], None]]:
    start = time.perf_counter()
    report(name, 0.0)
    yield lambda share: report(name, share)
    seconds[name] = time.perf_counter() - start
    report(name, 1.0)


def _ignore(stage: str, share: float) -> None:
    """Report to nobody."""
