"""Planning problems of CommonRoad are driven, and a solution written: `python examples/commonroad_problem.py FILE`.

With the extra `commonroad` the drivability checker judges it. The command for many is `coverdrive solve`.
"""

import argparse
from pathlib import Path

import coverdrive as cd
from coverdrive.driving.batch import solve_all


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("scenario", type=Path)
    options.add_argument("--predictor", type=Path, default=Path("coverdrive-demo/predictor.safetensors"))
    options.add_argument("--out", type=Path, default=Path("solutions"))
    given = options.parse_args()
    predictor = cd.Predictor.load(given.predictor)
    for rows in solve_all([given.scenario], lambda _: predictor, given.out):
        print(*rows, sep="\n")
    print("written:", given.out / "solved.csv")


if __name__ == "__main__":
    main()
