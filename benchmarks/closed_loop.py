"""The planner against two baselines in closed loop: `python benchmarks/closed_loop.py [--out closed_loop.json]`.

All drive the same trials of the paper's protocol, with the same predictor, car and weights. The baselines
(`--baselines`) are:

- *paper*: the paper's way (`paper_way.py`), an own nonlinear program with plain ellipses for each lane within reach,
  built anew for every plan, solved by IPOPT from its last solution; no input where IPOPT fails. As an ellipse that a
  plan touches always keeps some slack, its `share_slack` says little; `share_solved` has a tolerance. It knows neither
  fallbacks nor the rule for the vehicle behind.
- *reference*: `coverdrive.planning.reference.ReferencePlanner`, the package's planner with IPOPT in place of its
  descent.

The studies lie in a folder named like the output; one that was stopped goes on where it was.
"""

import argparse
import json
from dataclasses import asdict
from functools import partial
from pathlib import Path

from coverdrive.config import Experiment
from coverdrive.planning.planner import MpcPlanner
from coverdrive.planning.reference import ReferencePlanner
from coverdrive.prediction.fit import fit
from coverdrive.prediction.predictor import Predictor
from coverdrive.simulation.comparison import compare
from coverdrive.simulation.generated import generate
from coverdrive.simulation.study import study
from paper_way import PaperPlanner

MEASURES = (
    "mean_speed",
    "lane_changes",
    "planning_median",
    "planning_p99",
    "planning_maximum",
    "share_solved",
    "share_fallback",
    "share_unsafe",
)


def coverdrive(experiment: Experiment) -> MpcPlanner:
    return MpcPlanner(experiment.planner)


def paper(experiment: Experiment) -> PaperPlanner:
    return PaperPlanner(experiment.planner.problem, experiment.planner.lane_change)


def reference(experiment: Experiment) -> ReferencePlanner:
    return ReferencePlanner(experiment.planner)


BASELINES = {"paper": paper, "reference": reference}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--predictor", type=Path, help="file of a predictor; learnt from generated traffic if left out")
    parser.add_argument("--baselines", nargs="+", choices=BASELINES, default=list(BASELINES))
    parser.add_argument("--trials", type=int, default=40)
    parser.add_argument("--duration", type=float, default=20.0, help="[s] of a trial without a collision")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("closed_loop.json"))
    arguments = parser.parse_args()
    experiment = Experiment()
    if arguments.predictor:
        predictor = Predictor.load(arguments.predictor)
    else:
        predictor = fit(
            generate(experiment.generated, experiment.seed), experiment.prediction, experiment.seed
        ).predictor
    folder = arguments.out.with_suffix("")
    studies = {
        name: study(
            predictor,
            partial(planner, experiment),
            folder=folder / name,
            trials=arguments.trials,
            vehicles=experiment.study.vehicles,
            seed=experiment.seed,
            episode=experiment.episode.model_copy(update={"duration": arguments.duration}),
            workers=arguments.workers,
        )
        for name, planner in (
            {name: BASELINES[name] for name in arguments.baselines} | {"coverdrive": coverdrive}
        ).items()
    }
    tables = {name: each.trials for name, each in studies.items()}
    result = {
        "collisions": {name: int((table["kind"] != "finished").sum()) for name, table in tables.items()},
        "means": {name: table.select(MEASURES).mean().to_dicts()[0] for name, table in tables.items()},
    }
    for name in arguments.baselines:
        comparison = compare(studies[name], studies["coverdrive"])
        result[f"differences, coverdrive minus {name}"] = [
            asdict(each) for each in (*comparison.collisions, *comparison.measures)
        ]
    text = json.dumps(result, indent=2)
    arguments.out.write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
