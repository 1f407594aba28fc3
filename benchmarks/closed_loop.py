"""What predictions and plans are worth in closed loop: `python benchmarks/closed_loop.py --recording PATH …`.

All rows drive the same trials in every traffic; where traffic draws from predicted sets, from those of the default.
Rows of predictors have the default planner:

- *default*: the predictor of `coverdrive fit`; *paper*: that of the paper's preset, from the same split.
- *constant-velocity-box*: constant velocity in one conformal box, certified on the same vehicles for the same claim.
- *members*: the members of the default's sets without anything around them; *constant-velocity*: bodies that keep their
  velocity; *known-future*: in replayed traffic, what recorded vehicles will do. All three are bodies alone.

Rows of planners, driven if they are named with `--rows`, have the default predictor:

- *paper-planner*: the paper's way (`paper_way.py`), an own nonlinear program with plain ellipses for each lane within
  reach, built anew for every plan, solved by IPOPT from its last solution; no input where IPOPT fails. `share_solved`
  has a tolerance. It knows neither fallbacks nor the rule for the vehicle behind.
- *reference-planner*: the package's planner with IPOPT in place of its descent (`coverdrive.planning.reference`).

Of recordings the test scenes alone are replayed; without any, all is about generated traffic. Fits and studies lie in a
folder named like the output; what was stopped goes on where it was. Intervals are of 95 %; differences are paired.
"""

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from coverdrive.config import Experiment
from coverdrive.planning.planner import PlannerSettings
from coverdrive.planning.reference import ReferencePlanner
from coverdrive.prediction.fit import PredictionSettings, cut_and_split, fit
from coverdrive.prediction.occupied import trivial_box
from coverdrive.prediction.predictor import AnyPredictor
from coverdrive.recordings.recording import Recording
from coverdrive.results import Results
from coverdrive.simulation.comparison import newcombe_interval, paired_t
from coverdrive.simulation.setup import AnyPlanner, Setup
from coverdrive.simulation.statistics import COUNTED, collision_table, miss_rate
from coverdrive.simulation.study import Study
from paper_way import PaperPlanner
from simple_predictors import AnyBelief, ConstantVelocity, Ego, KnownFuture, Members

TRAFFICS = {"set-sampling": None, "drivers": None, "aggressive": (8, 10, 12), "mixed": None, "replay": None}
"""and numbers of vehicles, where they are not the paper's"""
MEASURES = (
    "mean_speed", "share_unsafe", "share_rear", "share_solved", "share_fallback", "jerk_longitudinal", "jerk_lateral",
    "lane_changes", "planning_median", "planning_p99", "planning_maximum",
)  # fmt: skip


def paper_planner(settings: PlannerSettings) -> PaperPlanner:
    return PaperPlanner(settings.problem, settings.lane_change)


PLANNERS: dict[str, Callable[[PlannerSettings], AnyPlanner]] = {
    "paper-planner": paper_planner,
    "reference-planner": ReferencePlanner,
}
PREDICTORS = ("paper", "constant-velocity-box", "members", "constant-velocity", "known-future")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recording", type=Path, nargs="+", default=[])
    parser.add_argument("--fit", type=Path, help="results of `coverdrive fit`; made if there are none")
    parser.add_argument("--paper-fit", type=Path, help="the same of the paper's preset")
    parser.add_argument("--traffic", nargs="+", choices=TRAFFICS, default=list(TRAFFICS))
    parser.add_argument("--rows", nargs="+", choices=(*PREDICTORS, *PLANNERS), default=list(PREDICTORS))
    parser.add_argument("--trials", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0, help="of the drives")
    parser.add_argument("--duration", type=float, default=20.0, help="[s] of a trial without a collision")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("closed_loop.json"))
    chosen = parser.parse_args()
    folder = chosen.out.with_suffix("")
    default = Results(chosen.fit or folder / "fit")
    experiment = default.experiment if default.holds_fit else Experiment()
    recordings = experiment.recordings(chosen.recording)
    fitted(default, recordings, experiment)
    paper = Results(chosen.paper_fit or folder / "paper-fit")
    beliefs = believed(default, paper, recordings, chosen.rows)
    result: dict[str, dict[str, Any]] = {}
    for traffic in chosen.traffic:
        drives = experiment.updated({
            "seed": chosen.seed,
            "traffic": {"kind": traffic},
            "episode": {"duration": chosen.duration},
            "study": {"vehicles": TRAFFICS[traffic]},
        })  # fmt: skip
        setup = default.study(drives, chosen.recording).setup.loaded()
        usual = pl.DataFrame()
        for row in ("default", *chosen.rows):
            if row == "known-future" and not setup.replays:
                continue
            study = Study(set_up(row, setup, default.predictor, beliefs, drives.planner), folder / traffic / row)
            trials = study.run(chosen.trials, workers=chosen.workers).trials
            usual = trials if row == "default" else usual
            result.setdefault(traffic, {})[row] = measured(trials) | {"minus default": differences(usual, trials)}
            print(told(traffic, row, result[traffic][row]), flush=True)
            chosen.out.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")


