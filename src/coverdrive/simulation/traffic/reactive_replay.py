"""Replayed traffic that reacts: recorded vehicles drive as they did until the ego is in their way.

Then they follow it on their recorded path, by the Intelligent Driver Model (`coverdrive.simulation.drivers.idm_mobil`),
and go back to where they were recorded as soon as they may. The ego is in the way if its body, or that of a vehicle
that is late because of it, is ahead on the path and the model brakes harder than was recorded. Who follows the ego at
the start at less than the usual gap is content with that. Nobody leaves the recorded path or is ahead of the recording,
and nobody minds an ego behind. A vehicle slots, n moments of a path, F moments of a recording.
"""

from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field

from coverdrive.geometry import turned_half_extents
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drivers.idm_mobil import FREE, Drivers, follow
from coverdrive.simulation.roads.initial import EGO
from coverdrive.simulation.traffic.model import TrafficStep
from coverdrive.simulation.traffic.motion import with_states
from coverdrive.simulation.traffic.replay import ReplaySettings, ReplayTraffic

_BACK = 0.1
"""[m] behind its recorded place from which on a vehicle is back there, if it is about as fast as it was"""
_PROMPT = 0.3
"""[s] in which who is late takes a lower speed that was recorded"""


class ReactiveReplaySettings(ReplaySettings):
    """Recorded traffic that reacts to the ego."""

    kind: Literal["reactive-replay"] = "reactive-replay"  # pyright: ignore[reportIncompatibleVariableOverride]
    """name of this traffic"""
    time_gap: float = Field(default=1.0, gt=0, le=20)
    """[s] time gap to the ego (Kesting, Treiber & Helbing 2010: 1.0 to 1.5 s)"""
    minimum_gap: float = Field(default=2.0, gt=0, le=100)
    """[m] bumper to bumper at standstill (Treiber et al. 2000)"""
    acceleration: float = Field(default=1.4, gt=0, le=4)
    """[m/s²] largest acceleration of who is late (Kesting et al. 2010)"""
    deceleration: float = Field(default=2.0, gt=0, le=15)
    """[m/s²] comfortable deceleration (Kesting et al. 2010)"""
    hardest: float = Field(default=8.0, gt=0, le=15)
    """[m/s²] hardest deceleration"""
    catching_up: float = Field(default=5.0, ge=4, le=1000)
    """[s] in which a vehicle that is late wants to make up for most of it"""


class _Path(NamedTuple):
    """Where one vehicle was recorded, from its first moment to its last one."""

    time: Float[np.ndarray, " n"]
    """[s]"""
    way: Float[np.ndarray, " n"]
    """[m] that it had driven"""
    states: Float[np.ndarray, "n 4"]
    lon: Float[np.ndarray, " n"]
    """[m] that never falls"""

    @staticmethod
    def of(states: Float[np.ndarray, "F 4"], valid: Bool[np.ndarray, " F"], dt: float) -> "_Path":
        """Of the moments of which it is known."""
        known = states[valid]
        way = np.cumsum(np.hypot(*np.diff(known[:, :2], axis=0, prepend=known[:1, :2]).T))
        return _Path(dt * np.flatnonzero(valid), way, known, np.maximum.accumulate(known[:, 0]))

    def way_at(self, time: float) -> float:
        """[m] that it had driven; it goes on as it was seen last."""
        return float(np.interp(time, self.time, self.way)) + max(0.0, time - self.time[-1]) * float(self.states[-1, 2])

    def state_at(self, way: float, speed: float) -> Float[np.ndarray, " 4"]:
        """The state of who drives with another speed [m/s] where it was after such a way [m]."""
        lon, lat, heading = (np.interp(way, self.way, self.states[:, column]) for column in (0, 1, 3))
        return np.array([lon, lat, speed, heading])


