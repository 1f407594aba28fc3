"""A seeded straight freeway of IDM and MOBIL drivers: the state of many scenes and how it goes on.

S scenes of A vehicle slots are driven at once. A vehicle that changes lanes is in both lanes until it has arrived; its
lateral motion is a polynomial of fifth order in its progress, slowed down with the vehicle at low speed.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from coverdrive.simulation.drivers import Drivers, Neighbours, Values, follow, lane_change_advantage, neighbours

HARDEST, STRONGEST = -7.5, 4.0
"""[m/s²] limits of every acceleration: emergency braking on a dry road, a strong car"""

FLUENT = 10.0
"""[m/s] speed below which lane changes slow down with the vehicle"""

SLOWEST_CHANGE = 5.0
"""[m/s] no lane change begins below this speed"""

PAUSE = 5.0
"""[s] a driver usually stays in a lane at least"""

DECISION = 0.5
"""[s] between two moments at which lane changes are decided, at most one in each scene"""

EASE, PICK_UP = 1.0, 3.0
"""[m/s²] how fast a desired speed usually falls, and rises"""

SLOWING = 0.7
"""Largest share by which a driver slows down; small ones are more frequent"""

CRAWL = 1.0
"""[m/s] smallest desired speed of a driver who slows down"""


@dataclass
class Freeway:
    """The moving state of S scenes; the only mutable struct of the package's generator."""

    drivers: Drivers
    """their desired speed is that of the moment"""
    usual_speed: Values
    """[m/s] desired speed when nothing slows the driver down"""
    moody: Bool[np.ndarray, "S A"]
    """whether the driver changes the desired speed now and then"""
    length: Values
    width: Values
    valid: Bool[np.ndarray, "S A"]
    """whether the slot holds a vehicle"""
    lon: Values
    """of the centre; this and the sizes in m"""
    speed: Values
    """[m/s] along the road"""
    lane: Int[np.ndarray, "S A"]
    """lane, or the one that is being left"""
    change_duration: Values
    """[s] of a lane change at full speed"""
    wander: Float[np.ndarray, "S A 3"]
    """amplitude [m], wave length [m] and phase [rad] of the motion within the lane"""
    pause: float = PAUSE
    """[s] a driver stays in a lane at least"""
    ease: float = EASE
    """[m/s²] how fast a desired speed falls"""

    def __post_init__(self) -> None:
        """Start without lane changes and with usual desires."""
        self.progress = np.zeros_like(self.lon)  # of the lane change, 0 to 1
        self.wait = np.zeros_like(self.lon)  # [s] until the driver thinks of a lane change again
        self.target = self.lane.copy()  # or the lane that is being entered
        self.goal = self.usual_speed.copy()  # [m/s] that the desired speed moves to

    def states(self, lane_width: float) -> Float[np.ndarray, "S A 4"]:
        """Lon, lat [m], speed [m/s] and heading [rad] of all vehicles."""
        s = self.progress
        way = (self.target - self.lane) * lane_width
        amplitude, wave, phase = np.moveaxis(self.wander, -1, 0)
        angle = 2 * np.pi * self.lon / wave + phase
        lat = (self.lane + 0.5) * lane_width + way * s**3 * (10 - 15 * s + 6 * s**2) + amplitude * np.sin(angle)
        pace = way * 30 * s**2 * (1 - s) ** 2 * self._progress_rate()
        lat_rate = pace + amplitude * np.cos(angle) * 2 * np.pi / wave * self.speed
        speed, heading = np.hypot(self.speed, lat_rate), np.arctan2(lat_rate, self.speed)
        return np.stack([self.lon, lat, speed, heading], axis=-1)

    def advance(self, dt: float) -> None:
        """Drive for dt [s] behind the vehicle ahead in all lanes that are used."""
        ahead = self._neighbours(self._shares_lane())
        acceleration = follow(self.drivers, self.speed, ahead.gap, np.take_along_axis(self.speed, ahead.leader, 1))
        faster = self.speed + np.clip(acceleration, HARDEST, STRONGEST) * dt
        self.progress = np.minimum(1.0, self.progress + self._progress_rate() * dt)
        arrived = self.progress >= 1
        self.lane = np.where(arrived, self.target, self.lane)
        self.progress = np.where(arrived, 0.0, self.progress)
        self.wait = np.where(arrived, self.pause, np.maximum(0.0, self.wait - dt))
        self.lon = self.lon + (self.speed + np.maximum(0.0, faster)) / 2 * dt
        self.speed = np.maximum(0.0, faster)

    def change_desires(self, random: np.random.Generator, dt: float, pause: float) -> None:
        """Let moody drivers pick another desired speed every ``pause`` [s] on average, and move towards it."""
        picks = self.moody & (random.random(self.lon.shape) < dt / pause)
        picked = np.maximum(CRAWL, self.usual_speed * (1 - SLOWING * random.random(self.lon.shape) ** 2))
        self.goal = np.where(picks, picked, self.goal)
        desired = self.drivers.desired_speed
        desired += np.clip(self.goal - desired, -self.ease * dt, PICK_UP * dt)

    def change_lanes(self, lanes: int) -> None:
        """Begin the most advantageous lane change of every scene, if there is any."""
        current = self._neighbours(self._shares_lane())
        free = self.valid & (self.lane == self.target) & (self.wait <= 0) & (self.speed > SLOWEST_CHANGE)
        best = np.full(self.lon.shape, -np.inf)
        side = np.zeros_like(self.lane)
        for step in (-1, 1):
            to = self.lane + step
            there = (self.lane[:, None] == to[..., None]) | (self.target[:, None] == to[..., None])
            target = self._neighbours(there)
            advantage = lane_change_advantage(self.drivers, self.speed, self.length, current, target)
            advantage = np.where(free & (to >= 0) & (to < lanes), advantage, -np.inf)
            side = np.where(advantage > best, step, side)
            best = np.maximum(best, advantage)
        scenes = np.flatnonzero(best.max(1) > 0)
        who = best.argmax(1)[scenes]
        self.target[scenes, who] += side[scenes, who]

    def _progress_rate(self) -> Values:
        """[1/s] of the lane changes that are going on."""
        pace = np.minimum(1.0, self.speed / FLUENT) / self.change_duration
        return np.where(self.lane == self.target, 0.0, pace)

    def _shares_lane(self) -> Bool[np.ndarray, "S A A"]:
        """Whether vehicle j is in a lane that vehicle i uses."""
        pairs = [(a[:, None], b[..., None]) for a in (self.lane, self.target) for b in (self.lane, self.target)]
        return np.logical_or.reduce([a == b for a, b in pairs])

    def _neighbours(self, there: Bool[np.ndarray, "S A A"]) -> Neighbours:
        return neighbours(self.lon, self.length, there & self.valid[:, None])
