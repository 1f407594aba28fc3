"""``coverdrive run``: everything, from recordings to the report."""

from pathlib import Path
from typing import Any

from coverdrive.cli.fit import fit_and_print
from coverdrive.cli.options import (
    Config,
    Location,
    Out,
    Preset,
    Recordings,
    Seed,
    TrafficName,
    Trials,
    Vehicles,
    Workers,
    clips_reader,
    console,
    experiment_of,
)
from coverdrive.cli.study import study_and_print
from coverdrive.progress import stages


def run(
    *,
    recording: Recordings = None,
    trials: Trials = None,
    traffic: TrafficName = None,
    vehicles: Vehicles = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
    preset: Preset = "default",
    workers: Workers = None,
    location: Location = None,
) -> dict[str, Any]:
    """Do everything: learn, certify, test, drive a closed-loop study, and draw the report.

    A run that was stopped goes on with its study where it was if it is started again with the same settings.
    """
    from coverdrive.pictures import animate_trial, draw_figures, write_report
    from coverdrive.results import STUDY

    experiment = experiment_of(config, seed, location, trials, workers, traffic, vehicles, preset)
    fitted = fit_and_print(experiment, recording or [], out)
    studied = study_and_print(experiment, out, recording)
    with stages() as bars:
        clips = clips_reader(out, STUDY, recording, bars.share("recordings"))
        draw_figures(out, bars.report, clips=clips)
        animate_trial(out, bars.report, None, "mp4", clips)
        page = write_report(out, bars.report, clips=clips)
    console.print(f"Results are in {out}; look at {page}")
    return {**fitted, **studied, "report": str(page)}
