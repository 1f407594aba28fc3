"""The command ``coverdrive``: each subcommand loads only what it needs."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter
from rich.console import Console

from coverdrive import __version__
from coverdrive.errors import CoverdriveError, DataError
from coverdrive.progress import stages

Counted = Literal["window", "vehicle", "drawn window"]

if TYPE_CHECKING:
    from coverdrive.config import Experiment
    from coverdrive.prediction.fit import Fit

app = App(
    name="coverdrive",
    version=__version__,
    help="""Certified manoeuvre sets from recorded highway traffic, and planning against every member of them.

    Start with `coverdrive run`: it learns a predictor, certifies how often it misses, and drives a closed-loop study,
    in generated traffic if no recording is given. Every result is written to one folder.""",
)
console = Console()

Recordings = Annotated[
    list[Path] | None,
    Parameter(
        name="--recording",
        consume_multiple=True,
        help="Files or folders: NGSIM CSV or text, CommonRoad XML, Parquet. Without any, traffic is generated.",
    ),
]
Config = Annotated[Path | None, Parameter(help="TOML file with the settings that differ from the defaults.")]
Seed = Annotated[int | None, Parameter(help="Seed of every random choice; the same seed gives the same result.")]
Out = Annotated[Path, Parameter(help="Results folder.")]
Trials = Annotated[int | None, Parameter(help="Number of closed-loop trials; the paper has 1000.")]
Workers = Annotated[int | None, Parameter(help="Number of processes; 0: one for each processor.")]
Location = Annotated[str | None, Parameter(help="Site to take from an NGSIM file that holds several.")]


def main() -> None:
    """Run the command; errors that a user can put right are printed without a traceback."""
    complaints = Console(stderr=True, highlight=False, soft_wrap=True)
    try:
        app()
    except CoverdriveError as error:
        complaints.print("error:", style="bold red", end=" ")
        complaints.print(str(error), markup=False)
        sys.exit(2)
    except KeyboardInterrupt:
        complaints.print("stopped; finished trials are kept, and the same command goes on from them")
        sys.exit(130)


@app.command
def run(
    *,
    recording: Recordings = None,
    trials: Trials = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
    workers: Workers = None,
    location: Location = None,
) -> None:
    """Do everything: learn, certify, test, drive a closed-loop study, and draw the figures.

    A run that was stopped goes on with its study where it was if it is started again with the same settings.
    """
    experiment = _experiment(config, seed, location, trials, workers)
    result = _fit(experiment, recording or [], out)
    _study(experiment, out)
    _draw(experiment, result, out)
    console.print(f"Results are in {out}")


@app.command
def fit(
    *,
    recording: Recordings = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
    location: Location = None,
) -> None:
    """Learn a predictor from recordings, certify it, and test it on scenes that it never saw."""
    _fit(_experiment(config, seed, location), recording or [], out)
    console.print(f"The predictor is in {out}")


@app.command
def certify(
    *,
    recording: Recordings = None,
    epsilon: Annotated[tuple[float, ...], Parameter(help="Bound on the miss rate to ask for.")] = (0.05, 0.1, 0.2),
    unit: Annotated[Counted | None, Parameter(help="What the bound counts; else that of the settings.")] = None,
    out: Out = Path("results"),
    config: Config = None,
    location: Location = None,
) -> None:
    """Compare all methods of calibration on the predictor in a results folder, on the recordings that made it."""
    from coverdrive import workflow
    from coverdrive.report import style
    from coverdrive.report.risk_figure import risk_figure
    from coverdrive.report.terminal import methods_table

    experiment = _experiment(_config_of(out, config), None, location)
    predictor = workflow.load_predictor(out)
    with stages() as bars:
        recordings = workflow.load_recordings(experiment, recording or [], bars.share("recordings"))
        compared = workflow.compare_methods(experiment, predictor, recordings, epsilon, unit, bars.report)
    workflow.save_comparison(compared, out)
    console.print(methods_table(compared))
    for refused in (each for each in compared if each.refusal):
        asked = "" if refused.target is None else f" at ε = {refused.target:g}"
        console.print(f"• {refused.method.value}{asked}: {refused.refusal}")
    style.save(risk_figure(compared), out / "figures" / "methods")
    console.print(f"The comparison is in {out}")


@app.command
def study(
    *,
    trials: Trials = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
    workers: Workers = None,
) -> None:
    """Drive many trials with the predictor in a results folder; a study that was stopped goes on where it was."""
    _study(_experiment(_config_of(out, config), seed, None, trials, workers), out)


@app.command
def drive(
    *,
    trial: Annotated[int, Parameter(help="Number of the trial: it gives the start and the traffic.")] = 0,
    vehicles: Annotated[int | None, Parameter(help="Number of uncontrolled vehicles; else that of the trial.")] = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
) -> None:
    """Drive one trial with the predictor in a results folder; write its trace, snapshots and a video."""
    from coverdrive import workflow
    from coverdrive.report.figures import draw_drive
    from coverdrive.report.terminal import drives_table
    from coverdrive.simulation.storage import save_trace
    from coverdrive.simulation.trial import measure, table_of

    experiment = _experiment(_config_of(out, config), seed)
    number = vehicles or experiment.study.vehicles[trial % len(experiment.study.vehicles)]
    trace = workflow.drive(experiment, workflow.load_predictor(out), number, trial)
    folder = out / f"drive_{trial}_{number}"
    save_trace(trace, folder / "trace.npz")
    with stages() as bars:
        draw_drive(trace, folder, bars.share("video"))
    outcome = trace.outcome
    console.print(f"{outcome.kind.value} at {outcome.time:.1f} s with {number} vehicles")
    console.print(drives_table(table_of([measure(trace, experiment.seed, trial)])))
    console.print(f"Trace, snapshots and video are in {folder}")


@app.command
def basis(
    *recording: Annotated[Path, Parameter(help="Files or folders of recordings; without any, generated traffic.")],
    epsilon: Annotated[tuple[float, ...], Parameter(help="Radius of a cover.")] = (0.5, 0.75, 1.0, 2.0),
    stride: Annotated[float | None, Parameter(help="Time from one segment of a vehicle to the next [s].")] = None,
    symmetric: Annotated[bool | None, Parameter(help="With every base trajectory its mirror image.")] = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
    location: Location = None,
) -> None:
    """Cover all trajectory segments of recordings by few, for several ε, and bound how few could do."""
    from coverdrive import workflow
    from coverdrive.prediction.basis_study import study_bases
    from coverdrive.prediction.segments import cut_segments
    from coverdrive.report.figures import draw_bases
    from coverdrive.report.terminal import bases_table

    experiment = _experiment(config, seed, location).overridden(
        prediction={"segments": {"stride": stride}, "basis": {"symmetric": symmetric}}
    )
    settings = experiment.prediction
    with stages() as bars:
        recordings = workflow.load_recordings(experiment, recording, bars.share("recordings"))
        segments = cut_segments(recordings, settings.segments)
        studied = study_bases(segments, epsilon, settings.basis, experiment.seed, bars.share("bases"))
    workflow.save_bases(experiment, recordings, studied, out)
    draw_bases(studied, segments, out / "figures")
    console.print(f"{len(segments)} segments of {studied[0].basis.horizon:g} s")
    console.print(bases_table(studied))
    console.print(f"Bases and figures are in {out}")


@app.command
def inspect(
    *recording: Annotated[Path, Parameter(help="Files or folders of recordings.")], location: Location = None
) -> None:
    """Say what is in recordings: vehicles, minutes, lanes, speeds, and what had to be repaired."""
    from coverdrive.recordings.read import read
    from coverdrive.recordings.summary import summarise
    from coverdrive.report.terminal import recordings_table

    if not recording:
        raise DataError("there is nothing to inspect; name a file or folder, as in `coverdrive inspect us-101.csv`")
    with stages() as bars:
        recordings = read(recording, location=location, progress=bars.share("reading"))
    console.print(recordings_table(summarise(recordings)))


def _experiment(
    config: Path | None,
    seed: int | None = None,
    location: str | None = None,
    trials: int | None = None,
    workers: int | None = None,
) -> "Experiment":
    """The settings of a file or the defaults, with what the command line says put over them."""
    from coverdrive.config import Experiment

    experiment = Experiment.load(config) if config else Experiment()
    return experiment.overridden(seed=seed, location=location, study={"trials": trials, "workers": workers})


def _config_of(out: Path, config: Path | None) -> Path | None:
    """The given settings, or those that the results folder was made with."""
    made_with = out / "config.toml"
    return config or (made_with if made_with.exists() else None)


def _fit(experiment: "Experiment", paths: Sequence[Path], out: Path) -> "Fit":
    from coverdrive import workflow
    from coverdrive.report.terminal import fit_table

    with stages() as bars:
        recordings = workflow.load_recordings(experiment, paths, bars.share("recordings"))
        result = workflow.fit_predictor(experiment, recordings, out, bars.report)
    console.print(fit_table(result))
    for certificate in result.certificates:
        console.print(f"• {certificate.sentence}")
    return result


def _study(experiment: "Experiment", out: Path) -> None:
    from coverdrive import workflow
    from coverdrive.report.terminal import collisions_table, drives_table

    with stages() as bars:
        trials = workflow.study(experiment, workflow.load_predictor(out), out, bars.count("closed-loop trials"))
    console.print(collisions_table(trials))
    console.print(drives_table(trials))


def _draw(experiment: "Experiment", result: "Fit", out: Path) -> None:
    from coverdrive import workflow
    from coverdrive.report.figures import draw_run

    trials = workflow.load_trials(out)
    with stages() as bars:
        trace = workflow.drive(experiment, result.predictor, *workflow.liveliest(trials))
        draw_run(result, trials, trace, out, bars.share("figures and video"))
