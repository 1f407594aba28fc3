"""Drives in highway-env (E. Leurent, *An Environment for Autonomous Driving Decision-Making*, 2018), on straight roads.

Its y runs to the right of the road and its angles turn clockwise, so that a left turn is positive here and negative
there. Its vehicles are single-track models whose centre moves at a slip angle to their heading, in steps of Euler.
"""

import math
from importlib import import_module
from typing import Any

import numpy as np

from coverdrive.bridges.world import FAR, Car, Observation
from coverdrive.driving.driver import Command
from coverdrive.errors import DataError
from coverdrive.extras import require
from coverdrive.road import Road

STEEPEST = 8.0
"""[m/s²] acceleration of the action space, to both sides"""

CONFIG = {
    "observation": {"type": "AttributesObservation", "attributes": []},
    "action": {"type": "ContinuousAction", "acceleration_range": (-STEEPEST, STEEPEST)},
    "policy_frequency": 10,
    "simulation_frequency": 10,
}
"""with which it is made: nothing is observed but through `HighwayEnv.observe`, 10 times a second"""


class HighwayEnv:
    """An environment of highway-env as a `coverdrive.bridges.world.World`."""

    def __init__(self, name: str = "highway-v0", render_mode: str | None = None, **config: Any):
        """Make the environment.

        Args:
            name: of an environment whose road is straight.
            render_mode: as of gymnasium.
            config: what is to be unlike highway-env's defaults and `CONFIG`.

        Raises:
            MissingExtraError: highway-env is not installed.
            DataError: it cannot be made so, or its road is not straight.
        """
        require("highway_env")
        gymnasium = require("gymnasium")
        try:
            self.env = gymnasium.make(name, config=CONFIG | config, render_mode=render_mode, disable_env_checker=True)
        except gymnasium.error.Error:
            raise
        except Exception as error:
            problem = f"{name} cannot be made with continuous actions ({type(error).__name__}: {error})"
            raise DataError(f"{problem}; choose an environment of one straight road along x, as highway-v0") from error
        self.done, self._road = True, _road(self._base.road.network.graph)

    @property
    def _base(self) -> Any:
        return self.env.unwrapped

    @property
    def car(self) -> Car:
        """The ego, and how often it is driven."""
        ego = self._base.vehicle
        return Car(ego.LENGTH, ego.WIDTH, self._frames / self._base.config["simulation_frequency"])

    @property
    def _frames(self) -> int:
        """Steps of highway-env in a period."""
        return self._base.config["simulation_frequency"] // self._base.config["policy_frequency"]

    @property
    def crashed(self) -> bool:
        """Whether the ego has, as highway-env sees it."""
        return bool(self._base.vehicle.crashed)

    def reset(self, seed: int) -> None:
        """Begin the episode of a seed."""
        self.env.reset(seed=seed)
        self.done = False
        self._road = _road(self._base.road.network.graph)

    def observe(self) -> Observation:
        """Everybody and everything solid nearby, mirrored."""
        base, others = self._base, dict[Any, Any]()
        ego = base.vehicle
        for each in (*base.road.vehicles, *base.road.objects):
            if each is not ego and each.solid and abs(each.position[0] - ego.position[0]) < FAR:
                others[id(each)] = _mirrored(each), (each.LENGTH, each.WIDTH)
        return Observation(_mirrored(ego), others, self._road)

    def apply(self, command: Command | None) -> None:
        """Go on by one period; without a command IDM and MOBIL drive, which want the speed limit."""
        if command is None:
            self._hand_over()
            action = np.zeros(2)
        else:
            wanted = command.acceleration, self._steering(command)
            ranges = self._base.action_type.acceleration_range, self._base.action_type.steering_range
            action = np.array([np.interp(value, of, (-1, 1)) for value, of in zip(wanted, ranges, strict=True)])
        *_, ended, cut, _ = self.env.step(action)
        self.done = bool(ended or cut)

    def _steering(self, command: Command) -> float:
        """[rad] of the wheels that gives the yaw rate on average over the frames of the period."""
        ego = self._base.vehicle
        speed = ego.speed + command.acceleration * (self._frames - 1) / 2 / self._base.config["simulation_frequency"]
        slip = math.asin(max(-1.0, min(1.0, -command.yaw_rate * ego.LENGTH / 2 / max(speed, 1e-9))))
        return math.atan(2 * math.tan(slip))

    def _hand_over(self) -> None:
        """Let the environment's own driver drive the ego."""
        base, kind = self._base, import_module("highway_env.vehicle.behavior").IDMVehicle
        ego = base.vehicle
        if not isinstance(ego, kind):
            own = kind(base.road, ego.position, ego.heading, ego.speed, target_speed=ego.lane.speed_limit)
            base.road.vehicles[base.road.vehicles.index(ego)] = base.vehicle = own


def _mirrored(vehicle: Any) -> tuple[float, float, float, float]:
    """Its state in a map whose y is to the left."""
    x, y = vehicle.position
    return float(x), -float(y), float(vehicle.speed), -float(vehicle.heading)


def _road(graph: dict[str, dict[str, list[Any]]]) -> Road:
    """The road of parallel lanes, named from left to right, along highway-env's x."""
    lanes, *more = (lanes for ends in graph.values() for lanes in ends.values())
    along = np.linspace(0.0, lanes[0].length, 5)
    if more or not np.allclose([lane.heading_at(each) for lane in lanes for each in along], 0.0):
        raise DataError("the road is not one straight road along x; choose an environment that has one, as highway-v0")
    centres = np.array([-lane.position(0.0, 0.0)[1] for lane in lanes])
    widths = np.array([lane.width_at(0.0) for lane in lanes])
    edges = np.append(centres + widths / 2, centres[-1] - widths[-1] / 2)[::-1]
    return Road(edges=edges, length=float(lanes[0].length), speed_limit=lanes[0].speed_limit)
