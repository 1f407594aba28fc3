"""An own planner is compared with ours on equal seeds: `python examples/own_planner_in_the_league.py`.

The command does the same with whatever can be imported: `coverdrive league coverdrive-demo --worlds drivers --planners
default own_planner_in_the_league:Careful`, called in this folder.
"""

import argparse
import subprocess
import sys
from pathlib import Path

import numpy as np


class Careful:
    """An agent that keeps its lane, and two seconds to the car ahead."""

    def __init__(self, settings):
        self.wanted = settings.problem.cost.reference_speed

    def reset(self, period):
        """There is nothing to forget."""

    def act(self, scene, road):
        """Acceleration [m/s²] and yaw rate [rad/s]."""
        lane = road.lane_at(scene.lon, scene.lat)
        ahead = scene.valid & (lane == lane[0]) & (scene.lon > scene.lon[0])
        gap = np.min(scene.lon[ahead] - scene.length[ahead], initial=np.inf) - scene.lon[0]
        wanted = min(self.wanted, gap / 2)
        return float(np.clip(wanted - scene.speed[0], -6, 2)), -float(scene.heading[0])


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--results", type=Path, default=Path("coverdrive-demo"))
    options.add_argument("--trials", type=int, default=10)
    options.add_argument("--duration", type=float, default=20.0, help="[s] of a drive")
    given = options.parse_args()
    league = ["league", str(given.results.resolve()), "--worlds", "drivers", "--trials", str(given.trials)]
    league += ["--planners", "default", f"{Path(__file__).stem}:Careful", "--duration", str(given.duration)]
    subprocess.run([sys.executable, "-m", "coverdrive", *league], cwd=Path(__file__).parent, check=True)


if __name__ == "__main__":
    main()
