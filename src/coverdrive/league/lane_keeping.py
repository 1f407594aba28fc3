"""Agents that keep to the lane of the start, at constant speed or behind the leader by IDM."""

import numpy as np

from coverdrive.planning.search import lane_seeking
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drivers import FREE, DriverSettings, draw_drivers, follow
from coverdrive.simulation.initial import EGO

_HARDEST, _FASTEST = -8.0, 3.0
"""[m/s²]"""


class KeepVelocity:
    """Steers to the centre of the lane that it starts in; implements `coverdrive.league.agents.Agent`."""

    def reset(self, period: float) -> None:
        """Forget the lane."""
        self._lane: int | None = None

    def act(self, scene: Scene, road: Road) -> tuple[float, float]:
        """Keep the speed and the lane."""
        lon, lat, speed, heading = scene.states[EGO].tolist()
        if self._lane is None:
            self._lane = int(road.lane_at(lon, lat))
        edges = road.edges_at(lon)
        centre = float(edges[self._lane] + edges[self._lane + 1]) / 2
        return self._acceleration(scene, road), float(lane_seeking(lat, speed, heading, centre, 1.0))

    def _acceleration(self, scene: Scene, road: Road) -> float:
        return 0.0


class Idm(KeepVelocity):
    """The same with the Intelligent Driver Model of a usual driver behind the nearest vehicle in the lane.

    It wants the 30 m/s of `coverdrive.simulation.drivers.DriverSettings` wherever it is: who wants no more than the
    speed of the start is run into where traffic gets faster.
    """

    def __init__(self):
        """Drive as everybody does on average."""
        self._driver = draw_drivers(DriverSettings(spread=0.0), np.random.default_rng(0), (1,))

    def _acceleration(self, scene: Scene, road: Road) -> float:
        lon, lat, speed, heading = scene.states.T
        lane = road.lane_at(lon, lat)
        ahead = np.flatnonzero(scene.valid & (lane == lane[EGO]) & (lon > lon[EGO]))
        gap, leading = FREE, 0.0
        if len(ahead):
            leader = ahead[np.argmin(lon[ahead])]
            gap = float(lon[leader] - lon[EGO] - scene.half_sizes[[leader, EGO], 0].sum())
            leading = float(speed[leader] * np.cos(heading[leader]))
        wanted = follow(self._driver, speed[[EGO]], np.array([gap]), np.array([leading]))
        return float(np.clip(wanted[0], _HARDEST, _FASTEST))
