"""Drives in SUMO (Alvarez Lopez et al., *Microscopic Traffic Simulation using SUMO*, 2018), in this process.

Its positions are those of front bumpers and its angles are degrees clockwise from north.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from coverdrive.bridges.world import FAR, Car, Observation
from coverdrive.driving.driver import Command
from coverdrive.errors import DataError, SettingError
from coverdrive.extras import require
from coverdrive.planning.problem.vehicle import moved
from coverdrive.recordings.roads.drawn_road import DrawnLane, drawn_road

_ANYWHERE, _FREELY, _UNCHECKED = -1, 2, 0
"""lane index, how to map positions to the network, and bits of speed and lane change modes"""

_QUIETLY = ("--no-step-log", "--no-warnings", "--collision.action", "warn", "--collision.mingap-factor", "0")
"""options unless others are given: vehicles in contact stay where they are, and near is not in contact"""


class Sumo:
    """A simulation of SUMO with one vehicle of its demand as the ego, as a `coverdrive.bridges.world.World`.

    libsumo is one simulation in a process: the one that was reset last.
    """

    def __init__(self, options: Sequence[str], ego: str, period: float = 0.1):
        """Be ready to simulate.

        Args:
            options: of the command ``sumo`` but for ``--seed`` and ``--step-length``; lane changes take no time unless
                ``--lanechange.duration`` says so.
            ego: name of a vehicle of the demand, which SUMO drives until it has departed.
            period: [s] of a step.

        Raises:
            MissingExtraError: libsumo is not installed.
        """
        self._sumo = require("libsumo")
        self._options, self._ego, self._period = list(options), ego, period
        self.done, self.crashed = True, False
        self.car = Car(math.nan, math.nan, period)
        """the ego, whose size is known from the first reset on, and how often it is driven"""

    def reset(self, seed: int) -> None:
        """Simulate until the ego has departed; a DataError if it does not."""
        sumo = self._sumo
        if sumo.isLoaded():
            sumo.close()
        steps = "--step-length", str(self._period), "--seed", str(seed)
        sumo.start(["sumo", *_QUIETLY, *self._options, *steps])
        while self._ego not in sumo.simulation.getDepartedIDList():
            if sumo.simulation.getMinExpectedNumber() == 0:
                raise DataError(f"no vehicle {self._ego!r} has departed; expected one in the demand")
            sumo.simulationStep()
        self._road, self.car = drawn_road(self._lanes()), Car(*self._size(self._ego), self._period)
        self._own, self.done, self.crashed = self._state(self._ego), False, False

    def observe(self) -> Observation:
        """Everybody nearby who does not come from the other direction."""
        if not self._sumo.isLoaded():
            raise SettingError("no drive has begun; reset the world first")
        others = dict[Any, Any]()
        for name in self._sumo.vehicle.getIDList():
            state = self._state(name)
            near = math.dist(state[:2], self._own[:2]) < FAR and math.cos(state[3] - self._own[3]) > 0
            if near and name != self._ego:
                others[name] = state, self._size(name)
        return Observation(self._own, others, self._road)

    def apply(self, command: Command | None) -> None:
        """Go on by one period; without a command SUMO's own driver models drive."""
        vehicle, ego = self._sumo.vehicle, self._ego
        if command is not None:
            vehicle.setSpeedMode(ego, _UNCHECKED)
            vehicle.setLaneChangeMode(ego, _UNCHECKED)
            x, y, speed, heading = moved(self._own, (command.acceleration, command.yaw_rate), self._period)
            self._own, ahead = (float(x), float(y), float(speed), float(heading)), vehicle.getLength(ego) / 2
            front = self._own[0] + ahead * math.cos(heading), self._own[1] + ahead * math.sin(heading)
            vehicle.moveToXY(ego, "", _ANYWHERE, *front, 90 - math.degrees(heading), _FREELY)
        self._sumo.simulationStep()
        there = ego in vehicle.getIDList()
        if there and command is None:
            self._own = self._state(ego)
        left = self._road.length - self._road.to_road(*self._own[:2])[0]
        self.crashed = any(ego in (each.collider, each.victim) for each in self._sumo.simulation.getCollisions())
        self.done = self.crashed or not there or left < self._own[2] * self._period + vehicle.getLength(ego)

    def _state(self, name: str) -> tuple[float, float, float, float]:
        """x [m], y [m], speed [m/s] and heading [rad] of a vehicle's centre."""
        vehicle = self._sumo.vehicle
        (x, y), heading = vehicle.getPosition(name), math.radians(90 - vehicle.getAngle(name))
        back = vehicle.getLength(name) / 2
        return x - back * math.cos(heading), y - back * math.sin(heading), vehicle.getSpeed(name), heading

    def _size(self, name: str) -> tuple[float, float]:
        """[m] length and width of a vehicle."""
        return self._sumo.vehicle.getLength(name), self._sumo.vehicle.getWidth(name)

    def _lanes(self) -> list[DrawnLane]:
        """The lanes of the ego's route, each as far as it goes on, from the leftmost one at its beginning on."""
        sumo, lanes = self._sumo, list[DrawnLane]()
        edges = sumo.vehicle.getRoute(self._ego)
        free = [f"{edge}_{index}" for edge in edges for index in reversed(range(sumo.edge.getLaneNumber(edge)))]
        while free:
            chain = [free.pop(0)]
            while following := [link[0] for link in sumo.lane.getLinks(chain[-1]) if link[0] in free]:
                chain.append(following[0])
                free.remove(following[0])
            parts = [DrawnLane.around(np.array(sumo.lane.getShape(lane)), sumo.lane.getWidth(lane)) for lane in chain]
            lanes.append(DrawnLane(*(np.concatenate(bounds) for bounds in zip(*parts, strict=True))))
        return lanes
