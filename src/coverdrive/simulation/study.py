"""Many seeded trials, on several processes, resumable (paper §5: 1000 trials, 200 each for 3 to 7 vehicles).

Trial i has its own seed, so the results do not depend on the number of processes nor on the order in which trials
finish. Files in the folder of a study: ``study.json`` says what is studied, ``trials/`` holds one row per finished
trial, ``trials.parquet`` all rows together.
"""

import json
import os
import uuid
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import polars as pl
from joblib import Parallel, delayed, parallel_config

import coverdrive
from coverdrive.errors import DataError, SettingError
from coverdrive.files import write_atomically
from coverdrive.simulation.episode import EpisodeSettings
from coverdrive.simulation.trial import Build, Participants, measure, run_trial, table_of

Progress = Callable[[int, int], None]
"""called with the number of finished trials and the number of all trials"""

VEHICLES = (3, 4, 5, 6, 7)
"""numbers of uncontrolled vehicles, taken in turn by the trials (paper §5)"""


def run_study(
    build: Build,
    settings: EpisodeSettings,
    folder: Path,
    *,
    trials: int = 1000,
    seed: int = 0,
    vehicles: tuple[int, ...] = VEHICLES,
    workers: int = 1,
    configuration: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> pl.DataFrame:
    """Run all trials that ``folder`` does not hold yet; a study that was killed goes on where it was.

    A study may be continued with more trials: the first ones stay the same.

    Args:
        build: makes predictor, planner and traffic, once in every process.
        settings: of every episode.
        folder: of this study and no other; made as needed.
        trials: number of trials.
        seed: of the study; trial i draws from ``SeedSequence(seed, spawn_key=(i,))``.
        vehicles: numbers of uncontrolled vehicles; trial i has the i-th of them, over and over.
        workers: number of processes, each on one thread; with 1, trials run in this process.
        configuration: what ``build`` was made from, as JSON values; a folder refuses another configuration.
        progress: called before the first trial and after each.

    Returns:
        One row per trial, ascending; the columns are `coverdrive.simulation.trial.TrialResult`'s fields.

    Raises:
        SettingError: fewer than one trial or worker or no number of vehicles.
        DataError: the folder holds a study of another configuration.
    """
    if trials < 1 or workers < 1 or not vehicles:
        raise SettingError(
            f"a study needs at least one trial, worker and number of vehicles; got {trials} trials, {workers} workers "
            f"and {len(vehicles)} numbers of vehicles"
        )
    _claim(folder, _description(settings, seed, vehicles, configuration or {}))
    _remove_unfinished(folder)
    pending = [trial for trial in range(trials) if not _part(folder, trial).exists()]
    report = progress or _ignore
    report(trials - len(pending), trials)
    tasks = [(settings, vehicles[trial % len(vehicles)], seed, trial, folder) for trial in pending]
    for finished, _ in enumerate(_run_all(build, tasks, workers), start=trials - len(pending) + 1):
        report(finished, trials)
    table = pl.concat([pl.read_parquet(_part(folder, trial)) for trial in range(trials)])
    write_atomically(folder / "trials.parquet", table.write_parquet)
    return table


Task = tuple[EpisodeSettings, int, int, int, Path]


def _run_all(build: Build, tasks: list[Task], workers: int) -> Generator[None]:
    """Run the tasks in any order, yielding after each that is done."""
    if workers > 1 and len(tasks) > 1:
        yield from _run_parallel(build, tasks, workers)
    elif tasks:
        participants = build()
        for task in tasks:
            yield _run_task(participants, *task)


def _run_parallel(build: Build, tasks: list[Task], workers: int) -> Generator[None]:
    study = uuid.uuid4().hex
    with _one_thread_each(), parallel_config(backend="loky", inner_max_num_threads=1):
        parallel = Parallel(n_jobs=min(workers, len(tasks)), return_as="generator_unordered")
        yield from parallel(delayed(_run_in_worker)(build, study, task) for task in tasks)


def _run_in_worker(build: Build, study: str, task: Task) -> None:
    """Run a task in this process, with participants that were built on its first task of the study."""
    if study not in _participants:
        _participants.clear()
        _participants[study] = build()
    _run_task(_participants[study], *task)


_participants: dict[str, Participants] = {}
"""of this process, by study; at most one entry, because joblib keeps processes for the next study"""


def _run_task(
    participants: Participants, settings: EpisodeSettings, vehicles: int, seed: int, trial: int, folder: Path
) -> None:
    """Run one trial and write its row."""
    result = measure(run_trial(participants, settings, vehicles, seed, trial), seed, trial)
    write_atomically(_part(folder, trial), table_of([result]).write_parquet)


@contextmanager
def _one_thread_each() -> Generator[None]:
    """Let processes started meanwhile use one thread for XLA, which reads NPROC; joblib limits BLAS and OpenMP."""
    before = os.environ.get("NPROC")
    os.environ["NPROC"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["NPROC"]
        else:
            os.environ["NPROC"] = before


def _part(folder: Path, trial: int) -> Path:
    return folder / "trials" / f"{trial:06d}.parquet"


def _remove_unfinished(folder: Path) -> None:
    """Remove the temporary files that a killed study left behind."""
    for temporary in (folder / "trials").glob(".*.parquet"):
        temporary.unlink(missing_ok=True)


def _description(
    settings: EpisodeSettings, seed: int, vehicles: tuple[int, ...], configuration: Mapping[str, Any]
) -> dict[str, Any]:
    """Everything that the result of trial i depends on, as JSON values."""
    description = {
        "version": coverdrive.__version__,
        "seed": seed,
        "vehicles": vehicles,
        "episode": settings.model_dump(mode="json"),
        "configuration": configuration,
    }
    return json.loads(json.dumps(description))


def _claim(folder: Path, description: dict[str, Any]) -> None:
    """Say in the folder what is studied, or check that it says the same."""
    file = folder / "study.json"
    if not file.exists():
        text = json.dumps(description, indent=2, sort_keys=True)
        write_atomically(file, lambda temporary: temporary.write_text(text, encoding="utf-8"))
        return
    try:
        found = _flat(json.loads(file.read_text(encoding="utf-8")))
    except ValueError as error:
        raise DataError(f"{file} is not the description of a study ({error}); use another folder") from error
    wanted = _flat(description)
    different = sorted(key for key in found | wanted if found.get(key) != wanted.get(key))
    if different:
        changes = ", ".join(f"{key} {found.get(key)!r}, now {wanted.get(key)!r}" for key in different[:3])
        raise DataError(
            f"{folder} holds a study of another configuration ({len(different)} different: {changes}); "
            "use another folder, or go back to that configuration"
        )


def _flat(value: Any, name: str = "") -> dict[str, Any]:
    """Nested JSON objects as one object with dotted names."""
    if not isinstance(value, dict):
        return {name: value}
    flat: dict[str, Any] = {}
    for key, inner in value.items():
        flat |= _flat(inner, f"{name}.{key}" if name else key)
    return flat


def _ignore(finished: int, trials: int) -> None:
    """Report to nobody."""
