"""How the driver fares in worlds of others: `python benchmarks/bridges.py --predictor results/predictor.safetensors`.

- *highway-env*: its motorway of 3 lanes with 30 vehicles, at three densities. Its own driver is IDM and MOBIL.
- *SUMO*: a motorway of 3 lanes and 4 km, 15 % trucks, 1500 or 2000 vehicles an hour on each lane; the ego departs after
  150 s. Its own driver is Krauss' model with LC2013.

The ego begins the same drives with each driver and wants the same speed, the world's limit: *own* is the world's,
*default* ours, *keen* ours to whom every m/s below the wanted speed is worth more.

Every drive is a file in a folder named like the output; what was stopped goes on where it was. Intervals are of 95 %;
that of a ratio of mean speeds is of pairs of drives of one seed (linearised, Student's).
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

import coverdrive as cd
from coverdrive.bridges.highway_env import HighwayEnv
from coverdrive.bridges.sumo import Sumo
from coverdrive.bridges.world import World, drive
from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.files import write_json
from coverdrive.planning.planner import PlannerSettings
from coverdrive.simulation.comparison import paired_t
from coverdrive.simulation.outcome import Kind
from coverdrive.simulation.statistics import miss_rate
from coverdrive.simulation.trial import measure

HIGHWAY_LIMIT, SUMO_LIMIT = 30.0, 33.33
LENGTH, WIDTH = 4000.0, 3.6
DRIVERS = {
    "own": None,
    "keen": PlannerSettings.model_validate({"problem": {"cost": {"speed": 0.3}}}),
    "default": PlannerSettings(),
}
MEANS = ("share_unsafe", "share_solved", "lane_changes", "jerk_longitudinal", "planning_median", "planning_p99")
LEAST = ("minimum_gap", "minimum_time_to_collision")


def highway(density: float, folder: Path) -> tuple[World, float]:
    return HighwayEnv(lanes_count=3, vehicles_count=30, vehicles_density=density), HIGHWAY_LIMIT


def motorway(flow: int, folder: Path) -> tuple[World, float]:
    """A motorway as a network and a demand of SUMO in a folder."""
    lanes = [
        f'<lane id="road_{i}" index="{i}" speed="{SUMO_LIMIT}" length="{LENGTH}" width="{WIDTH}" '
        f'shape="0,{WIDTH * (i - 2.5):.1f} {LENGTH},{WIDTH * (i - 2.5):.1f}"/>'
        for i in range(3)
    ]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "net.xml").write_text(
        f"""<net version="1.20">
<edge id="road" from="west" to="east" priority="1">{"".join(lanes)}</edge>
<junction id="west" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-10.8"/>
<junction id="east" type="dead_end" x="{LENGTH}" y="0" incLanes="road_0 road_1 road_2" intLanes=""
 shape="{LENGTH},-10.8 {LENGTH},0"/>
</net>
""",
        encoding="utf-8",
    )
    (folder / f"{flow}.rou.xml").write_text(
        f"""<routes>
<vTypeDistribution id="mixed">
<vType id="car" length="4.6" width="1.8" speedFactor="normc(1,0.1,0.7,1.3)" probability="0.85"/>
<vType id="truck" vClass="truck" length="12" width="2.5" maxSpeed="25" accel="1.3" probability="0.15"/>
</vTypeDistribution>
<vType id="own" length="4.8" width="1.9" speedFactor="1"/>
<route id="all" edges="road"/>
<flow id="traffic" type="mixed" route="all" begin="0" end="400" vehsPerHour="{3 * flow}" departLane="best"
 departSpeed="max"/>
