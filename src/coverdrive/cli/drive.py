"""``coverdrive drive``: one drive of a study again."""

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from coverdrive.cli.options import Config, Out, Seed, config_of, console, experiment_of
from coverdrive.progress import stages


def drive(
    *,
    trial: Annotated[int, Parameter(help="Number of the trial: it gives the start and the traffic.")] = 0,
    vehicles: Annotated[int | None, Parameter(help="Number of uncontrolled vehicles; else that of the trial.")] = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
) -> dict[str, Any]:
    """Drive one trial with the predictor in a results folder; write its trace, snapshots and a video."""
    from coverdrive import workflow
    from coverdrive.report.figures import draw_drive
    from coverdrive.report.terminal import drives_table
    from coverdrive.results import binding_of, load_predictor
    from coverdrive.simulation.storage import save_trace
    from coverdrive.simulation.trial import measure, table_of

    experiment = experiment_of(config_of(out, config), seed)
    number = vehicles or workflow.vehicles_of(experiment, trial)
    folder = out / f"drive_{trial}_{number}"
    with stages() as bars:
        bars.report("drive", 0.0)
        trace = workflow.drive(experiment, load_predictor(out), number, trial)
        save_trace(trace, folder / "trace.npz")
        bars.report("drive", 1.0)
        draw_drive(trace, folder, binding_of(experiment), bars.share("video"))
    outcome = trace.outcome
    console.print(f"{outcome.kind.value} at {outcome.time:.1f} s with {number} vehicles")
    measures = table_of([measure(trace, experiment.seed, trial)])
    console.print(drives_table(measures))
    console.print(f"Trace, snapshots and video are in {folder}")
    return {"drive": str(folder), **measures.row(0, named=True)}
