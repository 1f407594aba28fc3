"""``coverdrive run``: everything, from recordings to the report."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from coverdrive.cli.bars import stages, waiting
from coverdrive.cli.certify import compare_and_save
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
    console,
    experiment_of,
)
from coverdrive.cli.study import study_and_print


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
    """Do everything: learn, certify, test, compare methods, drive a closed-loop study, and draw the report.

    A run that was stopped goes on with its study where it was if it is started again with the same settings.

    For example:

    - in generated traffic, to `results/`: `coverdrive run`
    - learn from recordings: `coverdrive run --recording scenarios/ --trials 100 --out us101`
    """
    experiment = experiment_of(config, seed, location, trials, workers, traffic, vehicles, preset)
    with waiting():
        from coverdrive.report.report import animate_drive, draw_figures, report
        from coverdrive.results import Results, certificate_record
    results = Results(out)
    fitted = fit_and_print(experiment, recording or [], results)
    compared = compare_and_save(results)
    study = results.study(experiment, recording or [])
    studied = study_and_print(study, results, experiment.study)
    with stages():
        draw_figures(results, study)
        animate_drive(results, study)
        page = report(results, study)
    console.print(f"Results are in {out}; look at {page}")
    return {
        **certificate_record(fitted),
        "methods": [asdict(each) for each in compared],
        **studied,
        "report": str(page),
    }
