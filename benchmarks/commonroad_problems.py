"""Planning problems of CommonRoad scenarios: `python benchmarks/commonroad_problems.py SCENARIO … --recording PATH …`.

All rows drive the same problems in a BMW 320i, and the drivability checker judges them; no one reacts to the ego:

- *certified*: the package's driver with the predictor of `coverdrive fit`, which has not seen the scene;
- *constant-velocity-belief*: the same planner, which believes that everybody keeps the velocity, body alone;
- *idm*: IDM behind the leader, in the lane of the start; *keep-velocity*: the speed and the lane of the start;
- *fiss-future*, *fiss-constant-velocity*: FISS+ of `fiss-planner` told what others will do, and with constant velocity,
  driven and judged by its own benchmark: a VW Vanagon on exactly the planned path, no vehicle model checked.

Scenes are left out of the fits in `--folds` bundles, so that there are few fits. What was stopped goes on where it was.
"""

import argparse
import csv
import json
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from scipy.stats import binomtest

from coverdrive.config import Experiment
from coverdrive.driving.solved import solve, write
from coverdrive.league.beliefs import ConstantVelocity
from coverdrive.planning.plan import Planner
from coverdrive.prediction.left_out import fit_without, left_out
from coverdrive.prediction.predictor import AnyPredictor
from lane_drivers import LaneDriver, constant, idm

PLANNERS: dict[str, Callable[[], Planner] | None] = {
    "certified": None,
    "constant-velocity-belief": None,
    "idm": lambda: LaneDriver(idm),
    "keep-velocity": lambda: LaneDriver(constant),
}
FISS = {"fiss-future": "ground_truth", "fiss-constant-velocity": "constant_velocity"}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", type=Path, nargs="+")
    parser.add_argument("--recording", type=Path, nargs="+", required=True)
    parser.add_argument("--rows", nargs="+", default=[*PLANNERS, *FISS], choices=[*PLANNERS, *FISS])
    parser.add_argument("--model", choices=["KS", "ST"], default="KS")
    parser.add_argument("--folds", type=int, default=4)
    parser.add_argument("--set", nargs="*", default=[], help="settings of the fits, as in the command")
    parser.add_argument("--out", type=Path, default=Path("commonroad.json"))
    options = parser.parse_args()
    folder = options.out.with_suffix("")
    folder.mkdir(parents=True, exist_ok=True)
    files = [file for each in options.scenario for file in (sorted(each.glob("*.xml")) if each.is_dir() else [each])]
    predictor_of = None
    result: dict[str, Any] = {}
    for name in options.rows:
        if name in FISS:
            rows = list(driven_by_fiss(files, FISS[name], folder / f"{name}.csv"))
        else:
            predictor_of = predictor_of or predictors(files, options.recording, options.folds, options.set, folder)
            rows = list(driven(name, files, predictor_of, options.model, folder))
        if rows:
            result[name] = summary(rows)
            print(told(name, result[name]), flush=True)
    options.out.write_text(json.dumps(result, indent=1), encoding="utf-8")


def predictors(
    files: Sequence[Path], recordings: Sequence[Path], folds: int, settings: Sequence[str], folder: Path
) -> Callable[[Path], AnyPredictor]:
    """A predictor for every scenario that has not seen it; fitted when first asked for."""
    from coverdrive.sweep import changes_of

    experiment = Experiment.preset("default").updated({"prediction": {"certificate": {"epsilon": "auto"}}})
    experiment = experiment.updated(changes_of(settings))
    kept = folder / "left-out.json"
    if kept.exists():
        out = {Path(name): frozenset(names) for name, names in json.loads(kept.read_text()).items()}
    else:
        out = dict(zip(files, left_out(recordings, files), strict=True))
        kept.write_text(json.dumps({str(file): sorted(names) for file, names in out.items()}))
    read = experiment.recordings(recordings)
    rows = {each.name: len(each.table) for each in read}
    bundles = bundled(set(out.values()) - {frozenset()}, rows, folds)

    def predictor_of(file: Path) -> AnyPredictor:
        names = next((each for each in bundles if out[file] and out[file] <= each), frozenset[str]())
        return fit_without(names, read, experiment.prediction, experiment.seed, folder / "fits")

    return predictor_of


def bundled(sets: set[frozenset[str]], rows: dict[str, int], folds: int) -> list[frozenset[str]]:
    """So many unions of sets of recordings, of about as many rows each, the largest first."""
    bundles = [frozenset[str]() for _ in range(folds)]
    for each in sorted(sets, key=lambda names: (-sum(map(rows.__getitem__, names)), sorted(names))):
        smallest = min(range(folds), key=lambda i: sum(map(rows.__getitem__, bundles[i])))
        bundles[smallest] |= each
    return bundles


def driven(
    name: str, files: Sequence[Path], predictor_of: Callable[[Path], AnyPredictor], model: Any, folder: Path
) -> Iterator[dict[str, Any]]:
    """The rows of all scenarios, driven if they were not yet."""
    for file in files:
        kept = folder / f"{name}-{model}" / f"{file.stem}.json"
        if not kept.exists():
            predictor, make = predictor_of(file), PLANNERS[name]
            believed = predictor if name == "certified" else ConstantVelocity()
            found = list(solve(file, believed, model, make and make()))
            write(found, kept.parent / file.stem)
            kept.write_text(json.dumps([each.row for each in found]), encoding="utf-8")
        for row in json.loads(kept.read_text(encoding="utf-8")):
            print(f"{name:12} {row['scenario']:28} {row['problem']} {row['reason'] or 'solved'}", flush=True)
            yield row


def driven_by_fiss(files: Sequence[Path], prediction: str, table: Path) -> Iterator[dict[str, Any]]:
    """The rows of FISS+, of the first planning problem of every scenario; none if it is not installed."""
    if not table.exists():
        if find_spec("fiss_planner") is None:
            return
        chosen = ["--planners", "fiss_plus", "--prediction", prediction, "--jobs", "1", "--out", str(table)]
        command = [sys.executable, "-m", "fiss_planner.commonroad.benchmark", "--scenarios", *map(str, files), *chosen]
        subprocess.run(command, check=True)
    with table.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            solved = row["status"] == "success"
            yield {"scenario": row["scenario"], "solved": solved, "reason": "" if solved else row["status"]}


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """How many are solved, with an interval of 95 %, how many collide, and why the others are not solved."""
    solved = sum(row["solved"] for row in rows)
    interval = binomtest(solved, len(rows)).proportion_ci(method="wilson")
    windows = sum(row.get("windows") or 0 for row in rows)
    missed = sum(row.get("prediction_misses") or 0 for row in rows)
    return {
        "problems": len(rows),
        "solved": solved,
        "share": solved / len(rows),
        "interval": [interval.low, interval.high],
        "collisions": sum(row["reason"].startswith("collision") for row in rows),
        "windows missed": missed / windows if windows else None,
        "reasons": dict(Counter(row["reason"] for row in rows if not row["solved"]).most_common()),
        "unsolved": {f"{row['scenario']} {row.get('problem', '')}": row["reason"] for row in rows if not row["solved"]},
    }


def told(name: str, values: dict[str, Any]) -> str:
    """One line of the table."""
    low, high = values["interval"]
    return (
        f"{name:26} {values['solved']:3} of {values['problems']} solved, {values['share']:.0%} ({low:.0%}–{high:.0%}); "
        f"{values['collisions']} collisions; {values['reasons']}"
    )


if __name__ == "__main__":
    main()
