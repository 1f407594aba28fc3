"""``coverdrive study``, ``drive`` and ``compare``: many drives or one of them, and two studies beside each other."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from cyclopts.validators import Number

from coverdrive.cli.shared import options
from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import between, console, experiment_in, processes
from coverdrive.errors import SettingError
from coverdrive.progress import stage

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
    vehicles: options.Vehicles = None
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
            "as in `--until-width 0.02`; not for replays, which have no intervals.",
        ),
    ] = None,
    settings: Annotated[
        options.Set,
        Parameter(
            help="Settings to vary, as in `--set planner.problem.obstacles.order=2,4`; every combination, be it one, "
            "is a study of its own in sweep/, or sweep-drivers/ and the like, for `compare`."
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
        from coverdrive.simulation.traffic.replay import REPLAYS
    results = Results(folder)
    experiment = driven.experiment(results, trials=trials, workers=workers, until_width=until_width)
    if settings:
        return _sweep(results, driven, experiment, settings, cluster)
    size, usual = experiment.study, results.experiment.study.until_width
    if until_width is None and experiment.traffic.kind in REPLAYS and size.until_width == usual:
        size = size.model_copy(update={"until_width": None})  # of the folder's own traffic, which may have intervals
    return study_and_print(driven.study(results, experiment), results, size, cluster)


def study_and_print(
    study: "Study", results: "Results", size: "StudySettings", cluster: str | None = None
) -> dict[str, Any]:
    """Drive the trials that are missing, and say how they went."""
    with waiting():
        from coverdrive.dialling.dial import said_of_dial
        from coverdrive.reporting.claim import proved_by
        from coverdrive.reporting.tables.study import collisions_table, drives_table, safety_table
        from coverdrive.simulation.studies.driven_on import driven_on
    dialled, certificates = results.dialled, results.certified.planned_against  # damaged ones are told before driving
    _run(study, size, cluster)
    place = driven_on(study.setup)
    console.print(place)
    trials = study.trials
    replayed = study.setup.replays
    console.print(collisions_table(trials, replayed))
    console.print(safety_table(trials, certificates, replayed))
    console.print(drives_table(trials))
    proved, dial = proved_by(study), said_of_dial(dialled, study.setup)
    console.print(f"• {proved}")
    for line in dial:
        console.print(f"• {line}")
    for number, reason in study.unstarted.select("trial", "reason").iter_rows():
        console.print(f"• Trial {number} could not start: {reason}")
    console.print(f"One row for each trial is in {study.folder / 'trials.parquet'}")
    return {
        "results": str(study.folder),
        "driven_on": place,
        "proved": proved,
        "unlike": "".join(dial[1:]),
        "collisions": study.collisions.to_dicts(),
        "trials": trials.to_dicts(),
        "unstarted": study.unstarted.to_dicts(),
    }


def _sweep(
    results: "Results", driven: Driven, experiment: "Experiment", settings: list[str], cluster: str | None
) -> dict[str, Any]:
    """Drive a study for every combination of settings, each in its own folder, and put them into one table."""
    with waiting():
        from coverdrive.reporting.tables.study import sweep_table
        from coverdrive.results import SWEEP
        from coverdrive.sweep import sweep
    variants = {name: experiment.updated(changes) for name, changes in sweep(settings).items()}
    first = dict[str, str]()
    for name, variant in variants.items():
        if (other := first.setdefault(variant.model_dump_json(), name)) != name:
            raise SettingError(f"{other} and {name} are the same settings; leave one of them out")
    recording = driven.recording or []
    results.check_replay({each.traffic.kind for each in variants.values()}, recording, driven.road)
    within = results.study_name(experiment.traffic.kind, driven.road, SWEEP)
    studies = {name: results.study(each, recording, f"{within}/{name}") for name, each in variants.items()}
    for name, study in studies.items():
        _run(study, variants[name].study, cluster, name)
        variants[name].save(study.folder / "config.toml")
    replayed = [name for name, study in studies.items() if study.setup.replays]
    console.print(sweep_table({name: study.trials for name, study in studies.items()}, replayed))
    console.print(
        f"Every variant has its own folder in {results.folder / within}; two of them go to `coverdrive compare`"
    )
    return {"sweep": {name: study.collisions.to_dicts() for name, study in studies.items()}}


def _run(study: "Study", size: "StudySettings", cluster: str | None, name: str = "closed-loop trials") -> None:
    """Drive a study, and say which rows of it were damaged."""
    with stages(kept="finished trials"):
        study.run(
            size.trials, workers=processes(size), cluster=cluster,
            until_width=size.until_width, batch=size.batch, name=name,
        )  # fmt: skip
    for file in study.set_aside:
        console.print(f"• A row that is damaged or of another study is now {file}, and its trial was driven again")


def drive(
    folder: options.Folder = Path("results"),
    /,
    *,
    trial: Annotated[
        int,
        Parameter(
            converter=options.whole,
            validator=Number(gte=0, lte=9_999_999),
            help="Number of the trial, from 0, as in `--trial 7`: it gives the start and the traffic.",
        ),
    ] = 0,
    driven: Driven = AS_FITTED,
    settings: options.Set = None,
) -> dict[str, Any]:
    """Drive one trial with the predictor in a results folder; write its trace, snapshots and a video.

    For example:

    - a trial of the study again: `coverdrive drive us101 --trial 7`
    - among other traffic: `coverdrive drive us101 --vehicles 8 --traffic aggressive`
    """
    with waiting():
        from coverdrive.percentages import counted
        from coverdrive.reporting.drives.active_constraints import problem_of
        from coverdrive.reporting.figures.gallery import draw_drive
        from coverdrive.reporting.tables.study import drives_table
        from coverdrive.results import Results
        from coverdrive.simulation.drives.outcome import Cause
        from coverdrive.simulation.drives.storage import save_trace
        from coverdrive.simulation.measures.trial import measure
        from coverdrive.simulation.studies.driven_on import driven_on
    results = Results(folder)
    study = driven.study(results, driven.experiment(results, settings))
    setup = study.setup.loaded()
    number = setup.vehicles_of(trial)
    kept = folder / f"{study.folder.name.replace('study', 'drive', 1)}_{trial}_{number}"
    with stages():
        with stage("drive"):
            trace = setup.drive(trial)
        save_trace(trace, kept / "trace.npz")
        draw_drive(trace, kept, problem_of(study))
    result = measure(trace, setup.seed, trial)
    console.print(driven_on(setup))
    among = counted(result["vehicles"], "vehicle")
    console.print(f"{result['kind']} at {result['time']:.1f} s with {among}")
    if result["cause"] != Cause.NONE:
        console.print("at fault: {at_fault}; {cause}".format(**result))
    console.print(drives_table(study.files.table_of([result])))
    console.print(f"Trace, snapshots and video are in {kept}")
    return {"drive": str(kept), **result}


def compare(
    first: Annotated[
        Path, Parameter(help="Folder of a study, or the results folder around it, as in `results/study-drivers`.")
    ],
    second: Annotated[
        Path, Parameter(help="The same, as in `other/`; its trials must have the same seed and numbers of vehicles.")
    ],
    /,
) -> dict[str, Any]:
    """Compare two studies trial by trial: paired differences, second minus first, with 95 % intervals.

    For example:

    - two results folders: `coverdrive compare one/ other/`
    - two variants of a sweep: `coverdrive compare results/sweep/traffic.kind=drivers results/sweep/traffic.kind=mixed`
    """
    with waiting():
        from coverdrive.reporting.tables.study import comparison_table
        from coverdrive.simulation.studies.comparison import compare as compare_studies
    comparison = compare_studies(first, second)
    for name, (one, two) in comparison.settings.items():
        console.print(f"{name}: {json.dumps(one)} and {json.dumps(two)}", highlight=False, markup=False)
    console.print(comparison_table(comparison))
    return asdict(comparison)