def fitted(results: Results, recordings: Sequence[Recording], experiment: Experiment) -> None:
    """Fit unless that was done."""
    if not results.holds_fit:
        results.save_fit(experiment, fit(recordings, experiment.prediction, experiment.seed))


def believed(
    default: Results, paper: Results, recordings: Sequence[Recording], rows: Sequence[str]
) -> dict[str, AnyBelief]:
    """What the ego believes in each of the rows that do so in every traffic."""
    experiment = default.experiment
    settings = experiment.prediction
    segments, sides = cut_and_split(recordings, settings, experiment.seed)
    if "paper" in rows:
        cut = {"segments": settings.segments, "split": settings.split}
        changed = PredictionSettings.paper().model_copy(update=cut)
        fitted(paper, recordings, experiment.model_copy(update={"prediction": changed}))
    trained_on = np.unique(segments.vehicle[sides.train])
    for each in (default, paper) if "paper" in rows else (default,):
        if not np.array_equal(each.predictor.trained_on, trained_on):
            raise SystemExit(f"{each.folder} was fitted on other recordings or with another split; give these")
    box, _ = trivial_box(segments, sides, settings.certificate, default.predictor.certificate, experiment.seed)
    beliefs: dict[str, AnyBelief] = {
        "constant-velocity-box": ConstantVelocity(box, segments.step),
        "members": Members(default.predictor),
        "constant-velocity": ConstantVelocity(np.zeros_like(box), segments.step),
    }
    if "paper" in rows:
        beliefs["paper"] = paper.predictor
    return beliefs


def set_up(
    row: str, setup: Setup, default: AnyPredictor, beliefs: dict[str, AnyBelief], settings: PlannerSettings
) -> Setup:
    """The setup of a row, for that of the default."""
    if row == "default":
        return setup
    if row in PLANNERS:
        return replace(setup, planner=partial(PLANNERS[row], settings))
    if row == "known-future":
        assert not callable(setup.scenarios)  # they were loaded
        return replace(setup, predictor=Ego(KnownFuture(setup.scenarios), default))
    return replace(setup, predictor=Ego(beliefs[row], default))


def measured(trials: pl.DataFrame) -> dict[str, Any]:
    """Collisions and misses with intervals, and means of all else."""
    misses = miss_rate(trials, "prediction_misses", "windows")._asdict() if trials["windows"].sum() else None
    return collision_table(trials).row(-1, named=True) | trials.select(MEASURES).mean().row(0, named=True) | {
        "windows missed": misses
    }  # fmt: skip


def differences(usual: pl.DataFrame, trials: pl.DataFrame) -> dict[str, dict[str, float]]:
    """Mean differences to the default, trial by trial, with intervals; of collisions that of their rates."""
    both = usual.join(trials, on="trial", suffix=" of row")
    found: dict[str, dict[str, float]] = {}
    for name in MEASURES if both.height > 1 else ():
        difference = (both[f"{name} of row"] - both[name]).to_numpy().astype(float)
        low, high, _ = paired_t(difference, 0.95)
        found[name] = {"mean": float(difference.mean()), "low": low, "high": high}
    for name, kinds in COUNTED.items():
        ours, theirs = (both[column].is_in(kinds).to_numpy() for column in ("kind", "kind of row"))
        low, high = newcombe_interval(ours, theirs, 0.95)
        found[name] = {"mean": float(theirs.mean() - ours.mean()), "low": low, "high": high}
    return found


def told(traffic: str, row: str, values: dict[str, Any]) -> str:
    """A row of the table, with differences in brackets."""

    def changed(name: str, factor: float, form: str) -> str:
        each = values["minus default"].get(name)
        shown = f"{values[name] * factor:{form}}"
        if row == "default" or each is None:
            return shown
        return f"{shown} [{each['low'] * factor:+{form}} … {each['high'] * factor:+{form}}]"

    collisions = ", ".join(
        f"{name} {values[name]} ({values[f'{name}_low']:.1%}–{values[f'{name}_high']:.1%})" for name in COUNTED
    )
    misses = values["windows missed"]
    missed = "none seen" if misses is None else f"{misses['missed'] / misses['total']:.2%}"
    return (
        f"{traffic:12} {row:21} {values['trials']} drives: {collisions}; {changed('mean_speed', 1, '.2f')} m/s; unsafe "
        f"{changed('share_unsafe', 100, '.2f')} %, rear {changed('share_rear', 100, '.2f')} %; jerk along "
        f"{changed('jerk_longitudinal', 1, '.2f')}, across {changed('jerk_lateral', 1, '.2f')} m/s³; windows missed "
        f"{missed}"
    )


if __name__ == "__main__":
    main()
