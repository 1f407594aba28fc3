"""Keeps what a command printed with `--json`: `python benchmarks/keep.py dial-drivers dial.json --command "…"`.

What counts of a fit, a dial, a league or a cover gets a name and goes to `benchmarks/results/`;
`--drives` adds how the drives of a folder went (`trials.parquet`).
"""

import argparse
import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from results import save

NEAR_GAP, NEAR_TIME = 1.0, 1.0
"""[m], [s] below which a drive is a near miss"""


def of_fit(said: dict[str, Any]) -> dict[str, Any]:
    """What a predictor claims, and what it comes to on vehicles that did not train it."""
    claim, seen, driven = said["certificates"][0], said["evaluation"], said["driven"]
    area, box = seen["mean_area"], float(np.mean(said["occupied"]["baseline"]))
    return {
        "claim": claim["epsilon"],
        "vehicles": claim["samples"],
        "groups": claim["scenes"],
        "missed": _rate(seen["shares"]),
        "windows": _rate(seen["windows"]),
        "ever": _rate(seen["vehicles"]),
        "kinds": {name: _rate(each) for name, each in seen["kinds"].items()},
        "area": area,
        "constant velocity": box,
        "of constant velocity": area / box,
        "driven scale": driven[0]["scale"],
        "driven claim": driven[0]["epsilon"],
        "driven area": driven[1]["mean_area"],
        "bases": claim["bases"],
    }


def of_dial(said: dict[str, Any]) -> dict[str, Any]:
    """What is proved of drives, and how they went."""
    anybody, own = said["proofs"]
    row = next(each for each in said["frontier"] if each["who"] == "default" and each["scale"] == said["scale"])
    return {
        "drives": anybody["drives"],
        "contacts": anybody["events"],
        "at most": anybody["bound"],
        "own fault": own["events"],
        "own at most": own["bound"],
        "scale": said["scale"],
        "speed": [row["mean_speed"], row["speed_low"], row["speed_high"]],
        "unsafe": row["share_unsafe"],
    }


def of_cover(said: dict[str, Any]) -> dict[str, Any]:
    """Sizes of covers, and what they cannot be below."""
    names = {
        "epsilon": "radius",
        "bases": "bases",
        "among segments": "at_least_among_segments",
        "anywhere": "at_least_anywhere",
        "farthest": "largest_distance",
    }
    covers = [{name: each[key] for name, key in names.items()} for each in said["bases"]]
    return {"segments": said["segments"], "covers": covers}


def of_league(said: list[dict[str, str]]) -> dict[str, Any]:
    """Each planner in each world."""
    driven = [row for row in said if row["mean_speed"]]
    found: dict[str, Any] = {"drives": int(driven[0]["drives"])}
    for row in driven:
        one = found.setdefault(row["world"], {})[row["planner"]] = {
            "own fault": int(row["at_fault"]),
            "at most": float(row["at_fault_high"]) if row["at_fault_high"] else None,
            "others": int(row["not_at_fault"]),
            "speed": float(row["mean_speed"]),
            "unsafe": float(row["share_unsafe"]) if row["share_unsafe"] else None,
            "jerk": float(row["jerk_longitudinal"]),
            "headway": float(row["usual_headway"]),
            "gap": float(row["least_gap"]),
            "mean gap": float(row["minimum_gap"]),
        }
        if row["mean_speed_minus_low"]:
            one["faster by"] = [float(row[f"mean_speed_minus{end}"]) for end in ("", "_low", "_high")]
    return found


def of_drives(folder: Path) -> dict[str, Any]:
    """How drives went: manners, comfort and the time of a step."""
    rows = pl.concat([pl.read_parquet(file) for file in sorted(folder.rglob("trials.parquet"))], how="diagonal_relaxed")
    rows = rows.filter(pl.col("reason") == "")
    near = (pl.col("minimum_gap") < NEAR_GAP) | (pl.col("minimum_time_to_collision") < NEAR_TIME)
    told = {
        "hours": pl.col("time").sum() / 3600,
        "kilometres": pl.col("distance").sum() / 1000,
        "near misses": near.mean(),
        "below 1 s": (pl.col("minimum_time_to_collision") < 1).mean(),
        "least gap": pl.col("minimum_gap").min(),
        "headway": pl.col("usual_headway").median(),
        "jerk along": pl.col("jerk_longitudinal").mean(),
        "jerk across": pl.col("jerk_lateral").mean(),
        "lost clear": pl.col("lost_clear").mean(),
        "median ms": 1000 * pl.col("planning_median").median(),
        "p99 ms": 1000 * pl.col("planning_p99").median(),
        "windows missed": pl.col("shares_missed").sum() / pl.col("vehicles_seen").sum(),
    }
    return rows.select(**told).row(0, named=True)


KINDS = {"proofs": of_dial, "evaluation": of_fit, "segments": of_cover}
"""what a command printed is told by a key"""


def _rate(of: dict[str, float]) -> list[float]:
    return [of["count"] / of["total"], of["low"], of["high"]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", help="of the file in benchmarks/results")
    parser.add_argument("printed", type=Path, help="what the command printed, or the league.csv that it wrote")
    parser.add_argument("--command", required=True, help="as anybody would call it")
    parser.add_argument("--drives", type=Path, help="folder of drives")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--commit", help="if it is not that of now")
    parser.add_argument("--date", help="the same")
    given = parser.parse_args()
    text = given.printed.read_text(encoding="utf-8")
    said = list(csv.DictReader(text.splitlines())) if given.printed.suffix == ".csv" else json.loads(text)
    values = of_league(said) if isinstance(said, list) else next(KINDS[key] for key in KINDS if key in said)(said)
    if given.drives is not None:
        values |= of_drives(given.drives)
    known = {name: getattr(given, name) for name in ("command", "commit", "date") if getattr(given, name)}
    print(save(given.name, values, given.seed, **known))


if __name__ == "__main__":
    main()
