"""``coverdrive drive``: one drive of a study again."""

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from coverdrive.cli.bars import stages, waiting
from coverdrive.cli.options import (
    Config,
    Out,
    Seed,
    ToReplay,
    TrafficName,
    config_of,
    console,
    experiment_of,
    study_name,
)


def drive(
    *,
    trial: Annotated[int, Parameter(help="Number of the trial: it gives the start and the traffic.")] = 0,
    vehicles: Annotated[int | None, Parameter(help="Number of uncontrolled vehicles; else that of the trial.")] = None,
    traffic: TrafficName = None,
    recording: ToReplay = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
) -> dict[str, Any]:
    """Drive one trial with the predictor in a results folder; write its trace, snapshots and a video.

    For example:

    - a trial of the study again: `coverdrive drive --trial 7`
    - among other traffic: `coverdrive drive --vehicles 8 --traffic aggressive`
    """
    experiment = experiment_of(config_of(out, config), seed, traffic=traffic)
    with waiting():
        from coverdrive import workflow
        from coverdrive.report.figures import draw_drive
        from coverdrive.report.study_tables import drives_table
        from coverdrive.results import binding_of, load_predictor
        from coverdrive.simulation.outcome import Cause
        from coverdrive.simulation.storage import save_trace
        from coverdrive.simulation.trial import measure, table_of
    number = vehicles or workflow.vehicles_of(experiment, trial)
    predictor = load_predictor(out)
    folder = out / study_name(experiment, out).replace("study", "drive")
    folder = folder.with_name(f"{folder.name}_{trial}_{number}")
    with stages() as bars:
        clips = workflow.clips_to_replay(experiment, predictor, out, recording or [])
        bars.report("drive", 0.0)
        trace = workflow.drive(experiment, predictor, number, trial, clips, bars.share("drive"))
        bars.report("drive", 1.0)
        save_trace(trace, folder / "trace.npz")
        bars.report("video", 0.0)
        draw_drive(trace, folder, binding_of(experiment), bars.share("video"))
    result = measure(trace, experiment.seed, trial)
    console.print(f"{result.kind} at {result.time:.1f} s with {result.vehicles} vehicles")
    if result.cause != Cause.NONE.value:
        console.print(f"at fault: {result.at_fault}; {result.cause}")
    measures = table_of([result])
    console.print(drives_table(measures))
    console.print(f"Trace, snapshots and video are in {folder}")
    return {"drive": str(folder), **measures.row(0, named=True)}
