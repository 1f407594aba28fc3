"""``coverdrive study``: many drives, once or for every cell of a grid."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from coverdrive.cli.bars import stages, waiting
from coverdrive.cli.options import (
    Config,
    Out,
    Seed,
    ToReplay,
    TrafficName,
    Trials,
    Vehicles,
    Workers,
    config_of,
    console,
    experiment_of,
    study_name,
)

if TYPE_CHECKING:
    from coverdrive.config import Experiment

Cluster = Annotated[
    str | None, Parameter(help="Address of a Dask scheduler whose workers drive, as in tcp://host:8786.")
]


def study(
    *,
    trials: Trials = None,
    traffic: TrafficName = None,
    vehicles: Vehicles = None,
    recording: ToReplay = None,
    until_width: Annotated[
        float | None, Parameter(help="Stop early once both 95 % intervals of the collision rates are this narrow.")
    ] = None,
    settings: Annotated[
        list[str] | None,
        Parameter(
            name="--set",
            consume_multiple=True,
            help="Settings to vary, as in planner.problem.obstacles.order=2,4; every combination is a study.",
        ),
    ] = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
    workers: Workers = None,
    cluster: Cluster = None,
) -> dict[str, Any]:
    """Drive many trials with the predictor in a results folder; a study that was stopped goes on where it was.

    In replayed traffic the recordings must be those that made the predictor, of which only the test scenes are used, or
    entirely new ones.

    For example:

    - go on to as many as in the paper: `coverdrive study --trials 1000`
    - among vehicles that react: `coverdrive study --traffic drivers --vehicles 5 10`
    - one study for each value: `coverdrive study --set planner.problem.obstacles.order=2,4`
    """
    experiment = experiment_of(config_of(out, config), seed, None, trials, workers, traffic, vehicles).overridden(
        study={"until_width": until_width}
    )
    if settings:
        return _grid(experiment, settings, out, recording or [], cluster)
    return study_and_print(experiment, out, recording or [], cluster)


def study_and_print(
    experiment: "Experiment", out: Path, recording: list[Path] | None = None, cluster: str | None = None
) -> dict[str, Any]:
    """Drive the trials that are missing, and say how they went."""
    with waiting():
        from coverdrive import workflow
        from coverdrive.report.study_tables import collisions_table, drives_table, safety_table
        from coverdrive.results import load_certificates, load_predictor
        from coverdrive.simulation.statistics import collision_table
    predictor = load_predictor(out)
    name = study_name(experiment, out)
    with stages() as bars:
        clips = workflow.clips_to_replay(experiment, predictor, out, recording or [])
        progress = bars.count("closed-loop trials")
        with _trials_kept():
            trials = workflow.study(experiment, predictor, out / name, progress, clips=clips, cluster=cluster)
    console.print(collisions_table(trials))
    console.print(safety_table(trials, load_certificates(out)))
    console.print(drives_table(trials))
    console.print(f"One row for each trial is in {out / name / 'trials.parquet'}")
    return {
        "results": str(out / name),
        "collisions": collision_table(trials).to_dicts(),
        "trials": trials.to_dicts(),
    }


def _grid(
    experiment: "Experiment", settings: list[str], out: Path, recording: list[Path], cluster: str | None
) -> dict[str, Any]:
    """Drive a study for every combination of settings, each in its own folder, and put them into one table."""
    with waiting():
        from coverdrive import workflow
        from coverdrive.grid import cells_of
        from coverdrive.report.study_tables import grid_table
        from coverdrive.results import load_predictor
        from coverdrive.simulation.statistics import collision_table
    predictor = load_predictor(out)
    cells = {cell.name: experiment.overridden(**cell.changes) for cell in cells_of(settings)}
    driven = {}
    with stages() as bars, _trials_kept():
        for name, each in cells.items():
            folder = out / "grid" / name
            clips = workflow.clips_to_replay(each, predictor, out, recording)
            driven[name] = workflow.study(each, predictor, folder, bars.count(name), clips=clips, cluster=cluster)
            each.save(folder / "config.toml")
    console.print(grid_table(driven))
    console.print(f"Every cell has its own folder in {out / 'grid'}; two of them go to `coverdrive compare`")
    return {"grid": {name: collision_table(trials).to_dicts() for name, trials in driven.items()}}


@contextmanager
def _trials_kept() -> Generator[None]:
    """Let somebody who stops the trials know that they are not lost."""
    try:
        yield
    except KeyboardInterrupt as stop:
        stop.add_note("finished trials are kept, and the same command goes on from them")
        raise
