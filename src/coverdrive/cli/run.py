"""``coverdrive run``: everything, from recordings to the report."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coverdrive.cli.bars import stages, waiting
from coverdrive.cli.fit import fit_and_print
from coverdrive.cli.options import (
    TARGETS,
    Confidence,
    Config,
    EpsilonOfRun,
    Location,
    Out,
    Preset,
    Recordings,
    Seed,
    Set,
    TrafficName,
    Trials,
    Unit,
    Vehicles,
    Workers,
    certificate,
    clips_reader,
    console,
    experiment_of,
)
from coverdrive.cli.study import study_and_print

if TYPE_CHECKING:
    from coverdrive.certificates.comparison import Compared
    from coverdrive.config import Experiment
    from coverdrive.prediction.fit import Fit


def run(
    *,
    recording: Recordings = None,
    epsilon: EpsilonOfRun = None,
    confidence: Confidence = None,
    unit: Unit = None,
    trials: Trials = None,
    traffic: TrafficName = None,
    vehicles: Vehicles = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
    preset: Preset = "default",
    workers: Workers = None,
    location: Location = None,
    settings: Set = None,
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
        location=location,
        prediction=certificate(epsilon, confidence, unit),
        study={"trials": trials, "workers": workers, "vehicles": vehicles},
        traffic={"kind": traffic},
    )
    with waiting():
        from coverdrive.pictures import animate_trial, draw_figures, write_report
        from coverdrive.records import certificate_record
        from coverdrive.results import STUDY
    fitted = fit_and_print(experiment, recording or [], out)
    compared = _compare(experiment, fitted, out)
    studied = study_and_print(experiment, out, recording)
    with stages() as bars:
        clips = clips_reader(out, STUDY, recording, bars.share("recordings"))
        draw_figures(out, bars.report, clips=clips)
        animate_trial(out, bars.report, None, "mp4", clips)
        page = write_report(out, bars.report, clips=clips)
    console.print(f"Results are in {out}; look at {page}")
    return {
        **certificate_record(fitted),
        "methods": [asdict(each) for each in compared],
        **studied,
        "report": str(page),
    }


def _compare(experiment: "Experiment", fitted: "Fit", out: Path) -> "list[Compared]":
    """Compare all methods of calibration on the scores that the fit has made."""
    from coverdrive import workflow

    with stages() as bars:
        compared = workflow.compare_methods(experiment, fitted.predictor, fitted.scored, TARGETS, progress=bars.report)
        workflow.save_comparison(compared, fitted.predictor, out)
    console.print(f"• All methods of calibration are compared in {out / 'methods.csv'}")
    return compared
