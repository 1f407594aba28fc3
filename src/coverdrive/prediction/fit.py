"""From recordings to a certified predictor, in one call.

The basis and the network see only the training split Ω₁, thresholds and tube only the calibration split Ω₂, and the
evaluation only the test split. Every segment counts, whatever it does.
"""

import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Annotated, Literal, NamedTuple

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.arguments import all_of
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Certificate, Unit
from coverdrive.certificates.evaluation import Evaluation, Rate, evaluate
from coverdrive.certificates.methods import Method
from coverdrive.certificates.rule import LEAST, scale_of
from coverdrive.prediction.boxes.boxes import TUBE, early_share, scored_by
from coverdrive.prediction.boxes.predictor import BoxPredictor
from coverdrive.prediction.boxes.training import BoxSettings, train_boxes
from coverdrive.prediction.certifying.calibrate import (
    CertificateSettings,
    Epsilon,
    calibrate,
    held_back,
    provable,
    proved_scales,
)
from coverdrive.prediction.certifying.occupied import Occupied, areas_of_bases, compared
from coverdrive.prediction.certifying.scored import ScoredSides, score
from coverdrive.prediction.cover.basis import BasisSettings, make_basis
from coverdrive.prediction.data.held_out import Seen
from coverdrive.prediction.data.manoeuvres import manoeuvres_of
from coverdrive.prediction.data.segments import Segments, SegmentSettings, cut_segments
from coverdrive.prediction.data.split import Split, SplitSettings, split
from coverdrive.prediction.learning.own_network import Learner, OwnNetwork, seen_by
from coverdrive.prediction.learning.samples import Assignment, make_features, make_samples
from coverdrive.prediction.learning.training import TrainingSettings, train
from coverdrive.prediction.predictor import AnyPredictor, Predictor
from coverdrive.prediction.stored import LARGEST
from coverdrive.progress import stage
from coverdrive.recordings.read import together
from coverdrive.recordings.recording import Recording
from coverdrive.settings import Settings, checked

USUALLY_LEFT = 0.4
"""share of a calibration vehicle's windows in which it leaves the sets that are planned against, as long as no scale is
set"""


class PredictionSettings(Settings):
    """Everything that turns recordings into a predictor."""

    sets: Literal["boxes", "bases"] = "boxes"
    """boxes whose place and size follow the situation, or the paper's base trajectories with tubes around them"""
    segments: SegmentSettings = SegmentSettings()
    boxes: BoxSettings = BoxSettings()
    basis: BasisSettings = BasisSettings()
    split: SplitSettings = SplitSettings()
    assignment: Assignment = "covering"
    """what counts as predicted: any possible base that covers what the vehicle did, or only the nearest (the paper)"""
    training: TrainingSettings = TrainingSettings()
    certificate: CertificateSettings = CertificateSettings()
    scale: Annotated[float, Field(ge=0, le=LARGEST)] | Literal["auto"] = "auto"
    """λ: times as large as they were calibrated for the claim are the sets that are planned against; 0: the likeliest
    path alone; "auto": so large that a calibration vehicle leaves them in 4 of 10 windows on average, which does not
    depend on how many vehicles calibrate; 1 for sets of bases. `coverdrive dial` proves of drives what one gives"""

    @staticmethod
    def paper() -> "PredictionSettings":
        """The paper's labels, network and certificate; ε and the split are ours, and no sample is left out."""
        return PredictionSettings(
            sets="bases",
            basis=BasisSettings(cut=False),
            assignment="nearest",
            training=TrainingSettings.paper(),
            certificate=CertificateSettings(method=Method.POST_BLOATING, unit="vehicle"),
            scale=1.0,
        )


@dataclass(frozen=True)
class Fit:
    """A predictor, how it was made, and what was measured meanwhile."""

    predictor: AnyPredictor
    certificates: tuple[Certificate, ...]
    """of the calibrated sets in every unit in which there is one, the one asked for first"""
    evaluation: Evaluation
    """of the calibrated sets on the test split"""
    driven: Evaluation
    """of the sets of the predictor's scale, which are planned against, on the test split"""
    occupied: Occupied
    """how large the calibrated sets are there, and those of constant velocity with the same claim"""
    uncovered: Rate
    """test windows that are outside of every set: no base covers them within the radius of the cover"""
    segments: Segments
    """all segments cut from the recordings"""
    split: Split
    seen: Seen
    """the recordings, which of their scenes are held out, and the tracks of all others"""
    scored: ScoredSides
    """scores of the samples of each side of the split"""
    base_share: Float[np.ndarray, " M"]
    """share of the training windows that each base stands for; none without bases"""
    losses: Float[np.ndarray, " epochs"]
    """mean training loss of every epoch; none of a network that the user trained"""
    seconds: dict[str, float]
    """[s] wall time of every stage"""
    settings: PredictionSettings
    seed: int


