"""Our driver drives in highway-env, whose vehicles react to it: `python examples/driver_in_highway_env.py`.

Needs the extra `highway-env`.
"""

import argparse
from pathlib import Path

import coverdrive as cd
from coverdrive.bridges.highway_env import HighwayEnv
from coverdrive.bridges.world import drive
from coverdrive.planning.planner import PlannerSettings
from coverdrive.planning.rules.leaders import LeaderSettings
from coverdrive.planning.rules.manners import MannersSettings
from coverdrive.simulation.measures.trial import measure


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--predictor", type=Path, default=Path("coverdrive-demo/predictor.safetensors"))
    options.add_argument("--duration", type=float, default=40.0, help="[s] of a drive")
    given = options.parse_args()
    world = HighwayEnv("highway-v0", lanes_count=3, vehicles_count=30, vehicles_density=1.5, duration=given.duration)
    world.reset(seed=0)
    alike = PlannerSettings(  # its vehicles brake as hard, and keep as far away
        leaders=LeaderSettings(deceleration=6.0), manners=MannersSettings(headway=1.5, beside=1.5)
    )
    driver = cd.Driver(cd.Predictor.load(given.predictor), alike, **world.car._asdict(), wanted_speed=30.0)
    row = measure(drive(world, driver, seed=0), seed=0, trial=0)
    print(f"{row['kind']} at {row['time']:.1f} s, {row['mean_speed']:.1f} m/s on average, {row['overtakes']} overtakes")


if __name__ == "__main__":
    main()
