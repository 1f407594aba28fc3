"""``coverdrive run``: everything, from recordings to the report."""

from pathlib import Path
from typing import Any

from coverdrive.cli.fit import fit_and_print
from coverdrive.cli.options import Config, Location, Out, Recordings, Seed, Trials, Workers, console, experiment_of
from coverdrive.cli.study import study_and_print
from coverdrive.progress import stages


def run(
    *,
    recording: Recordings = None,
    trials: Trials = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
    workers: Workers = None,
    location: Location = None,
) -> dict[str, Any]:
    """Do everything: learn, certify, test, drive a closed-loop study, and draw the report.

    A run that was stopped goes on with its study where it was if it is started again with the same settings.
    """
    from coverdrive.pictures import animate_trial, draw_figures, write_report

    experiment = experiment_of(config, seed, location, trials, workers)
    fitted = fit_and_print(experiment, recording or [], out)
    studied = study_and_print(experiment, out)
    with stages() as bars:
        draw_figures(out, bars.report)
        animate_trial(out, bars.report, None, "mp4")
        page = write_report(out, bars.report)
    console.print(f"Results are in {out}; look at {page}")
    return {**fitted, **studied, "report": str(page)}