def fit(
    recordings: Sequence[Recording],
    settings: PredictionSettings | None = None,
    seed: int = 0,
    *,
    epsilon: Epsilon | None = None,
    confidence: float | None = None,
    unit: Unit | None = None,
    learner: Learner | None = None,
    sides: Split | None = None,
) -> Fit:
    """Learn a predictor, certify it and test it.

    Args:
        recordings: at least two groups of scenes that share no vehicle, read at once or one by one; of two, one trains,
            and the vehicles of the other one calibrate, and are tested by what the others of them calibrate.
        settings: of every stage.
        seed: of the split, the cover and the training.
        epsilon: bound on the miss rate to ask for, in (0, 1), or "auto"; else, like the next two, as the settings say.
        confidence: with which the bound holds, in (0, 1).
        unit: what the bound counts.
        learner: makes a network of your own that scores base trajectories, from the training samples, of their
            ``features`` and ``base``: any function that gives N × M scores for N × 21 features
            (`coverdrive.prediction.learning.own_network`).
        sides: of the segments, where they are not to be drawn.

    Raises:
        SettingError: a value is not allowed.
        DataError: the recordings cannot be split, or hold no segments.
        CertificateError: there are too few calibration samples for a bound in the chosen unit; said before training.
    """
    recordings = together(all_of("recordings", recordings, Recording, "what `coverdrive.read` gives"))
    settings = _with_claim(settings or PredictionSettings(), epsilon, confidence, unit)
    seconds: dict[str, float] = {}
    with _timed("segments", seconds):
        segments, sides = cut_and_split(recordings, settings, seed, sides)
    if learner is not None:
        settings = settings.model_copy(update={"sets": "bases"})
    task = _Task(recordings, segments, sides, settings, seed, seconds)
    made = _fit_boxes(task) if settings.sets == "boxes" else _fit_bases(task, learner)
    scale = scale_left(made.predictor, made.scored.calibration) if settings.scale == "auto" else settings.scale
    predictor, test = made.predictor.scaled(scale), made.scored.test
    with _timed("comparison", seconds):
        kinds = manoeuvres_of(recordings, segments.of(sides.test))
        occupied = compared(made.areas, recordings, segments, sides, settings.certificate, predictor.calibrated, seed)
    return Fit(
        predictor=predictor,
        certificates=made.certificates,
        evaluation=evaluate(predictor.rule, test, kinds=kinds),
        driven=evaluate(predictor.rule, test, predictor.scale, kinds),
        occupied=occupied,
        uncovered=Rate.by_cluster(test.distance > predictor.tube, test.vehicle),
        segments=segments,
        split=sides,
        seen=Seen.of(recordings, segments, sides),
        scored=made.scored,
        base_share=made.base_share,
        losses=made.losses,
        seconds=seconds,
        settings=settings,
        seed=seed,
    )


class _Task(NamedTuple):
    """What there is to learn from, and how."""

    recordings: Sequence[Recording]
    segments: Segments
    sides: Split
    settings: PredictionSettings
    seed: int
    seconds: dict[str, float]


class _Made(NamedTuple):
    """What is learned and certified."""

    predictor: AnyPredictor
    certificates: tuple[Certificate, ...]
    scored: ScoredSides
    areas: Float[np.ndarray, " P"]
    base_share: Float[np.ndarray, " M"]
    losses: Float[np.ndarray, " epochs"]


def _fit_boxes(task: _Task) -> _Made:
    """Boxes whose place and size are learned."""
    recordings, segments, sides, settings, seed, seconds = task
    with _timed("affordances", seconds):
        asked = segments.of(sides.calibration)
        provable(asked.vehicle, asked.group, np.zeros(len(asked), dtype=bool), 1, settings.certificate)
        features = make_features(recordings, segments)
    with _timed("training", seconds):
        unit, training_seed = settings.certificate.unit, _seeds(seed)[2]
        early = early_share(segments.of(sides.train), recordings)
        network, losses = train_boxes(
            features[sides.train], segments.of(sides.train), settings.boxes, training_seed, unit, early
        )
    with _timed("certificate", seconds):
        train_side, calibration = (
            scored_by(network.boxes_of(features[side]), segments.of(side), recordings)
            for side in (sides.train, sides.calibration)
        )
        boxes, trained_on = network.boxes_of(features[sides.test]), np.unique(train_side.vehicle)
        rule, certificates = calibrate(TUBE, train_side, calibration, settings.certificate, seed)
        rungs = proved_scales(rule, trained_on, calibration, certificates[0])
        predictor = BoxPredictor(network, rule, certificates[0], trained_on, segments.step, rungs)
        if sides.crossed:
            test = held_back(rule, TUBE, train_side, calibration, settings.certificate, seed)
        else:
            test = scored_by(boxes, segments.of(sides.test), recordings)
    scored = ScoredSides(train_side, calibration, test, predictor.fingerprint)
    areas = boxes.areas.mean(0) * scale_of(rule) ** 2
    return _Made(predictor, certificates, scored, areas, np.zeros(0), losses)


