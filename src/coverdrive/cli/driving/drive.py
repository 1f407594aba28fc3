"""``coverdrive drive``: one drive of a study again."""

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter
from cyclopts.validators import Number

from coverdrive.cli.driving.study import AS_FITTED, Driven
from coverdrive.cli.shared import options
from coverdrive.cli.shared.bars import stages, waiting
from coverdrive.cli.shared.options import console
from coverdrive.progress import stage


def drive(
    folder: options.Folder = Path("results"),
    /,
    *,
    trial: Annotated[
        int,
        Parameter(
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
        from coverdrive.reporting.drives.active_constraints import problem_of
        from coverdrive.reporting.figures.gallery import draw_drive
        from coverdrive.reporting.tables.study import drives_table
        from coverdrive.results import Results
        from coverdrive.simulation.drives.outcome import Cause
        from coverdrive.simulation.drives.storage import save_trace
        from coverdrive.simulation.measures.trial import measure, table_of
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
    console.print("{kind} at {time:.1f} s with {vehicles} vehicles".format(**result))
    if result["cause"] != Cause.NONE:
        console.print("at fault: {at_fault}; {cause}".format(**result))
    console.print(drives_table(table_of([result])))
    console.print(f"Trace, snapshots and video are in {kept}")
    return {"drive": str(kept), **result}
