"""Closed-loop steps per second: `python benchmarks/drives.py --baseline OTHER_CHECKOUT/src [--out drives.json]`.

The same trials are driven and measured with this package and with that of another checkout, in turn, on the same core.
Each has two processes, ours the first and the last to begin, since of the same code one process may be 7 % slower than
another. What counts is processor time, and the first trial of every number of vehicles, which compiles, does not; of
several repeats of a trial the fastest counts, as whatever else runs slows others. Rows are equal if all columns that
both have are, those of times apart. Without a predictor, one is trained for a few steps; a baseline that cannot read
its file needs one of its own (`--baseline-predictor`).
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

TRAFFICS = {"drivers": (3, 4, 5, 6, 7), "set-sampling": (3, 4, 5, 6, 7), "aggressive": (8, 9, 10, 11, 12)}
OURS = Path(__file__).parents[1] / "src"


def serve(file: Path) -> None:
    """Drive what is asked for, line by line, with the package that this process finds, as a worker of a study does."""
    from coverdrive.prediction.predictor import Predictor

    room = "simulation.studies" if find_spec("coverdrive.simulation.studies") else "simulation"  # up to 0.1.0
    Setup = import_module(f"coverdrive.{room}.setup").Setup
    _run_in_worker = import_module(f"coverdrive.{room}.workers")._run_in_worker

    predictor = Predictor.load(file)
    setups = {name: Setup(predictor, traffic=name, vehicles=vehicles) for name, vehicles in TRAFFICS.items()}
    for line in sys.stdin:
        traffic, trial = json.loads(line)
        begun = time.process_time()
        row = _run_in_worker(setups[traffic], traffic, trial)
        seconds, steps = time.process_time() - begun, round(row["time"] / setups[traffic].episode.step)
        print(json.dumps({"row": row, "steps": steps, "seconds": seconds}), flush=True)


class Checkout:
    """A process that drives with the package of a checkout."""

    def __init__(self, source: Path, predictor: Path):
        command = [sys.executable, __file__, "--serve", str(predictor)]
        environment = os.environ | {"PYTHONPATH": str(source), "NPROC": "1", "OMP_NUM_THREADS": "1"}
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
        )

    def drive(self, traffic: str, trial: int) -> dict[str, Any]:
        """Row, number of steps and processor time [s] of a trial."""
        assert self._process.stdin is not None and self._process.stdout is not None
        print(json.dumps([traffic, trial]), file=self._process.stdin, flush=True)
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError("the process of a checkout has ended")
        return json.loads(line)

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


def same(ours: dict[str, Any], theirs: dict[str, Any]) -> bool:
    """Whether two rows agree but for times."""
    names = [name for name in ours if name in theirs and not name.startswith("planning_")]
    return all(ours[name] == theirs[name] for name in names)


def compared(checkouts: list[Checkout], traffic: str, trials: int, repeats: int) -> dict[str, Any]:
    """Our steps per second, the baseline's, and their ratio with the spread over the trials.

    Of the processes the first and the last drive with ours.
    """
    kinds = len(TRAFFICS[traffic])
    for trial in range(min(kinds, trials)):
        for checkout in checkouts:
            checkout.drive(traffic, trial)
    pairs = list[list[dict[str, Any]]]()
    for trial in range(kinds, kinds + trials):
        driven = [[each.drive(traffic, trial) for each in checkouts] for _ in range(repeats)]
        first, second, third, last = zip(*driven, strict=True)
        pairs.append([min(drives, key=lambda drive: drive["seconds"]) for drives in (first + last, second + third)])
    steps = np.array([[each["steps"] for each in pair] for pair in pairs])
    seconds = np.array([[each["seconds"] for each in pair] for pair in pairs])
    ours, baseline = (steps.sum(0) / seconds.sum(0)).tolist()
    ratios = (steps / seconds)[:, 0] / (steps / seconds)[:, 1]
    return {
        "steps per second": ours,
        "steps per second of the baseline": baseline,
        "ratio": ours / baseline,
        "ratio of a trial, quartiles": np.quantile(ratios, [0.25, 0.5, 0.75]).tolist(),
        "trials": trials,
        "equal rows": sum(same(*(each["row"] for each in pair)) for pair in pairs),
    }


def trained(folder: Path) -> Path:
    """A predictor that has seen little."""
    from coverdrive.prediction.boxes.training import BoxSettings
    from coverdrive.prediction.fit import PredictionSettings, fit
    from coverdrive.simulation.drivers.generated import GeneratedSettings, generate

    quick = PredictionSettings(boxes=BoxSettings(most_steps=200, few=0))
    file = folder / "predictor.safetensors"
    fit(generate(GeneratedSettings(scenes=12)), quick).predictor.save(file)
    return file


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--baseline", type=Path, default=OURS)
    parser.add_argument("--predictor", type=Path)
    parser.add_argument("--baseline-predictor", type=Path)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--traffics", nargs="+", choices=TRAFFICS, default=list(TRAFFICS))
    parser.add_argument("--out", type=Path)
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.serve is not None:
        serve(chosen.serve)
        return
    with tempfile.TemporaryDirectory() as folder:
        predictor = chosen.predictor or trained(Path(folder))
        if hasattr(os, "sched_setaffinity"):
            os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
        theirs = chosen.baseline_predictor or predictor
        sides = (OURS, predictor), (chosen.baseline, theirs)
        checkouts = [Checkout(*side) for side in (*sides, *sides[::-1])]
        try:
            result = {
                traffic: compared(checkouts, traffic, chosen.trials, chosen.repeats) for traffic in chosen.traffics
            }
        finally:
            for checkout in checkouts:
                checkout.close()
    print(json.dumps(result, indent=2))
    if chosen.out is not None:
        chosen.out.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
