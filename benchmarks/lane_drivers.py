"""Baselines that keep to their lane, as planners: at constant speed, and behind their leader by IDM."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from coverdrive.driving.single_track import BMW
from coverdrive.paths import PredictedPaths
from coverdrive.planning.plan import Plan, Status
from coverdrive.planning.search import lane_seeking
from coverdrive.road import Road
from coverdrive.simulation.drivers import FREE, DriverSettings, draw_drivers, follow

Acceleration = Callable[[Float[np.ndarray, " 4"], PredictedPaths, Road], float]
_DRIVER = draw_drivers(DriverSettings(spread=0.0), np.random.default_rng(0), (1,))


class LaneDriver:
    """Steers to the centre of the lane that it starts in; what it accelerates by is given."""

    def __init__(self, acceleration: Acceleration):
        self._acceleration = acceleration
        self.dt, self.steps = 0.25, 12
        self._lane: int | None = None

    def reset(self, period: float) -> None:
        """Forget the lane."""
        self._lane = None

    def plan(self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> Plan:
        """One input, said for the whole horizon."""
        lon, lat, speed, heading = state.tolist()
        if self._lane is None:
            self._lane = int(road.lane_at(lon, lat))
        edges = road.edges_at(lon)
        centre = float(edges[self._lane] + edges[self._lane + 1]) / 2
        turn = lane_seeking(lat, speed, heading, centre, 1.0)
        inputs = np.tile([self._acceleration(state, paths, road), turn], (12, 1))
        states = np.tile(state, (13, 1))
        states[:, 0] += speed * self.dt * np.arange(13)
        return Plan(states, inputs, np.zeros(12), Status.SOLVED, 0.0, 0.0, self.dt)


def constant(state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> float:
    return 0.0


def idm(state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> float:
    """The Intelligent Driver Model of a usual driver behind the nearest vehicle in the lane."""
    lon, lat = paths.points[:, 0].T
    ahead = (road.lane_at(lon, lat) == road.lane_at(state[0], state[1])) & (lon > state[0])
    gap, leader = FREE, 0.0
    if ahead.any():
        first = np.flatnonzero(ahead)[np.argmin(lon[ahead])]
        gap = float(lon[first] - state[0] - paths.half_sizes[first, 0, 0]) - BMW.l / 2
        leader = float(paths.points[first, 1, 0] - lon[first]) / paths.dt
    values = follow(_DRIVER, np.array([state[2]]), np.array([gap]), np.array([leader]))
    return float(np.clip(values[0], -8.0, 3.0))
