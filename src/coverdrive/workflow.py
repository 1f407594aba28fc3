"""What the commands do: each stage reads and writes one results folder.

``config.toml`` (all settings) · ``run.json`` (versions, data, times) · ``predictor.safetensors`` ·
``certificate.json`` · ``learned.safetensors`` (what pictures of the fit show) · ``scores.safetensors`` ·
``methods.json`` (all methods of calibration) ·
``study/trials.parquet`` (one row per trial) · ``study/traces/`` (drives that were looked at) · ``figures/`` ·
``report.html``. `coverdrive.results` reads it.
"""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import cache, partial
from pathlib import Path

import numpy as np
import polars as pl

import coverdrive
from coverdrive.certificates.calibration import Calibration, Claim
from coverdrive.certificates.certificate import Counted, fingerprint
from coverdrive.certificates.comparison import Compared, compare
from coverdrive.certificates.paper_tables import PaperTables, make_tables
from coverdrive.config import Experiment
from coverdrive.errors import DataError
from coverdrive.files import number_in_name, write_atomically
from coverdrive.planning.planner import MpcPlanner
from coverdrive.prediction.cover.basis_study import StudiedBasis, basis_record, point_table
from coverdrive.prediction.fit import Fit, fit
from coverdrive.prediction.held_out import Source, held_out
from coverdrive.prediction.learned import Learned
from coverdrive.prediction.paper_settings import paper_settings
from coverdrive.prediction.predictor import Predictor
from coverdrive.prediction.scored import ScoredSides
from coverdrive.progress import Listener, heard_by, stage
from coverdrive.recordings.generated import generate
from coverdrive.recordings.read import read
from coverdrive.recordings.recording import Recording
from coverdrive.records import certificate_record, provenance, write_json
from coverdrive.results import CERTIFICATE, CONFIG, LEARNED, METHODS, PREDICTOR, RUN, SCORES, clips_of
from coverdrive.simulation.replay import Clip, ReplaySettings, cut_clips
from coverdrive.simulation.storage import load_trace, save_trace
from coverdrive.simulation.study import run_study
from coverdrive.simulation.trace import Trace
from coverdrive.simulation.traffics import make_traffic
from coverdrive.simulation.trial import Participants, run_trial


def load_recordings(
    experiment: Experiment, paths: Sequence[Path], progress: Callable[[float], None] | None = None
) -> tuple[Recording, ...]:
    """The given recordings, or generated traffic where none is given."""
    if paths:
        return read(paths, experiment.location, progress, experiment.smoothing)
    return generate(experiment.generated, experiment.seed, progress=progress)


def fit_predictor(
    experiment: Experiment, recordings: Sequence[Recording], folder: Path, progress: Listener | None = None
) -> Fit:
    """Learn, certify and test a predictor; write it, its certificates and the settings."""
    with heard_by(progress or _nobody):
        result = fit(recordings, experiment.prediction, experiment.seed)
    experiment.save(folder / CONFIG)
    result.predictor.save(folder / PREDICTOR)
    Learned.of(result).save(folder / LEARNED)
    result.scored.save(folder / SCORES)
    write_json(folder / CERTIFICATE, certificate_record(result))
    sources = {"recordings": [asdict(each) for each in result.source]}
    write_json(folder / RUN, provenance(experiment, recordings) | sources | {"seconds": result.seconds})
    return result


def save_bases(
    experiment: Experiment, recordings: Sequence[Recording], studied: Sequence[StudiedBasis], folder: Path
) -> None:
    """Write every basis as safetensors and as a table of points, and what they were made from."""
    experiment.save(folder / CONFIG)
    write_json(
        folder / "bases.json",
        provenance(experiment, recordings) | {"bases": [basis_record(each) for each in studied]},
    )
    for each in studied:
        name = f"basis_{number_in_name(each.basis.radius)}"
        each.basis.save(folder / f"{name}.safetensors", each.source)
        write_atomically(folder / f"{name}.csv", point_table(each).write_csv)


def _nobody(name: str, share: float) -> None:
    """Nobody listens."""


