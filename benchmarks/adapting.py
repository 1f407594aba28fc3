"""A car's life in changing traffic: `python benchmarks/adapting.py [--predictor FILE] [--drives 150] [--out FILE]`.

Drives of 20 s on the paper's road, one after another: among drivers, then among aggressive ones (8 to 12 vehicles),
then among drivers again. Everybody begins every drive alike: sets of fixed scales λ, and sets that adapt so that 10 %
of the windows near the ego are lost in the long run. Without a predictor, one is fitted to generated traffic.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import polars as pl

from coverdrive.dialling.adapting import life
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.prediction.adaptive import Adaptive
from coverdrive.prediction.fit import fit
from coverdrive.prediction.predictor import Predictor
from coverdrive.simulation.drivers.generated import generate
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.measures.notable import COLLIDED, OWN_FAULT
from coverdrive.simulation.measures.statistics import miss_rate
from coverdrive.simulation.roads.initial import VEHICLES
from coverdrive.simulation.roads.places import PLACES
from coverdrive.simulation.studies.comparison import mean_interval
from coverdrive.simulation.studies.setup import Setup

PHASES = (("drivers", VEHICLES, 0), ("aggressive", (8, 9, 10, 11, 12), 0), ("drivers", VEHICLES, 1))
"""traffic, numbers of vehicles, and how many times as many trials of it were driven before"""
MOVING = 30
"""drives of the moving average, 10 min"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--predictor", type=Path)
    parser.add_argument("--drives", type=int, default=150, help="of each phase")
    parser.add_argument("--fixed", type=float, nargs="*", default=[1.0])
    parser.add_argument("--missed", type=float, default=0.1)
    parser.add_argument("--duration", type=float, default=20.0)
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args()
    predictor = (Predictor.load(chosen.predictor) if chosen.predictor else fit(generate()).predictor).scaled(1.0)
    beliefs = {"adaptive": Adaptive(predictor, chosen.missed)}
    beliefs |= {f"λ = {scale:g}": predictor.scaled(scale) for scale in chosen.fixed}
    planner = MpcPlanner(PlannerSettings.model_validate(PLACES["paper"].parts["planner"]))
    episode, result = EpisodeSettings(duration=chosen.duration), dict[str, dict]()
    for name, belief in beliefs.items():
        lives = list[pl.DataFrame]()
        result[name] = {}
        for number, (traffic, vehicles, before) in enumerate(PHASES, start=1):
            setup = Setup(belief, planner, traffic, episode, vehicles)
            lives.append(life(setup, chosen.drives, before * chosen.drives))
            result[name][f"{number} {traffic}"] = told(lives[-1])
            print(name, json.dumps(result[name][f"{number} {traffic}"], indent=2), flush=True)
        whole = pl.concat(lives)
        result[name]["whole"] = told(whole) | {"bound": whole["bound"].to_list()[-1]}
        print(name, json.dumps(result[name]["whole"], indent=2), flush=True)
        if chosen.out is not None:
            chosen.out.write_text(json.dumps(result, indent=2), encoding="utf-8")


def told(drives: pl.DataFrame) -> dict[str, object]:
    """What is told of some drives, with 95 % intervals over drives."""
    share, speed = miss_rate(drives, "near_missed", "near"), drives["mean_speed"].to_numpy()
    lost, seen = (np.cumsum([0, *drives[name].to_list()]) for name in ("near_missed", "near"))
    moving = (lost[MOVING:] - lost[:-MOVING]) / np.maximum(1, seen[MOVING:] - seen[:-MOVING])
    return {
        "drives": drives.height,
        "windows near the ego": int(seen[-1]),
        "missed": [share.count / max(1, share.total), share.low, share.high],
        "moving average of 10 min": [moving.min(), moving.max()] if len(moving) else None,
        "λ after a drive": np.quantile(drives["scale"].to_numpy(), [0.05, 0.5, 0.95]).tolist(),
        "mean speed m/s": [float(speed.mean()), *mean_interval(speed, 0.95)],
        "collisions": int(drives.select(COLLIDED.sum()).item()),
        "at the ego's fault": int(drives.select(OWN_FAULT.sum()).item()),
        "share of plans without a clear way": float(drives["share_unsafe"].to_numpy().mean()),
    }


if __name__ == "__main__":
    main()
