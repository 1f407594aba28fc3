"""Reading a results folder back: what its files hold, as the objects that they were written from."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import polars as pl

from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.comparison import Compared
from coverdrive.certificates.evaluation import Evaluation, Rate
from coverdrive.certificates.methods import Method
from coverdrive.config import Experiment
from coverdrive.errors import DataError
from coverdrive.prediction.learned import Learned
from coverdrive.prediction.predictor import Predictor
from coverdrive.report.binding import Binding
from coverdrive.report.contents import Certified, Contents
from coverdrive.simulation.trace import Trace

CONFIG, RUN, CERTIFICATE, METHODS = "config.toml", "run.json", "certificate.json", "methods.json"
PREDICTOR, LEARNED = "predictor.safetensors", "learned.safetensors"
_TRIALS, _DESCRIPTION = "trials.parquet", "study.json"
SCORES = "scores.safetensors"
STUDY = "study"
"""the study in the traffic of the folder's settings; one in another traffic is called ``study-drivers`` or the like"""


def load_predictor(folder: Path) -> Predictor:
    """The predictor of a results folder."""
    return Predictor.load(folder / PREDICTOR)


def load_experiment(folder: Path, study: str = STUDY) -> Experiment:
    """The settings of a results folder: those of the study, where it was driven with others than the fit.

    Args:
        folder: of the results.
        study: name of the study's folder in it; that of the usual traffic need not be there.

    Raises:
        DataError: there are no results in the folder, or the study was driven with another predictor or not at all.
    """
    _refuse_empty(folder)
    experiment = Experiment.load(folder / CONFIG)
    file = folder / study / _DESCRIPTION
    if not file.exists():
        if study != STUDY:
            raise _not_driven(folder, study)
        return experiment
    described = _json(file)
    configuration = described["configuration"]
    if configuration["predictor"] != load_predictor(folder).fingerprint:
        raise DataError(
            f"the study in {folder} was driven with another predictor than that in the folder; "
            f"fit to another folder, or remove the folder `{study}` in it and drive again"
        )
    parts = {name: value for name, value in configuration.items() if name in Experiment.model_fields}
    return experiment.overridden(
        seed=described["seed"], episode=described["episode"], study={"vehicles": described["vehicles"]}, **parts
    )


def clips_of(folder: Path) -> str | None:
    """The fingerprint of the recorded scenes that the study in a folder replayed; None without a study."""
    file = folder / _DESCRIPTION
    return _json(file)["configuration"]["clips"] if file.exists() else None


def has_trials(folder: Path, study: str = STUDY) -> bool:
    """Whether a results folder holds a finished study of that name."""
    return (folder / study / _TRIALS).exists()


def load_trials(folder: Path, study: str = STUDY) -> pl.DataFrame:
    """One row for each trial of a study of a results folder.

    Raises:
        DataError: there was no such study.
    """
    _refuse_empty(folder)
    if not has_trials(folder, study):
        raise _not_driven(folder, study)
    return pl.read_parquet(folder / study / _TRIALS)


def _refuse_empty(folder: Path) -> None:
    if not (folder / CONFIG).exists():
        raise DataError(f"there are no results in {folder}; make some with `coverdrive run --out {folder}`")


def _not_driven(folder: Path, study: str) -> DataError:
    traffic = study.removeprefix(STUDY).replace("-", " --traffic ", 1)
    return DataError(
        f"{folder} holds no finished study in `{study}`; drive one with `coverdrive study{traffic} --out {folder}`"
    )


def load_contents(folder: Path, traces: Mapping[int, Trace], study: str = STUDY) -> Contents:
    """Everything that a report shows of a results folder.

    Args:
        folder: of a fit; a comparison of methods and a study are shown if they are there.
        traces: drives to replay.
        study: name of the study's folder.

    Raises:
        DataError: there is no fit in the folder.
    """
    predictor = load_predictor(folder)
    experiment = load_experiment(folder, study)
    name = folder.resolve().name
    return Contents(
        name=name if study == STUDY else f"{name}, {study}",
        run=_json(folder / RUN),
        settings=(folder / CONFIG).read_text(encoding="utf-8"),
        predictor=predictor,
        certified=load_certified(folder),
        learned=Learned.load(folder / LEARNED),
        compared=load_comparison(folder, predictor),
        trials=load_trials(folder, study) if has_trials(folder, study) else None,
        traffic=experiment.traffic.kind,
        period=experiment.episode.step,
        binding=binding_of(experiment),
        traces=traces,
    )


def binding_of(experiment: Experiment) -> Binding:
    """Tells which obstacles bind a plan of the experiment's planner."""
    problem = experiment.planner.problem
    return Binding(problem.vehicle, problem.obstacles)


def load_certified(folder: Path) -> Certified:
    """The certificates of a fit, and its test."""
    record = _json(folder / CERTIFICATE)
    certificates = [
        {name: value for name, value in each.items() if name != "sentence"} for each in record["certificates"]
    ]
    return Certified(
        certificates=tuple(Certificate(**each) for each in certificates),
        evaluation=_evaluation(record["test"]),
        uncovered=Rate(**record["uncovered"]),
        samples=record["samples"],
    )


def load_certificates(folder: Path) -> tuple[Certificate, ...]:
    """The certificates of the predictor of a results folder, in every unit in which there is one."""
    return (
        load_certified(folder).certificates
        if (folder / CERTIFICATE).exists()
        else (load_predictor(folder).certificate,)
    )


def load_comparison(folder: Path, predictor: Predictor) -> list[Compared]:
    """All methods of calibration side by side; empty if they were not compared on this predictor yet."""
    if not (folder / METHODS).exists():
        return []
    record = _json(folder / METHODS)
    if not isinstance(record, dict) or record.get("predictor") != predictor.fingerprint:
        return []
    return [
        Compared(
            method=Method(each["method"]),
            target=each["target"],
            certificate=Certificate(**each["certificate"]) if each["certificate"] else None,
            evaluation=_evaluation(each["evaluation"]) if each["evaluation"] else None,
            refusal=each["refusal"],
            seconds=each["seconds"],
        )
        for each in record["methods"]
    ]


def _evaluation(record: Mapping[str, Any]) -> Evaluation:
    rates: dict[str, Any] = {name: Rate(**record[name]) for name in ("windows", "vehicles")}
    return Evaluation(**{**record, **rates})


def _json(file: Path) -> Any:
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DataError(f"{file}: not a readable result ({error}); make it with `coverdrive fit`") from error
