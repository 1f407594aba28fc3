"""The planner against a general solver in closed loop: `python benchmarks/closed_loop.py [--out closed_loop.json]`.

Both planners pose the same problem in the same trials of the paper's protocol. The baseline is
`coverdrive.planning.reference.ReferencePlanner`: a nonlinear program for each lane within reach, solved by IPOPT from
the best of simple manoeuvres and its last plans. It knows neither fallbacks nor the rule for the vehicle behind. The
studies lie in a folder named like the output; one that was stopped goes on where it was.
"""

import argparse
import json
from dataclasses import asdict
from functools import partial
from pathlib import Path

from coverdrive.config import Experiment
from coverdrive.planning.reference import ReferencePlanner, ReferenceSettings
from coverdrive.prediction.fit import fit
from coverdrive.prediction.predictor import Predictor
from coverdrive.recordings.generated import generate
from coverdrive.simulation.comparison import compare_studies
from coverdrive.simulation.study import run_study
from coverdrive.simulation.trial import Participants
from coverdrive.workflow import participants

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


def with_reference(experiment: Experiment, predictor: Predictor) -> Participants:
    ours = participants(experiment, predictor)
    settings = ReferenceSettings(problem=experiment.planner.problem, lane_change=experiment.planner.lane_change)
    return Participants(ours.predictor, ReferencePlanner(settings), ours.traffic)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--predictor", type=Path, help="file of a predictor; learnt from generated traffic if left out")
    parser.add_argument("--trials", type=int, default=40)
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
    tables = {
        name: run_study(
            partial(build, experiment, predictor),
            experiment.episode,
            folder / name,
            trials=arguments.trials,
            seed=experiment.seed,
            vehicles=experiment.study.vehicles,
            workers=arguments.workers,
            configuration={"planner": name},
            progress=lambda done, trials, name=name: print(f"{name}: {done} of {trials} trials", flush=True),
        )
        for name, build in (("reference", with_reference), ("coverdrive", participants))
    }
    comparison = compare_studies(folder / "reference", folder / "coverdrive")
    result = {
        "collisions": {name: int((table["kind"] != "finished").sum()) for name, table in tables.items()},
        "means": {name: table.select(MEASURES).mean().to_dicts()[0] for name, table in tables.items()},
        "differences, coverdrive minus reference": [
            asdict(each) for each in (*comparison.collisions, *comparison.measures)
        ],
    }
    text = json.dumps(result, indent=2)
    arguments.out.write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