def compare_methods(
    experiment: Experiment,
    predictor: Predictor,
    sides: ScoredSides,
    targets: Sequence[float],
    unit: Counted | None = None,
    progress: Listener | None = None,
) -> list[Compared]:
    """Calibrate a predictor by every method, and test it.

    Args:
        experiment: all settings.
        predictor: whose network gave the scores.
        sides: scores of the split that the predictor was fitted with: those of its `Fit`.
        targets: bounds ε on the miss rate to ask for.
        unit: what the bounds count; else that of the settings.
        progress: called with the stage and the share of it that is done.

    Raises:
        CertificateError: the scores are of another split, so that calibration samples trained the network.
    """
    settings = experiment.prediction
    calibration = Calibration.of(
        sides.calibration,
        predictor.basis.radius,
        predictor.trained_on,
        unit or settings.certificate.unit,
        experiment.seed,
        sides.train,
    )
    claim = Claim(confidence=settings.certificate.confidence, tubes=settings.certificate.tube)
    with heard_by(progress or _nobody), stage("methods"):
        return compare(calibration, claim, sides.test, targets)


def save_comparison(compared: Sequence[Compared], predictor: Predictor, folder: Path) -> None:
    """Write a comparison of methods as JSON, and as a table of one row for each method and target."""
    write_json(folder / METHODS, {"predictor": predictor.fingerprint, "methods": [asdict(each) for each in compared]})
    rows = [
        {
            "method": each.method.value,
            "asked": each.target,
            "proved": each.certificate.epsilon if each.certificate else None,
            "observed": each.missed.value if each.missed else None,
            "low": each.missed.low if each.missed else None,
            "high": each.missed.high if each.missed else None,
            "mean_set_size": each.evaluation.mean_set_size if each.evaluation else None,
            "mean_tube": each.evaluation.mean_tube if each.evaluation else None,
            "seconds": each.seconds,
            "refusal": each.refusal,
        }
        for each in compared
    ]
    write_atomically(folder / "methods.csv", pl.DataFrame(rows, infer_schema_length=None).write_csv)


def paper_tables(
    experiment: Experiment, recordings: Sequence[Recording], progress: Listener | None = None
) -> PaperTables:
    """Repeat the tables of the paper on recordings, with the paper's settings and the seed of the experiment."""
    with heard_by(progress or _nobody):
        result = fit(recordings, paper_settings(), experiment.seed)
        scored = result.scored
        with stage("tables"):
            return make_tables(
                scored.train, scored.calibration, scored.test, result.predictor.basis.radius, experiment.seed
            )


def save_paper_tables(experiment: Experiment, frames: Mapping[str, pl.DataFrame], folder: Path) -> None:
    """Write tables as CSV files of their names, and the settings that they were made with."""
    experiment.model_copy(update={"prediction": paper_settings()}).save(folder / "config.toml")
    for name, frame in frames.items():
        write_atomically(folder / f"{name}.csv", frame.write_csv)


def study(
    experiment: Experiment,
    predictor: Predictor,
    folder: Path,
    progress: Callable[[int, int], None] | None = None,
    *,
    clips: Sequence[Clip] = (),
    cluster: str | None = None,
) -> pl.DataFrame:
    """Run the trials of a closed-loop study that its folder does not hold yet.

    Args:
        experiment: all settings.
        predictor: of the own car.
        folder: of this study.
        progress: called with the number of finished trials and the largest number of trials.
        clips: recorded scenes, if they are to be replayed.
        cluster: address of a Dask scheduler.
    """
    size = experiment.study
    made_from = {"predictor": predictor.fingerprint, "clips": _fingerprint_of(clips)}
    return run_study(
        partial(participants, experiment, predictor, clips),
        experiment.episode,
        folder,
        trials=size.trials,
        seed=experiment.seed,
        vehicles=size.vehicles,
        workers=size.workers or os.cpu_count() or 1,
        cluster=cluster,
        until_width=size.until_width,
        batch=size.batch,
        configuration=made_from | experiment.model_dump(mode="json", include={"planner", "traffic"}),
        progress=progress,
    )


