"""Runs a study with stand-ins, so that a test can kill it: ``python run_fake_study.py FOLDER TRIALS SEED WORKERS``."""

import sys
from pathlib import Path

from simulation_fakes import FAST, build_fakes

from coverdrive.simulation.study import run_study


def main() -> None:
    folder, trials, seed, workers = sys.argv[1], *map(int, sys.argv[2:])
    run_study(
        build_fakes,
        FAST,
        Path(folder),
        trials=trials,
        seed=seed,
        workers=workers,
        progress=lambda finished, trials: print(finished, trials, flush=True),
    )


if __name__ == "__main__":
    main()
