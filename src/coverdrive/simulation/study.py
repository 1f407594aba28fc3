"""Many seeded trials, on several processes, resumable (paper §5: 1000 trials, 200 each for 3 to 7 vehicles).

Trial i has its own seed, so the results do not depend on the number of processes nor on the order in which trials
finish. Files in the folder of a study: ``study.json`` says what is studied, ``trials/`` holds one row per finished
trial, ``trials.parquet`` all rows together. Only the process that runs the study writes them, so that workers may be
on other machines (`coverdrive.simulation.workers`).
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import polars as pl

import coverdrive
from coverdrive.errors import DataError, SettingError
from coverdrive.files import write_atomically
from coverdrive.simulation.episode import EpisodeSettings
from coverdrive.simulation.statistics import widest_interval
from coverdrive.simulation.trial import Build, table_of
from coverdrive.simulation.workers import Task, run_tasks

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
    cluster: str | None = None,
    until_width: float | None = None,
    batch: int = 50,
    configuration: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> pl.DataFrame:
    """Run all trials that ``folder`` does not hold yet; a study that was killed goes on where it was.

    A study may be continued with more trials: the first ones stay the same.

    Args:
        build: makes predictor, planner and traffic, once in every process.
        settings: of every episode.
        folder: of this study and no other; made as needed.
        trials: number of trials; the largest, if the study may stop early.
        seed: of the study; trial i draws from ``SeedSequence(seed, spawn_key=(i,))``.
        vehicles: numbers of uncontrolled vehicles; trial i has the i-th of them, over and over.
        workers: number of processes, each on one thread; with 1, trials run in this process.
        cluster: address of a Dask scheduler whose workers run the trials instead, as in ``tcp://host:8786``.
        until_width: stop once both 95 % intervals of `collision_table` are at most this wide for all trials. This is
            decided after whole batches in the order of trials, so that it does not depend on the workers.
        batch: number of trials of a batch.
        configuration: what ``build`` was made from, as JSON values; a folder refuses another configuration.
        progress: called before the first trial and after each.

    Returns:
        One row per trial, ascending; the columns are `coverdrive.simulation.trial.TrialResult`'s fields.

    Raises:
        SettingError: fewer than one trial, worker or trial of a batch, no number of vehicles, or no cluster there.
        DataError: the folder holds a study of another configuration.
    """
    if min(trials, workers, batch) < 1 or not vehicles:
        raise SettingError(
            f"a study needs at least one trial, worker, trial of a batch and number of vehicles; got {trials} trials, "
            f"{workers} workers, batches of {batch} and {len(vehicles)} numbers of vehicles"
        )
    _claim(folder, _description(settings, seed, vehicles, configuration or {}))
    _remove_unfinished(folder)
    report = progress or _ignore
    table = table_of([])
    for batch_end in range(batch, trials + batch, batch) if until_width else [trials]:
        end = min(batch_end, trials)
        pending = [trial for trial in range(end) if not _part(folder, trial).exists()]
        finished = end - len(pending)
        report(finished, trials)
        tasks = [Task(settings, vehicles[trial % len(vehicles)], seed, trial) for trial in pending]
        for result in run_tasks(build, tasks, workers, cluster):
            write_atomically(_part(folder, result.trial), table_of([result]).write_parquet)
            finished += 1
            report(finished, trials)
        table = pl.concat([pl.read_parquet(_part(folder, trial)) for trial in range(end)])
        if until_width and widest_interval(table) <= until_width:
            break
    write_atomically(folder / "trials.parquet", table.write_parquet)
    return table


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
        found = flat(json.loads(file.read_text(encoding="utf-8")))
    except ValueError as error:
        raise DataError(f"{file} is not the description of a study ({error}); use another folder") from error
    wanted = flat(description)
    different = sorted(key for key in found | wanted if found.get(key) != wanted.get(key))
    if different:
        changes = ", ".join(f"{key} {found.get(key)!r}, now {wanted.get(key)!r}" for key in different[:3])
        raise DataError(
            f"{folder} holds a study of another configuration ({len(different)} different: {changes}); "
            "use another folder, or go back to that configuration"
        )


def flat(value: Any, name: str = "") -> dict[str, Any]:
    """Nested JSON objects as one object with dotted names."""
    if not isinstance(value, dict):
        return {name: value}
    leaves: dict[str, Any] = {}
    for key, inner in value.items():
        leaves |= flat(inner, f"{name}.{key}" if name else key)
    return leaves


def _ignore(finished: int, trials: int) -> None:
    """Report to nobody."""
