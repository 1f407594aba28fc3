"""``coverdrive run``: everything, from recordings to the report."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from coverdrive.cli import options
from coverdrive.cli.bars import stages, waiting
from coverdrive.cli.certify import compare_and_save
from coverdrive.cli.fit import fit_and_print
from coverdrive.cli.options import certificate, console, experiment_of
from coverdrive.cli.study import study_and_print


def run(
    *,
    recording: options.Recordings = None,
    epsilon: options.EpsilonOfRun = None,
    confidence: options.Confidence = None,
    unit: options.Unit = None,
    trials: options.Trials = None,
    traffic: options.TrafficName = None,
    vehicles: options.Vehicles = None,
    seed: options.Seed = None,
    out: options.Out = Path("results"),
    config: options.Config = None,
    preset: options.Preset = "default",
    workers: options.Workers = None,
    files: options.Files = options.AS_USUAL,
    settings: options.Set = None,
) -> dict[str, Any]:
    """Do everything: learn, certify, test, compare methods, drive a closed-loop study, and draw the report.

    A run that was stopped goes on with its study where it was if it is started again with the same settings.

    For example:

    - in generated traffic, to `results/`: `coverdrive run`
    - learn from recordings: `coverdrive run --recording scenarios/ --trials 100 --out us101`
    - a bolder certificate, in less time: `coverdrive run --epsilon 0.2 --set prediction.training.epochs=20`
    """
    experiment = experiment_of(
        config,
        preset,
        settings,
        usual={"prediction": certificate("auto", None, None)},
        seed=seed,
        **vars(files),
        prediction=certificate(epsilon, confidence, unit),
        study={"trials": trials, "workers": workers, "vehicles": vehicles},
        traffic={"kind": traffic},
    )
    with waiting():
        from coverdrive.reporting.report import animate_drive, draw_figures, report
        from coverdrive.results import Results, certificate_record
    results = Results(out)
    fitted = fit_and_print(experiment, recording or [], results)
    compared = compare_and_save(results)
    study = results.study(experiment, recording or [])
    studied = study_and_print(study, results, experiment.study)
    with stages():
        draw_figures(results.fitted, study)
        animate_drive(results.fitted, study)
        page = report(results.fitted, study)
    console.print(f"Results are in {out}; look at {page}")
    return {
        **certificate_record(fitted),
        "methods": [asdict(each) for each in compared],
        **studied,
        "report": str(page),
    }
