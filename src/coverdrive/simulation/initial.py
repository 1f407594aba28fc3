"""Where a trial begins: the ego among uncontrolled vehicles, all at the same speed (paper §5).

The ego is slot 0 of the scene, in the rightmost lane that goes on; the uncontrolled vehicles follow in random order of
place.
"""

import numpy as np
from pydantic import Field

from coverdrive.errors import StartError
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.road_settings import RoadSettings

EGO = 0
"""slot of the ego in every scene of the simulation"""

_ATTEMPTS = 10_000


class InitialSettings(RoadSettings):
    """The road and the traffic at the start of a trial."""

    road_length: float = Field(default=1000.0, ge=1, le=1e6)
    """[m] 20 s at the reference speed of 40 m/s, and some more"""
    position: float = Field(default=0.0, ge=0, le=1e6)
    """[m] lon of the ego"""
    ego_speed: float = Field(default=20.0, gt=0, le=120)
    """[m/s] of the ego (authors' scripts)"""
    traffic_speed: float = Field(default=20.0, gt=0, le=120)
    """[m/s] of the uncontrolled vehicles (authors' scripts)"""
    behind: float = Field(default=-10.0, ge=-10_000, le=10_000)
    """[m] lon of the rearmost uncontrolled vehicle's centre, relative to the ego (authors' scripts)"""
    ahead: float = Field(default=30.0, ge=-10_000, le=10_000)
    """[m] lon of the foremost uncontrolled vehicle's centre, relative to the ego (authors' scripts)"""
    gap: float = Field(default=2.0, ge=0, le=1000)
    """[m] least bumper-to-bumper distance in a lane; the paper asks only that vehicles do not overlap"""
    length: float = Field(default=4.8, ge=1, le=30)
    """[m] of a vehicle; a mid-size car (the paper gives no sizes)"""
    width: float = Field(default=1.9, ge=0.3, le=5)
    """[m] of a vehicle; a mid-size car (the paper gives no sizes)"""
    size_variation: float = Field(default=0.05, ge=0, lt=1)
    """sizes of uncontrolled vehicles are drawn uniformly from 1 ± this, times the above (own choice)"""

    def road(self) -> Road:
        """The road of every trial."""
        return self.road_of(self.road_length)


def initial_scene(settings: InitialSettings, vehicles: int, rng: np.random.Generator) -> Scene:
    """Draw the ego and ``vehicles`` others by rejection: all anew until none is too close to another.

    Raises:
        StartError: the vehicles cannot be placed.
    """
    road = settings.road()
    for _ in range(_ATTEMPTS):
        scene = _draw(settings, road, vehicles, rng)
        if scene is not None:
            return scene
    raise StartError(
        f"{vehicles} uncontrolled vehicles of {settings.length} m could not be placed on {settings.lanes} lanes "
        f"between lon {settings.behind} and {settings.ahead} m with gaps of {settings.gap} m in {_ATTEMPTS} attempts; "
        "use fewer vehicles, a longer stretch or a smaller gap"
    )


def _draw(settings: InitialSettings, road: Road, vehicles: int, rng: np.random.Generator) -> Scene | None:
    """One draw of all vehicles, or None if two of one lane are too close to each other, or one is beyond its lane."""
    slots = vehicles + 1
    scale = rng.uniform(1 - settings.size_variation, 1 + settings.size_variation, (2, slots))
    lane = rng.integers(road.lanes, size=slots)
    lon = settings.position + rng.uniform(settings.behind, settings.ahead, slots)
    scale[:, EGO], lane[EGO], lon[EGO] = 1.0, road.lanes - settings.lanes, settings.position
    length, width = settings.length * scale[0], settings.width * scale[1]
    too_close = (lane[:, None] == lane) & (np.abs(lon[:, None] - lon) < (length[:, None] + length) / 2 + settings.gap)
    if np.triu(too_close, 1).any() or not road.has_lane(lon + length)[np.arange(slots), lane].all():
        return None
    speed = np.full(slots, settings.traffic_speed)
    speed[EGO] = settings.ego_speed
    return Scene(
        lon=lon,
        lat=np.asarray(road.centres)[lane],
        speed=speed,
        heading=np.zeros(slots),
        length=length,
        width=width,
        valid=np.ones(slots, dtype=bool),
    )
