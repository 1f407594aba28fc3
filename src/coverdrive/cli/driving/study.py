"""``coverdrive study``: many drives, once or for every variant of a sweep."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from cyclopts.validators import Number

from coverdrive.cli.shared import options
from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import between, console, experiment_in, processes

if TYPE_CHECKING:
    from coverdrive.config import Experiment, StudySettings
    from coverdrive.results import Results
    from coverdrive.simulation.studies.study import Study

Cluster = Annotated[
    str | None, Parameter(help="Address of a Dask scheduler whose workers drive, as in `--cluster tcp://host:8786`.")
]


@Parameter(name="*")
@dataclass(frozen=True)
class Driven:
    """What is driven with the predictor in a results folder."""

    traffic: options.TrafficName = None
    vehicles: Annotated[options.Vehicles, Parameter(validator=Number(gte=1, lte=100))] = None
    road: options.RoadOfStudy = None
    recording: options.ToReplay = None
    seed: options.Seed = None
    config: options.Config = None

    def experiment(self, results: "Results", settings: Sequence[str] | None = None, **size: Any) -> "Experiment":
        """The settings of the folder with these; ``size`` is that of a study."""
        size |= {"vehicles": self.vehicles}
        traffic = {"kind": self.traffic}
        return experiment_in(results, self.road, self.config, settings, seed=self.seed, study=size, traffic=traffic)

    def study(self, results: "Results", experiment: "Experiment") -> "Study":
        """The study with such settings; refused if there is nothing to replay."""
        kind, recordings = experiment.traffic.kind, self.recording or []
        results.check_replay((kind,), recordings, self.road)
        return results.study(experiment, recordings, results.study_name(kind, self.road))


AS_FITTED = Driven()


def study(
    folder: options.Folder = Path("results"),
    /,
    *,
    trials: options.Trials = None,
    driven: Driven = AS_FITTED,
    until_width: Annotated[
        float | None,
        Parameter(
            validator=between(0, 1),
            help="Stop early once both 95 % intervals of the collision rates are this narrow, "
            "as in `--until-width 0.02`.",
        ),
    ] = None,
    settings: Annotated[
        options.Set,
        Parameter(
            help="Settings to vary, as in `--set planner.problem.obstacles.order=2,4`; every combination is a study."
        ),
    ] = None,
    workers: options.Workers = None,
    cluster: Cluster = None,
) -> dict[str, Any]:
    """Drive many trials with the predictor in a results folder; a study that was stopped goes on where it was.

    In replayed traffic the recordings must be those that made the predictor, of which only the test scenes are used, or
    entirely new ones.

    For example:

    - go on to as many as in the paper: `coverdrive study results --trials 1000`
    - among vehicles that react: `coverdrive study us101 --traffic drivers --vehicles 5 10`
    - on another road, with bends and a ramp: `coverdrive study us101 --traffic drivers --road curved`
    - one study for each value: `coverdrive study us101 --set planner.problem.obstacles.order=2,4`
    """
    with waiting():
        from coverdrive.results import Results
    results = Results(folder)
    experiment = driven.experiment(results, trials=trials, workers=workers, until_width=until_width)
    if settings:
        return _sweep(results, experiment, settings, driven.recording or [], driven.road, cluster)
    return study_and_print(driven.study(results, experiment), results, experiment.study, cluster)


def study_and_print(
    study: "Study", results: "Results", size: "StudySettings", cluster: str | None = None
) -> dict[str, Any]:
    """Drive the trials that are missing, and say how they went."""
    with waiting():
        from coverdrive.dialling.dial import said_of_dial
        from coverdrive.reporting.claim import proved_by
        from coverdrive.reporting.tables.study import collisions_table, drives_table, safety_table
        from coverdrive.simulation.studies.driven_on import driven_on
    _drive(study, size, cluster)
    place = driven_on(study.setup)
    console.print(place)
    trials = study.trials
    console.print(collisions_table(trials))
    console.print(safety_table(trials, results.certified.planned_against))
    console.print(drives_table(trials))
    proved = proved_by(study)
    console.print(f"• {proved}")
    for line in said_of_dial(results.dialled, study.setup):
        console.print(f"• {line}")
    for number, reason in study.unstarted.select("trial", "reason").iter_rows():
        console.print(f"• Trial {number} could not start: {reason}")
    console.print(f"One row for each trial is in {study.folder / 'trials.parquet'}")
    return {
        "results": str(study.folder),
        "driven_on": place,
        "proved": proved,
        "collisions": study.collisions.to_dicts(),
        "trials": trials.to_dicts(),
        "unstarted": study.unstarted.to_dicts(),
    }


def _sweep(
    results: "Results",
    experiment: "Experiment",
    settings: list[str],
    recording: list[Path],
    road: str | None,
    cluster: str | None,
) -> dict[str, Any]:
    """Drive a study for every combination of settings, each in its own folder, and put them into one table."""
    with waiting():
        from coverdrive.reporting.tables.study import sweep_table
        from coverdrive.results import SWEEP
        from coverdrive.sweep import sweep
    variants = {name: experiment.updated(changes) for name, changes in sweep(settings).items()}
    results.check_replay({each.traffic.kind for each in variants.values()}, recording, road)
    studies = {name: results.study(each, recording, f"{SWEEP}/{name}") for name, each in variants.items()}
    for name, study in studies.items():
        _drive(study, variants[name].study, cluster, name)
        variants[name].save(study.folder / "config.toml")
    console.print(sweep_table({name: study.trials for name, study in studies.items()}))
    folder = results.folder / SWEEP
    console.print(f"Every variant has its own folder in {folder}; two of them go to `coverdrive compare`")
    return {"sweep": {name: study.collisions.to_dicts() for name, study in studies.items()}}


def _drive(study: "Study", size: "StudySettings", cluster: str | None, name: str = "closed-loop trials") -> None:
    """Drive a study, and say which rows of it were damaged."""
    with stages(kept="finished trials"):
        study.run(
            size.trials, workers=processes(size), cluster=cluster,
            until_width=size.until_width, batch=size.batch, name=name,
        )  # fmt: skip
    for file in study.set_aside:
        console.print(f"• A row that is damaged or of another study is now {file}, and its trial was driven again")