def _fit_bases(task: _Task, learner: Learner | None) -> _Made:
    """Base trajectories and their scores."""
    recordings, segments, sides, settings, seed, seconds = task
    _, basis_seed, training_seed = _seeds(seed)
    with _timed("basis", seconds):
        basis = make_basis(segments.of(sides.train), settings.basis, basis_seed)
    with _timed("affordances and labels", seconds):
        samples = make_samples(recordings, segments, basis, settings.assignment)
        training = samples.of(sides.train)
        outside = samples.distance[np.arange(len(samples)), samples.base] > basis.radius
        asked = sides.calibration
        provable(samples.vehicle[asked], samples.group[asked], outside[asked], len(basis), settings.certificate)
    lessons = training
    with _timed("mirror images", seconds):
        if settings.training.mirrored:
            learned_from = segments.of(sides.train)
            images = make_samples(recordings, learned_from, basis, settings.assignment, mirrored=True)
            lessons = training.and_also(images.of(images.distance.min(1) <= basis.radius))  # those that a base covers
    with _timed("training", seconds):
        if learner is None:
            network, losses = train(lessons, settings.training, training_seed)
        else:
            inputs = settings.training.inputs
            scorer = learner(replace(lessons, features=seen_by(lessons.features, inputs)))
            network, losses = OwnNetwork(scorer, inputs, len(basis)), np.zeros(0)
    with _timed("certificate", seconds):
        tube = basis.radius if settings.assignment == "covering" else None
        train_side, calibration, test = (
            score(network, samples.of(side), tube) for side in (sides.train, sides.calibration, sides.test)
        )
        rule, certificates = calibrate(basis.radius, train_side, calibration, settings.certificate, seed)
        predictor = Predictor(basis, network, rule, certificates[0], np.unique(train_side.vehicle))
        if sides.crossed:
            test = held_back(rule, basis.radius, train_side, calibration, settings.certificate, seed)
    scored = ScoredSides(train_side, calibration, test, predictor.fingerprint)
    share = np.bincount(training.base, minlength=len(basis)) / len(training)
    areas = areas_of_bases(basis, rule, test)
    return _Made(predictor, certificates, scored, areas, share, losses)


def scale_left(predictor: AnyPredictor, samples: ScoredSamples, share: float = USUALLY_LEFT) -> float:
    """The λ with which vehicles leave boxes in a share of their windows, on average; 1 for sets of bases.

    Samples are those that calibrated. This says nothing about new vehicles: the certificate of the scaled predictor
    does. But it is alike for all predictors, however many vehicles calibrated them.
    """
    if not isinstance(predictor, BoxPredictor):
        return 1.0
    needed = (1 / np.maximum(samples.score_of_base, LEAST) - 1) / scale_of(predictor.rule)
    _, vehicle = np.unique(samples.vehicle, return_inverse=True)
    order = np.argsort(needed)
    held = np.cumsum((1 / np.bincount(vehicle)[vehicle])[order]) / (vehicle.max() + 1)
    return min(float(needed[order][np.searchsorted(held, 1 - share)]), LARGEST)


def cut_and_split(
    recordings: Sequence[Recording], settings: PredictionSettings, seed: int, sides: Split | None = None
) -> tuple[Segments, Split]:
    """The segments of recordings, and which of them train, calibrate and test, unless that is given."""
    segments = cut_segments(recordings, settings.segments)
    return segments, sides or split(segments.vehicle, segments.group, settings.split, _seeds(seed)[0])


def _with_claim(
    settings: PredictionSettings, epsilon: Epsilon | None, confidence: float | None, unit: Unit | None
) -> PredictionSettings:
    """The settings with another claim where one is given."""
    given = {"epsilon": epsilon, "confidence": confidence, "unit": unit}
    changes = {name: value for name, value in given.items() if value is not None}
    claim = checked(CertificateSettings, settings.certificate.model_dump() | changes)
    return settings.model_copy(update={"certificate": claim})


def _seeds(seed: int) -> list[int]:
    """Seeds of the split, the cover and the training."""
    return np.random.SeedSequence(seed).generate_state(3).tolist()


@contextmanager
def _timed(name: str, seconds: dict[str, float]) -> Generator[None]:
    """A stage of the fit, with its wall time."""
    start = time.perf_counter()
    with stage(name):
        yield
    seconds[name] = time.perf_counter() - start