<vehicle id="ego" type="own" route="all" depart="150" departLane="1" departSpeed="max"/>
</routes>
""",
        encoding="utf-8",
    )
    files = "-n", str(folder / "net.xml"), "-r", str(folder / f"{flow}.rou.xml")
    return Sumo([*files, "--lanechange.duration", "3"], ego="ego"), SUMO_LIMIT


WORLDS: dict[str, tuple[Callable[..., tuple[World, float]], float]] = {
    "highway-env-1": (highway, 1.0),
    "highway-env-1.5": (highway, 1.5),
    "highway-env-2": (highway, 2.0),
    "sumo-1500": (motorway, 1500),
    "sumo-2000": (motorway, 2000),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--predictor", type=Path, required=True, help="of `coverdrive fit`")
    parser.add_argument("--worlds", nargs="+", choices=WORLDS, default=list(WORLDS))
    parser.add_argument("--drivers", nargs="+", choices=DRIVERS, default=list(DRIVERS))
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--out", type=Path, default=Path("bridges.json"))
    chosen = parser.parse_args()
    predictor, folder = cd.Predictor.load(chosen.predictor), chosen.out.with_suffix("")
    made = {name: WORLDS[name][0](WORLDS[name][1], folder / name) for name in chosen.worlds}
    drivers: dict[tuple[str, str], cd.Driver | None] = {}
    for seed in range(chosen.seeds):
        for name, (world, limit) in made.items():
            for row in chosen.drivers:
                file = folder / name / row / f"{seed:03}.json"
                if file.exists():
                    continue
                if (name, row) not in drivers:
                    world.reset(seed)
                    drivers[name, row] = DRIVERS[row] and cd.Driver(
                        predictor, DRIVERS[row], **world.car._asdict(), wanted_speed=limit
                    )
                file.parent.mkdir(parents=True, exist_ok=True)
                values = driven(world, drivers[name, row], seed)
                write_json(file, values)
                print(name, row, seed, f"{values['mean_speed']:.2f} m/s", "crashed" * values["crashed"], flush=True)
    result = {name: table(folder / name, chosen.drivers, chosen.seeds) for name in chosen.worlds}
    write_json(chosen.out, result)
    for name, rows in result.items():
        for row, values in rows.items():
            print(told(name, row, values))


def driven(world: World, driver: cd.Driver | None, seed: int) -> dict[str, Any]:
    """One drive; of the world's own driver there is only what the world tells."""
    if driver is not None:
        trace = drive(world, driver, seed)
        crashed = world.crashed or trace.outcome.kind is not Kind.FINISHED
        return measure(trace, seed, seed) | {"crashed": crashed}
    world.reset(seed)
    speeds = [world.observe().own[2]]
    while not world.done:
        world.apply(None)
        speeds.append(world.observe().own[2])
    return {"mean_speed": float(np.mean(speeds)), "crashed": world.crashed}


def table(folder: Path, drivers: list[str], seeds: int) -> dict[str, Any]:
    """What every driver did, beside the world's own if that drove as well."""
    found: dict[str, dict[str, Any]] = {}
    for row in drivers:
        files = [folder / row / f"{seed:03}.json" for seed in range(seeds)]
        trials = pl.DataFrame(
            [json.loads(each.read_text(encoding="utf-8")) for each in files], infer_schema_length=None
        )
        crashes, speeds = int(trials["crashed"].sum()), trials["mean_speed"].to_numpy()
        found[row] = {"drives": seeds, "crashes": crashes, "bounds": clopper_pearson(crashes, seeds, 0.95)}
        found[row]["mean_speed"] = float(speeds.mean())
        if row == "own":
            own = speeds
            continue
        found[row] |= {name: float(trials[name].mean()) for name in MEANS}
        found[row] |= {name: float(trials[name].min()) for name in LEAST}
        found[row]["windows"] = miss_rate(trials, "prediction_misses", "windows")._asdict()
        found[row]["vehicles"] = miss_rate(trials, "vehicles_missed", "vehicles_seen")._asdict()
        if "own" in found and seeds > 1:
            ratio = speeds.mean() / own.mean()
            low, high, _ = paired_t(speeds - ratio * own, 0.95)
            found[row]["times_own"] = [ratio, ratio + low / own.mean(), ratio + high / own.mean()]
    return found


def told(name: str, row: str, values: dict[str, Any]) -> str:
    """A row of the table."""
    low, high = values["bounds"]
    parts = [f"{values['crashes']} of {values['drives']} crashed ({low:.1%}–{high:.1%})"]
    parts.append(f"{values['mean_speed']:.2f} m/s")
    if "times_own" in values:
        parts.append("{:.3f} ({:.3f}–{:.3f}) times own".format(*values["times_own"]))
    if "windows" in values:
        missed = values["windows"]
        parts.append(f"unsafe {values['share_unsafe']:.2%}, jerk {values['jerk_longitudinal']:.1f} m/s³")
        parts.append(f"windows missed {missed['missed'] / max(1, missed['total']):.2%}")
        parts.append(f"least gap {values['minimum_gap']:.1f} m, {values['planning_median'] * 1e3:.1f} ms a step")
    return f"{name:16} {row:8} {'; '.join(parts)}"


if __name__ == "__main__":
    main()