def drive(
    experiment: Experiment,
    predictor: Predictor,
    vehicles: int,
    trial: int,
    clips: Sequence[Clip] = (),
    progress: Callable[[float], None] | None = None,
) -> Trace:
    """One trial of the study, with everything that happened in it."""
    parts = participants(experiment, predictor, clips)
    return run_trial(parts, experiment.episode, vehicles, experiment.seed, trial, progress)


def drives(
    experiment: Experiment,
    predictor: Predictor,
    folder: Path,
    trials: Sequence[int],
    progress: Callable[[float], None] | None = None,
    clips: Callable[[], Sequence[Clip]] = tuple,
) -> dict[int, Trace]:
    """Trials of a study by their numbers, read from its folder or driven again and stored there.

    A stored drive is used only if it belongs to this experiment and predictor.

    Args:
        experiment: all settings.
        predictor: of the own car.
        folder: of the study.
        trials: their numbers.
        progress: called with the share that is done.
        clips: reads the recorded scenes, if some are to be replayed; called only if a drive is not stored.

    Raises:
        DataError: the study replayed other scenes.
    """
    clips = cache(partial(_checked_clips, clips, folder))
    description = {"predictor": predictor.fingerprint, "version": coverdrive.__version__, "seed": experiment.seed}
    description |= experiment.model_dump(mode="json", include={"planner", "traffic", "episode"})
    if isinstance(experiment.traffic, ReplaySettings):
        description["clips"] = clips_of(folder) or _fingerprint_of(clips())
    key = fingerprint(np.frombuffer(json.dumps(description, sort_keys=True).encode(), np.uint8))
    report = progress or (lambda share: None)
    traces: dict[int, Trace] = {}
    for number, trial in enumerate(trials):
        driven = partial(_share_of_one, report, number, len(trials))
        driven(0.0)
        vehicles = vehicles_of(experiment, trial)
        file = folder / "traces" / f"{trial:06d}_{vehicles}_{key}.npz"
        if not file.exists():
            save_trace(drive(experiment, predictor, vehicles, trial, clips(), driven), file)
        traces[trial] = load_trace(file)
    report(1.0)
    return traces


def _share_of_one(report: Callable[[float], None], number: int, total: int, share: float) -> None:
    """Report the share of all, where a share of one of them is done, and those before it."""
    report((number + share) / total)


def _checked_clips(clips: Callable[[], Sequence[Clip]], folder: Path) -> Sequence[Clip]:
    """Recorded scenes, if they are those that the study in a folder replayed, or if there is none."""
    found, wanted = clips(), clips_of(folder)
    if wanted not in (None, _fingerprint_of(found)):
        raise DataError(f"the study in {folder} replayed other recordings; name the same ones with --recording")
    return found


def vehicles_of(experiment: Experiment, trial: int) -> int:
    """Number of uncontrolled vehicles in a trial of the study."""
    numbers = experiment.study.vehicles
    return numbers[trial % len(numbers)]


def clips_to_replay(
    experiment: Experiment,
    predictor: Predictor,
    folder: Path,
    paths: Sequence[Path],
    progress: Callable[[float], None] | None = None,
) -> tuple[Clip, ...]:
    """Recorded scenes that neither trained nor calibrated the predictor of a folder; none if nothing is replayed."""
    if not isinstance(experiment.traffic, ReplaySettings):
        return ()
    settings = folder / CONFIG
    made_with = Experiment.load(settings) if settings.exists() else experiment
    recordings = load_recordings(made_with, paths, progress)
    run = json.loads((folder / RUN).read_text(encoding="utf-8"))
    return cut_clips(held_out([Source(**each) for each in run["recordings"]], predictor, recordings))


def participants(experiment: Experiment, predictor: Predictor, clips: Sequence[Clip] = ()) -> Participants:
    """Who takes part in a trial: the predictor, the planner that uses it, and the traffic."""
    traffic = make_traffic(experiment.traffic, predictor, clips)
    return Participants(predictor, MpcPlanner(experiment.planner), traffic)


def _fingerprint_of(clips: Sequence[Clip]) -> str:
    return fingerprint(*(clip.states for clip in clips))
