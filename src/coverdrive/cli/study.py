"""``coverdrive study``: many drives."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from coverdrive.cli.options import Config, Out, Seed, Trials, Workers, config_of, console, experiment_of
from coverdrive.progress import stages

if TYPE_CHECKING:
    from coverdrive.config import Experiment


def study(
    *,
    trials: Trials = None,
    seed: Seed = None,
    out: Out = Path("results"),
    config: Config = None,
    workers: Workers = None,
) -> dict[str, Any]:
    """Drive many trials with the predictor in a results folder; a study that was stopped goes on where it was."""
    return study_and_print(experiment_of(config_of(out, config), seed, None, trials, workers), out)


def study_and_print(experiment: "Experiment", out: Path) -> dict[str, Any]:
    """Drive the trials that are missing, and say how they went."""
    from coverdrive import workflow
    from coverdrive.report.terminal import collisions_table, drives_table
    from coverdrive.results import load_predictor
    from coverdrive.simulation.statistics import collision_table

    with stages() as bars:
        trials = workflow.study(experiment, load_predictor(out), out, bars.count("closed-loop trials"))
    console.print(collisions_table(trials))
    console.print(drives_table(trials))
    return {
        "results": str(out),
        "collisions": collision_table(trials).to_dicts(),
        "trials": trials.to_dicts(),
    }
