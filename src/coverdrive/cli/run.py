"""``coverdrive run``: everything, from recordings to figures."""

from pathlib import Path
from typing import TYPE_CHECKING

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
from coverdrive.progress import stages

if TYPE_CHECKING:
    from coverdrive.config import Experiment
    from coverdrive.prediction.fit import Fit


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
) -> None:
    """Do everything: learn, certify, test, drive a closed-loop study, and draw the figures.

    A run that was stopped goes on with its study where it was if it is started again with the same settings.
    """
    experiment = experiment_of(config, seed, location, trials, workers, traffic, vehicles, preset)
    result = fit_and_print(experiment, recording or [], out)
    study_and_print(experiment, out, recording)
    _draw(experiment, result, out, recording or [])
    console.print(f"Results are in {out}")


def _draw(experiment: "Experiment", result: "Fit", out: Path, recording: list[Path]) -> None:
    from coverdrive import workflow
    from coverdrive.report.figures import draw_run

    trials = workflow.load_trials(out)
    with stages() as bars:
        clips = workflow.clips_to_replay(experiment, result.predictor, out, recording)
        trace = workflow.drive(experiment, result.predictor, *workflow.liveliest(trials), clips)
        draw_run(result, trials, trace, out, bars.share("figures and video"))
