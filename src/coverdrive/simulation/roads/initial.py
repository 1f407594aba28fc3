"""Where a trial begins: the ego among uncontrolled vehicles, all at the same speed (paper §5).

The ego is slot 0 of the scene, in the rightmost lane that goes on; the uncontrolled vehicles follow in random order of
place.
"""

from typing import Annotated

import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field

from coverdrive.errors import StartError
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.roads.settings import RoadSettings

EGO = 0
"""slot of the ego in every scene of the simulation"""

VEHICLES = (3, 4, 5, 6, 7)
"""numbers of uncontrolled vehicles, taken in turn by the trials of a study (paper §5)"""

_ATTEMPTS = 10_000
_REPAIRS = 100

_MANY = 13
"""vehicles of which some are nearly always too close to another if all are drawn at once"""


_Size = tuple[Annotated[float, Field(ge=1, le=30)], Annotated[float, Field(ge=0.3, le=5)]]


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
    desired_speed: float = Field(default=0.0, ge=0, le=120)
    """[m/s] that IDM drivers usually want on this road; 0: as the settings of the traffic say"""
    behind: float = Field(default=-10.0, ge=-10_000, le=10_000)
    """[m] lon of the rearmost uncontrolled vehicle's centre, relative to the ego (authors' scripts)"""
    ahead: float = Field(default=30.0, ge=-10_000, le=10_000)
    """[m] lon of the foremost uncontrolled vehicle's centre, relative to the ego (authors' scripts)"""
    gap: float = Field(default=2.0, ge=0, le=1000)
    """[m] least bumper-to-bumper distance in a lane; the paper asks only that vehicles do not overlap"""
    length: float = Field(default=4.8, ge=1, le=30)
    """[m] of the ego; a mid-size car (the paper gives no sizes)"""
    width: float = Field(default=1.9, ge=0.3, le=5)
    """[m] of the ego; a mid-size car (the paper gives no sizes)"""
    sizes: tuple[_Size, ...] = Field(default=(), max_length=1000)
    """[m] lengths and widths among which those of each uncontrolled vehicle are drawn; none: those of the ego"""
    size_variation: float = Field(default=0.05, ge=0, lt=1)
    """sizes of uncontrolled vehicles are drawn uniformly from 1 ± this, times the above (own choice)"""

    def road(self) -> Road:
        """The road of every trial."""
        return self.road_of(self.road_length)


def initial_scene(settings: InitialSettings, vehicles: int, rng: np.random.Generator, on_ramp: bool = False) -> Scene:
    """Draw the ego and ``vehicles`` others by rejection: all anew until none is too close to another.

    Where they are so dense that this does not succeed, or have sizes of their own, of which the long ones would be
    rejected more often, those that are too close to another find other places. Some are ``on_ramp`` only if they know
    how to leave it.

    Raises:
        StartError: the vehicles cannot be placed.
    """
    road, slots = settings.road(), vehicles + 1
    first = 0 if on_ramp else road.lanes - settings.lanes
    for _ in range(0 if settings.sizes or vehicles >= _MANY else _ATTEMPTS):
        sizes, places = _draw_sizes(settings, slots, rng), _draw_places(settings, road, first, slots, rng)
        if not _misplaced(settings, road, sizes, places).any():
            return _scene(settings, road, sizes, places)
    sizes = _draw_sizes(settings, slots, rng)
    for _ in range(_ATTEMPTS // _REPAIRS):
        places = _draw_places(settings, road, first, slots, rng)
        for _ in range(_REPAIRS):
            misplaced = _misplaced(settings, road, sizes, places)
            if not misplaced.any():
                return _scene(settings, road, sizes, places)
            places = np.where(misplaced, _draw_places(settings, road, first, slots, rng), places)
    raise StartError(
        f"{vehicles} uncontrolled vehicles of {settings.length} m could not be placed on {settings.lanes} lanes "
        f"between lon {settings.behind} and {settings.ahead} m with gaps of {settings.gap} m in {_ATTEMPTS} "
        "attempts; use fewer vehicles, a longer stretch or a smaller gap"
    )


def _draw_sizes(settings: InitialSettings, slots: int, rng: np.random.Generator) -> Float[np.ndarray, "2 A"]:
    """Lengths and widths [m]."""
    scale = rng.uniform(1 - settings.size_variation, 1 + settings.size_variation, (2, slots))
    scale[:, EGO] = 1.0
    sizes = np.tile([[settings.length], [settings.width]], slots)
    if settings.sizes:
        sizes[:, EGO + 1 :] = rng.choice(settings.sizes, slots - 1).T
    return sizes * scale


def _draw_places(
    settings: InitialSettings, road: Road, first: int, slots: int, rng: np.random.Generator
) -> Float[np.ndarray, "2 A"]:
    """Lanes, from the first one on, and lon [m]."""
    lane = rng.integers(first, road.lanes, size=slots)
    lon = settings.position + rng.uniform(settings.behind, settings.ahead, slots)
    lane[EGO], lon[EGO] = road.lanes - settings.lanes, settings.position
    return np.stack([lane, lon])


def _misplaced(
    settings: InitialSettings, road: Road, sizes: Float[np.ndarray, "2 A"], places: Float[np.ndarray, "2 A"]
) -> Bool[np.ndarray, " A"]:
    """Who is too close to somebody in an earlier slot, or where there is no lane."""
    (lane, lon), length = places, sizes[0]
    too_close = (lane[:, None] == lane) & (np.abs(lon[:, None] - lon) < (length[:, None] + length) / 2 + settings.gap)
    there = road.has_lane(lon + length)[np.arange(len(lon)), lane.astype(int)]
    return np.tril(too_close, -1).any(1) | ~there


def _scene(
    settings: InitialSettings, road: Road, sizes: Float[np.ndarray, "2 A"], places: Float[np.ndarray, "2 A"]
) -> Scene:
    """All of them in the middle of their lanes."""
    lane, lon = places
    speed = np.full(len(lon), settings.traffic_speed)
    speed[EGO] = settings.ego_speed
    return Scene(
        lon=lon,
        lat=np.asarray(road.centres)[lane.astype(int)],
        speed=speed,
        heading=np.zeros(len(lon)),
        length=sizes[0],
        width=sizes[1],
        valid=np.ones(len(lon), dtype=bool),
    )
