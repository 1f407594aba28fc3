"""Time of one prediction: `python benchmarks/prediction.py [--predictor FILE] [--vehicles 8] [--out prediction.json]`.

The scenes are moments of generated traffic, of which the vehicles nearest to an ego are left; all others of a scene are
predicted, as the planner asks for it, one call after the other. Without a predictor, one is trained for a few steps:
how long does not depend on what it has learned.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.prediction.boxes.training import BoxSettings
from coverdrive.prediction.fit import PredictionSettings, fit
from coverdrive.prediction.predictor import Predictor
from coverdrive.scene import Scene
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--predictor", type=Path)
    parser.add_argument("--vehicles", type=int, default=8)
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args()
    recordings = generate(GeneratedSettings(scenes=12))
    quick = PredictionSettings(boxes=BoxSettings(most_steps=20, few=0))
    predictor = Predictor.load(chosen.predictor) if chosen.predictor else fit(recordings, quick).predictor
    random, like = np.random.default_rng(0), ProblemSettings()
    seconds = list[float]()
    for number in range(chosen.scenes + 20):
        recording = recordings[number % len(recordings)]
        scene = nearest(recording.scene_at(random.uniform(0.5, 19)), chosen.vehicles + 1, random)
        begun = time.perf_counter()
        predictor.predict(scene, recording.road, ego=0, like=like)
        seconds.append(time.perf_counter() - begun)
    values = 1e3 * np.array(seconds[20:])  # the first ones compile
    result = {
        "vehicles": chosen.vehicles,
        "scenes": chosen.scenes,
        "median ms": float(np.median(values)),
        "lowest tenth ms": float(np.quantile(values, 0.1)),
        "p99 ms": float(np.quantile(values, 0.99)),
    }
    print(json.dumps(result, indent=2))
    if chosen.out is not None:
        chosen.out.write_text(json.dumps(result, indent=2), encoding="utf-8")


def nearest(scene: Scene, count: int, random: np.random.Generator) -> Scene:
    """A vehicle, which comes first, and those nearest to it along the road."""
    apart = np.abs(scene.lon - scene.lon[random.integers(scene.vehicles)])
    kept = np.argsort(apart, kind="stable")[:count]
    return Scene(**{name: values[kept] for name, values in vars(scene).items()})


if __name__ == "__main__":
    main()