class ReactiveReplayTraffic(ReplayTraffic):
    """Uncontrolled vehicles that do what they did when they were recorded, unless the ego is in their way."""

    _settings: ReactiveReplaySettings

    def reset(self, scene: Scene, road: Road, rng: np.random.Generator) -> None:
        """Begin the scene that `start` has drawn."""
        super().reset(scene, road, rng)
        own, slots = self._settings, scene.vehicles
        self._paths = {
            slot: _Path.of(self._states[:, slot - 1], self._valid[:, slot - 1], self._dt) for slot in range(1, slots)
        }
        self._late, self._way = np.zeros(slots, dtype=bool), np.zeros(slots)
        gap, _ = self._leaders(scene)
        least = np.clip(gap, 0.1, own.minimum_gap)
        headway = np.clip((gap - least) / np.maximum(scene.speed, 0.1), 0.0, own.time_gap)
        pace, brake = np.full(slots, own.acceleration), np.full(slots, own.deceleration)
        nothing = np.zeros(slots)
        self._drivers = Drivers(np.full(slots, np.inf), headway, least, pace, brake, nothing, nothing, nothing)

    def step(self, scene: Scene, dt: float) -> TrafficStep:
        """Show the recorded vehicles ``dt`` [s] later, late ones where they are by then."""
        recorded, own = super().step(scene, dt), self._settings
        states, valid, before = recorded.scene.states, np.array(recorded.scene.valid), scene.states
        gap, leader_speed = self._leaders(scene)
        allowed = follow(self._drivers, before[:, 2], gap, leader_speed)
        braking = allowed < np.minimum((states[:, 2] - before[:, 2]) / dt, 0.0)
        begins = np.asarray(scene.valid) & valid & (gap < FREE) & braking & ~self._late
        for slot in np.flatnonzero(begins).tolist():
            self._way[slot] = self._paths[slot].way_at(self._time - dt)
        self._late |= begins
        for slot in np.flatnonzero(self._late).tolist():
            path, speed = self._paths[slot], before[slot, 2]
            there = path.way_at(self._time)
            usual = (there - path.way_at(self._time - dt)) / dt
            wish = usual + (there - self._way[slot]) / own.catching_up - speed
            wish = min(wish if wish > 0 else wish / _PROMPT, own.acceleration, float(allowed[slot]))
            speed_after = max(0.0, speed + dt * max(wish, -own.hardest))
            self._way[slot] = min(self._way[slot] + dt * (speed + speed_after) / 2, there)
            gone = self._way[slot] >= path.way[-1]
            apart = abs(speed - states[slot, 2]) > own.hardest * dt or self._way[slot] < there - _BACK
            self._late[slot] = not gone and (braking[slot] or apart)
            if self._late[slot]:
                states[slot], valid[slot] = path.state_at(self._way[slot], speed_after), True
            elif gone and self._time > path.time[-1]:
                valid[slot] = False
        for slot in np.flatnonzero(valid & ~np.asarray(scene.valid) & ~self._late):  # who appears waits for room
            sizes = 2 * scene.half_sizes
            near = self._in_the_way(states[slot], sizes[slot], states, sizes)
            valid[slot] = not (near & self._late).any()
        return replace(recorded, scene=replace(with_states(recorded.scene, states), valid=valid))

    def _leaders(self, scene: Scene) -> tuple[Float[np.ndarray, " A"], Float[np.ndarray, " A"]]:
        """Gap [m] to whom each slot minds next on its path, and that one's speed [m/s] along the road.

        Who is late minds everybody, all others the ego and who is late. The gap is `FREE` where there is nobody.
        """
        states, valid = scene.states, np.asarray(scene.valid)
        half = turned_half_extents(scene.half_sizes, states[:, 3])
        gap, speed = np.full(scene.vehicles, FREE), states[:, 2] * np.cos(states[:, 3])
        minded, leader_speed = valid & (self._late | (np.arange(scene.vehicles) == EGO)), np.zeros(scene.vehicles)
        for slot in np.flatnonzero(valid)[1:].tolist():
            others = np.flatnonzero((valid if self._late[slot] else minded) & (states[:, 0] > states[slot, 0]))
            path, reach = self._paths[slot], half[others] + half[slot]
            touching = np.maximum(states[others, 0] - reach[:, 0], states[slot, 0])
            aside = np.abs(np.interp(touching, path.lon, path.states[:, 1]) - states[others, 1])
            apart = np.where(aside < reach[:, 1], states[others, 0] - states[slot, 0] - reach[:, 0], FREE)
            if len(others) and apart.min() < FREE:
                gap[slot], leader_speed[slot] = apart.min(), speed[others[apart.argmin()]]
        return gap, leader_speed
