"""Mixed traffic: some vehicles drive random members of their predicted sets, the others as IDM and MOBIL drivers do.

Each kind takes the vehicles of the other into account as it does the ego: the drivers as vehicles in their lanes,
the set-sampling vehicles at constant velocity.
"""

from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.settings import Settings
from coverdrive.simulation.predictor import Predictor
from coverdrive.simulation.roads.course import Course
from coverdrive.simulation.roads.initial import EGO, InitialSettings
from coverdrive.simulation.traffic.driver_traffic import DriverTraffic, DriverTrafficSettings
from coverdrive.simulation.traffic.model import Start, TrafficStep
from coverdrive.simulation.traffic.motion import with_states
from coverdrive.simulation.traffic.set_sampling import SetSamplingSettings, SetSamplingTraffic


class MixedTrafficSettings(Settings):
    """Set-sampling vehicles among drivers."""

    kind: Literal["mixed"] = "mixed"
    """name of this traffic"""
    share: float = Field(default=0.5, ge=0, le=1)
    """probability with which a vehicle is a driver"""
    drivers: DriverTrafficSettings = DriverTrafficSettings()
    """of the vehicles that are drivers"""
    set_sampling: SetSamplingSettings = SetSamplingSettings()
    """of the others"""


class MixedTraffic:
    """Every vehicle belongs to one of two models for a whole episode."""

    def __init__(self, predictor: Predictor, settings: MixedTrafficSettings | None = None):
        """Take the sets from ``predictor``; call `reset` before the first step."""
        self._settings = settings or MixedTrafficSettings()
        self._drivers = DriverTraffic(self._settings.drivers)
        self._sampling = SetSamplingTraffic(predictor, self._settings.set_sampling)

    def start(self, settings: InitialSettings, vehicles: int, rng: np.random.Generator) -> Start:
        """As the drivers start."""
        return self._drivers.start(settings, vehicles, rng)

    def reset(self, scene: Scene, road: Road, rng: np.random.Generator) -> None:
        """Draw who is a driver; those in lanes that end are."""
        uncontrolled = np.arange(scene.vehicles) != EGO
        ending = Course(road).way_out[road.lane_at(scene.lon, scene.lat)] != 0
        self._driven = uncontrolled & (ending | (rng.random(scene.vehicles) < self._settings.share))
        self._drivers.reset(scene, road, rng, self._driven)
        self._sampling.reset(scene, road, rng, uncontrolled & ~self._driven)

    def step(self, scene: Scene, dt: float) -> TrafficStep:
        """Move both kinds at once, each seeing the other where it is now."""
        driven, sampled = self._drivers.step(scene, dt), self._sampling.step(scene, dt)
        states = np.where(self._driven[:, None], driven.scene.states, sampled.scene.states)
        return replace(sampled, scene=with_states(scene, states))
