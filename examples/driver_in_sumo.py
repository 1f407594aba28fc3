"""Our driver drives on a motorway of SUMO, among its vehicles: `python examples/driver_in_sumo.py`.

The motorway is written to a folder first. Needs the extra `sumo`.
"""

import argparse
from pathlib import Path

import coverdrive as cd
from coverdrive.bridges.sumo import Sumo
from coverdrive.bridges.world import drive
from coverdrive.simulation.measures.trial import measure

LANE = '<lane id="road_{0}" index="{0}" speed="33.3" length="{length}" width="3.6" shape="0,{1} {length},{1}"/>'
NET = """<net version="1.20">
<edge id="road" from="west" to="east" priority="1">{lanes}</edge>
<junction id="west" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-10.8"/>
<junction id="east" type="dead_end" x="{length}" y="0" incLanes="road_0 road_1 road_2" intLanes=""
 shape="{length},0 {length},-10.8"/>
</net>"""
ROUTES = """<routes>
<vType id="car" length="4.6" width="1.8" speedFactor="normc(1,0.1,0.7,1.3)"/>
<route id="all" edges="road"/>
<flow id="traffic" type="car" route="all" begin="0" end="120" vehsPerHour="4500" departLane="best" departSpeed="max"/>
<vehicle id="ego" type="car" route="all" depart="30" departLane="1" departSpeed="max"/>
</routes>"""


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--predictor", type=Path, default=Path("coverdrive-demo/predictor.safetensors"))
    options.add_argument("--folder", type=Path, default=Path("motorway"))
    options.add_argument("--length", type=int, default=2000, help="[m] of the motorway")
    given = options.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    net, routes = given.folder / "motorway.net.xml", given.folder / "motorway.rou.xml"
    lanes = "".join(LANE.format(index, 3.6 * index - 9, length=given.length) for index in range(3))
    net.write_text(NET.format(lanes=lanes, length=given.length))
    routes.write_text(ROUTES)
    world = Sumo(["-n", str(net), "-r", str(routes), "--lanechange.duration", "3"], ego="ego")
    world.reset(seed=0)
    driver = cd.Driver(cd.Predictor.load(given.predictor), **world.car._asdict(), wanted_speed=33.3)
    row = measure(drive(world, driver, seed=0), seed=0, trial=0)
    print(f"{row['kind']} at {row['time']:.1f} s, {row['mean_speed']:.1f} m/s on average, {row['overtakes']} overtakes")


if __name__ == "__main__":
    main()
