"""Does splitting agree with plain drives? `python benchmarks/rare.py [--predictor FILE] [--out rare.json]`.

Where collisions are frequent enough to be counted: among 12 aggressive drivers, an ego that believes that everybody is
where its predictor says on average (boxes of no size), and fears no braking. Plain drives and splitting have seeds of
their own. With `--traffic set-sampling` the ego is as usual, in the paper's traffic. Where repetitions end without a
collision, the drives that come as near as all of them did are counted, and called collisions.
"""

import argparse
import json
import math
import tempfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

import coverdrive
from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.certificates.rule import Thresholds
from coverdrive.dialling.rare import CONTACT, Drive, rare
from coverdrive.dialling.tape import Tape
from coverdrive.errors import StartError
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.rules.leaders import LeaderSettings
from coverdrive.prediction.predictor import AnyPredictor, Predictor
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.studies.setup import Participants, Setup
from results import save


def reckless(predictor: AnyPredictor) -> Setup:
    """An ego that collides now and then."""
    none = replace(predictor, rule=Thresholds(np.ones(1), predictor.rule.tube))
    planner = MpcPlanner(PlannerSettings(leaders=LeaderSettings(deceleration=0.0)))
    return Setup(none, planner, "aggressive", vehicles=(12,))


def plain(setup: Setup, drives: int, level: float | None) -> dict:
    """How many drives collide, or get above a level if there is one."""
    least, participants, hits = CONTACT if level is None else math.nextafter(level, math.inf), setup.participants(), 0
    for trial in range(drives):
        hits += _nearest(setup, participants, np.random.default_rng((setup.seed, trial))) >= least
    return {"drives": drives, "collisions": hits, "rate": hits / drives, "interval": clopper_pearson(hits, drives)}


def _nearest(setup: Setup, participants: Participants, random: np.random.Generator) -> float:
    """The highest level of a drive that can start."""
    while True:
        tape = Tape(random=random)
        with suppress(StartError):
            drive = Drive(setup, participants, tape)
            break
    levels = [drive.level]
    while not drive.over:
        tape.turn(len(levels))
        drive.advance()
        levels.append(drive.level)
    return max(levels)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--predictor", type=Path, help="of boxes; else one is fitted to generated traffic")
    parser.add_argument("--traffic", choices=("aggressive", "set-sampling"), default="aggressive")
    parser.add_argument("--drives", type=int, default=400)
    parser.add_argument("--particles", type=int, default=100)
    parser.add_argument("--repetitions", type=int, default=6)
    parser.add_argument("--down-to", type=float, default=1e-6, help="probability below which nothing is looked for")
    parser.add_argument("--duration", type=float, default=20.0)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--folder", type=Path, help="of the splitting, which goes on where it was")
    parser.add_argument("--out", type=Path, default=Path("rare.json"))
    parser.add_argument("--save", help="name of the file in benchmarks/results")
    given = parser.parse_args()
    fitted = Predictor.load(given.predictor) if given.predictor else None
    predictor = fitted or coverdrive.fit(coverdrive.generate()).predictor
    setup = reckless(predictor) if given.traffic == "aggressive" else Setup(predictor)
    setup = replace(setup, episode=EpisodeSettings(duration=given.duration))
    with tempfile.TemporaryDirectory() as temporary:
        found = rare(
            replace(setup, seed=1), given.folder or temporary, particles=given.particles,
            repetitions=given.repetitions, rarest=given.down_to,
            workers=given.workers,
        )  # fmt: skip
    result = {
        "plain": plain(setup, given.drives, found.level),
        "splitting": {
            "left": None if found.level is None else -found.level,
            "probability": found.probability,
            "standard error": found.standard_error,
            "interval": found.interval,
            "estimates": found.estimates,
            "particles": given.particles,
            "repetitions": given.repetitions,
            "drives": found.drives,
            "seconds": found.seconds,
        },
    }
    given.out.write_text(json.dumps(result, indent=2), encoding="utf-8")
    print(json.dumps(result, indent=2))
    if given.save:
        save(given.save, result, 1)


if __name__ == "__main__":
    main()
