"""How many CommonRoad problems are solved? `python benchmarks/problems.py --recording us101/ -- us101/ roads/`.

By `coverdrive solve`: with ``--recording``, each is driven with a predictor that was fitted on the recordings that
show nothing of its scene, nor of its map; with ``--predictor``, by that of a results folder. ``--folder`` keeps
solutions, so that the same command goes on where it was stopped. ``--save`` keeps the counts, ``--write`` puts the
table into `benchmarks/RESULTS.md`.
"""

import argparse
import json
from pathlib import Path
from tempfile import gettempdir
from typing import Any

import numpy as np

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.cli.driving.solve import solve
from results import save, write_section

PLACES = {True: "US-101", False: "elsewhere"}
"""whether a scenario is one of US-101, where most of them are"""


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Of problems: how many are solved, how they were driven, and why the others are not."""
    driven, solved = [row for row in rows if row["time"] is not None], sum(row["solved"] for row in rows)
    return {
        "problems": len(rows),
        "solved": solved,
        "share": [solved / len(rows), *clopper_pearson(solved, len(rows))],
        "checked": sum(bool(row["checked"]) for row in rows),
        "collisions": sum("collision" in row["reason"] for row in rows),
        "unsafe": float(np.mean([row["share_unsafe"] for row in driven])) if driven else None,
        "least gap [m], median": float(np.median([row["minimum_gap"] for row in driven])) if driven else None,
        "jerk [m/s³], mean": float(np.mean([row["jerk_longitudinal"] for row in driven])) if driven else None,
        "step [ms], median": 1e3 * float(np.median([row["planning_median"] for row in driven])) if driven else None,
        "not solved": [[row["scenario"], row["problem"], row["reason"]] for row in rows if not row["solved"]],
    }


def by_place(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The summary of those on US-101, and of those elsewhere, if there are any."""
    parts = {
        name: [row for row in rows if row["scenario"].startswith("USA_US101") == here] for here, name in PLACES.items()
    }
    return {name: summary(part) for name, part in parts.items() if part}


def table(found: dict[str, Any]) -> str:
    """As it stands in the results."""
    lines = [
        "\n| where | problems | solved (95 %) | collisions | unsafe plans | least gap, median | jerk | a step |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, each in found.items():
        share, low, high = each["share"]
        said = [
            name, each["problems"], f"{each['solved']}: {share:.0%} ({low:.0%}–{high:.0%})", each["collisions"],
            *(f"{each[key]:{form}}" if each[key] is not None else "–" for key, form in FORMS.items()),
        ]  # fmt: skip
        lines.append(f"| {' | '.join(map(str, said))} |")
    lines += ["\n| not solved | why |", "|---|---|"]
    lines += [f"| {name} {problem} | {why} |" for each in found.values() for name, problem, why in each["not solved"]]
    return "\n".join(lines)


FORMS = {
    "unsafe": ".1%", "least gap [m], median": ".2f", "jerk [m/s³], mean": ".2f", "step [ms], median": ".1f",
}  # fmt: skip
"""of numbers, by name"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", type=Path, nargs="+")
    parser.add_argument("--recording", type=Path, nargs="*", help="each is driven by what leaves its scene out")
    parser.add_argument("--predictor", type=Path, help="results folder")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--folder", type=Path, default=Path(gettempdir()) / "coverdrive-problems", help="of solutions")
    parser.add_argument("--out", type=Path, help="a JSON file")
    parser.add_argument("--save", help="name of the file in benchmarks/results")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--title", default="Planning problems", help="of the section")
    given = parser.parse_args()
    known: dict[str, Any] = {"predictor": given.predictor} if given.predictor else {"recording": given.recording}
    left_out = not given.predictor
    rows = solve(*given.scenarios, **known, leave_one_out=left_out, workers=given.workers, out=given.folder)["problems"]
    found = by_place(rows)
    print(table(found))
    if given.out:
        given.out.write_text(json.dumps(found, indent=1), encoding="utf-8")
    if given.write:
        write_section(given.title, __doc__, table(found))
    if given.save:
        save(given.save, found)


if __name__ == "__main__":
    main()
