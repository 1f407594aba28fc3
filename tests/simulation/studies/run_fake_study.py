"""Runs a study with stand-ins, so that a test can kill it: ``python run_fake_study.py FOLDER TRIALS SEED WORKERS``."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from simulation_fakes import fakes

from coverdrive.progress import heard_by
from coverdrive.simulation.studies.study import Study


def main() -> None:
    folder, trials, seed, workers = sys.argv[1], *map(int, sys.argv[2:])
    with heard_by(lambda _, share: print(round(share * trials), flush=True)):
        Study(fakes(seed=seed), Path(folder)).run(trials, workers=workers)


if __name__ == "__main__":
    main()
