"""Worlds of others in the league: highway-env's motorway at three densities, and a motorway in SUMO at two flows."""

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from coverdrive.bridges.highway_env import HighwayEnv
from coverdrive.bridges.sumo import Sumo
from coverdrive.bridges.world import World
from coverdrive.driving.driver import adapted
from coverdrive.planning.planner import PlannerSettings

_LIMIT, _LENGTH, _WIDTH = 33.33, 4000.0, 3.6
"""[m/s], [m], [m] of SUMO's motorway and its lanes"""


def highway(density: float) -> World:
    """highway-env's motorway of 3 lanes with 30 vehicles; its own driver is IDM and MOBIL."""
    return HighwayEnv(lanes_count=3, vehicles_count=30, vehicles_density=density)


def motorway(flow: int) -> World:
    """A motorway of 3 lanes in SUMO, 15 % trucks, ``flow`` vehicles an hour on each lane; the ego departs after 150 s.

    Its own driver is Krauss' model with LC2013.
    """
    folder = Path(_files(flow).name)
    return Sumo(["-n", f"{folder}/net.xml", "-r", f"{folder}/demand.rou.xml", "--lanechange.duration", "3"], ego="ego")


@cache
def _files(flow: int) -> "TemporaryDirectory[str]":
    """Network and demand in a folder that lasts as long as the process."""
    made = TemporaryDirectory(prefix="coverdrive-sumo-")
    lanes = [
        f'<lane id="road_{i}" index="{i}" speed="{_LIMIT}" length="{_LENGTH}" width="{_WIDTH}" '
        f'shape="0,{_WIDTH * (i - 2.5):.1f} {_LENGTH},{_WIDTH * (i - 2.5):.1f}"/>'
        for i in range(3)
    ]
    (Path(made.name) / "net.xml").write_text(
        f"""<net version="1.20">
<edge id="road" from="west" to="east" priority="1">{"".join(lanes)}</edge>
<junction id="west" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-10.8"/>
<junction id="east" type="dead_end" x="{_LENGTH}" y="0" incLanes="road_0 road_1 road_2" intLanes=""
 shape="{_LENGTH},-10.8 {_LENGTH},0"/>
</net>
""",
        encoding="utf-8",
    )
    (Path(made.name) / "demand.rou.xml").write_text(
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
    return made


class Other(NamedTuple):
    """A world of others, and what is said of the ego in it."""

    make: Callable[[], World]
    ego: dict[str, float]
    """length [m], width [m] and wanted_speed [m/s], the limit of the world"""
    braking: float
    """[m/s²] up to which its vehicles brake: highway-env's ``ACC_MAX``, SUMO's ``decel`` of cars"""
    headway: float
    """[s] that its drivers are made to keep: highway-env's ``TIME_WANTED``, SUMO's ``tau``"""
    beside: float = 1.5
    """[m] that its drivers, who keep to the middle of their lanes, have beside cars and nearly beside trucks"""

    def settings(self, usual: PlannerSettings) -> PlannerSettings:
        """Those of a planner that drives this car as fast, and as near to others, as the drivers there."""
        settings = adapted(usual, **self.ego)
        leaders = settings.leaders.model_copy(update={"deceleration": self.braking})
        manners = settings.manners.model_copy(update={"headway": self.headway, "beside": self.beside})
        return settings.model_copy(update={"leaders": leaders, "manners": manners})


OTHERS = {
    **{
        f"highway-env-{density:g}": Other(
            partial(highway, density), {"length": 5.0, "width": 2.0, "wanted_speed": 30.0}, 6.0, 1.5
        )
        for density in (1.0, 1.5, 2.0)
    },
    **{
        f"sumo-{flow}": Other(partial(motorway, flow), {"length": 4.8, "width": 1.9, "wanted_speed": _LIMIT}, 4.5, 1.0)
        for flow in (1500, 2000)
    },
}
"""by name"""
