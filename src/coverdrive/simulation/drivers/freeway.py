"""A seeded freeway of IDM and MOBIL drivers: the state of many scenes and how it goes on.

S scenes of A vehicle slots are driven at once. A vehicle that changes lanes is in both lanes until it has arrived; its
lateral motion is a polynomial of fifth order in its progress, slowed down with the vehicle at low speed. Drivers leave
lanes that end and let others in (`coverdrive.simulation.drivers.merging`), and slow down in bends
(`coverdrive.simulation.roads.course`). Distances are along the reference line of the road, speeds the rates of lon.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from coverdrive.compiled import compiled
from coverdrive.simulation.drivers.idm_mobil import (
    FREE,
    Drivers,
    Neighbours,
    Values,
    follow,
    lane_change_advantage,
    neighbours,
    of,
)
from coverdrive.simulation.drivers.merging import (
    RELAXATION,
    Pressure,
    accepts,
    giving_way,
    in_haste,
    pressure,
    stopping,
)
from coverdrive.simulation.roads.course import Course

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

_FIRST = 1e3
"""[m/s²] advantage of a lane change that has to be"""

CRAWL = 1.0
"""[m/s] smallest desired speed of a driver who slows down"""


@dataclass
class Freeway:
    """The moving state of S scenes; the only mutable struct of the package's generator."""

    course: Course
    drivers: Drivers
    """their desired speed and time gap are the usual ones at the start, and then those of the moment"""
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
        """Start without lane changes."""
        own = (np.array(each, order="C") for each in (self.lon, self.speed, self.lane))  # they change
        self.lon, self.speed, self.lane = own
        self.progress = np.zeros_like(self.lon)  # of the lane change, 0 to 1
        self.wait = np.zeros_like(self.lon)  # [s] until the driver thinks of a lane change again
        self.target = self.lane.copy()  # or the lane that is being entered
        self.usual_speed = self.drivers.desired_speed.copy()  # [m/s] when nothing slows the driver down
        self.goal = self.usual_speed.copy()  # [m/s] that the desired speed moves to
        self.usual_gap = self.drivers.time_gap.copy()  # [s]
        self.boldness = self.usual_speed / np.median(self.usual_speed)

    def states(self, lane_width: float) -> Float[np.ndarray, "S A 4"]:
        """Lon, lat [m], speed [m/s] and heading [rad] of all vehicles."""
        states = np.empty((*self.lon.shape, 4))
        cubed, rate = self.progress**3, self._progress_rate()
        motion = self.lon, self.speed, self.lane, self.target
        _write_states(*motion, self.progress, cubed, rate, self.wander, lane_width, states)
        states[..., 3] = np.arctan2(states[..., 3], self.speed)
        return states

    def advance(self, dt: float) -> None:
        """Drive for dt [s] behind the vehicle ahead in all lanes that are used."""
        drivers, ahead = self._here(), self._neighbours(self.lane, self.target)
        alone = follow(drivers, self.speed, ahead.gap, of(ahead.leader, self.speed))
        if self.course.ending:
            alone = np.minimum(alone, self._allowed(drivers))
        time_gap = self.drivers.time_gap
        time_gap += (self.usual_gap - time_gap) * dt / RELAXATION
        _move(
            np.clip(alone, HARDEST, STRONGEST), self._progress_rate(), dt, self.pause,
            self.lon, self.speed, self.lane, self.target, self.progress, self.wait,
        )  # fmt: skip

    def _allowed(self, drivers: Drivers) -> Values:
        """[m/s²] that the end of the own lane, and those who have to leave theirs, leave to each of the drivers."""
        pressed, step = self._pressure, self.course.way_out[self.lane]
        hasty, leaving = in_haste(drivers, pressed.urgency), pressed.urgency > 0
        beside = self._neighbours(self.lane + step)
        synchronised = giving_way(hasty, self.speed, beside.gap, of(beside.leader, self.speed))
        comes = (leaving & self.valid)[:, None] & ((self.lane + step)[:, None] == self.lane[..., None])
        let_in = neighbours(self.lon, self.length, comes & self.valid[:, None])
        urgency = of(let_in.leader, pressed.urgency)
        opened = giving_way(in_haste(drivers, urgency), self.speed, let_in.gap, of(let_in.leader, self.speed))
        polite = drivers.politeness > 0
        demands = (
            stopping(pressed.room, self.speed, drivers),
            np.where(leaving, synchronised, np.inf),
            np.where(polite & (let_in.gap < FREE), opened, np.inf),
        )
        return np.minimum.reduce(demands)

    def change_desires(self, random: np.random.Generator, dt: float, pause: float) -> None:
        """Let moody drivers pick another desired speed every ``pause`` [s] on average, and move towards it."""
        random_pick, random_pace = random.random(self.lon.shape), random.random(self.lon.shape)
        picks = self.moody & (random_pick < dt / pause)
        if picks.any():
            picked = np.maximum(CRAWL, self.usual_speed * (1 - SLOWING * random_pace**2))
            self.goal = np.where(picks, picked, self.goal)
        desired = self.drivers.desired_speed
        desired += np.minimum(np.maximum(self.goal - desired, -self.ease * dt), PICK_UP * dt)

    def change_lanes(self) -> None:
        """Begin the most advantageous lane change of every scene, if there is any; one that has to be comes first."""
        drivers, (begins, ends) = self._here(), self.course.ends
        current = self._neighbours(self.lane, self.target)
        free = self.valid & (self.lane == self.target) & (self.wait <= 0) & (self.speed > SLOWEST_CHANGE)
        pressed, way_out = self._pressure, self.course.way_out[self.lane]
        leaving, hasty = self.valid & (pressed.urgency > 0), in_haste(drivers, pressed.urgency)
        alone = follow(drivers, self.speed, current.gap, of(current.leader, self.speed))
        relief = np.zeros_like(alone)  # of giving way
        if self.course.ending:
            relief = np.where(leaving, 0.0, np.maximum(0.0, alone - self._allowed(drivers)))
        best = np.full(self.lon.shape, -np.inf)
        side = np.zeros_like(self.lane)
        chosen = current
        for step in (-1, 1):
            to = np.clip(self.lane + step, 0, self.course.road.lanes - 1)
            there = (to != self.lane) & (begins[to] <= self.lon - self.length / 2) & (ends[to] >= ends[self.lane])
            target = self._neighbours(self.lane + step)
            advantage = lane_change_advantage(drivers, self.speed, self.length, current, target) + relief
            advantage = np.where(free & there, advantage, -np.inf)
            must = leaving & (self.wait < np.inf) & (way_out == step)
            if must.any():
                advantage = np.where(must & accepts(hasty, self.speed, target), _FIRST + pressed.urgency, advantage)
            chosen = Neighbours(*(np.where(advantage > best, *each) for each in zip(target, chosen, strict=True)))
            side = np.where(advantage > best, step, side)
            best = np.maximum(best, advantage)
        scenes = np.flatnonzero(best.max(1) > 0)
        who = best.argmax(1)[scenes]
        self.target[scenes, who] += side[scenes, who]
        behind = chosen.follower[scenes, who]
        short, gaps = hasty.time_gap[scenes, who], self.drivers.time_gap
        gaps[scenes, who] = short
        forced = (best[scenes, who] >= _FIRST) & (chosen.rear_gap[scenes, who] < FREE)
        gaps[scenes, behind] = np.where(forced, np.minimum(gaps[scenes, behind], short), gaps[scenes, behind])

    def _here(self) -> Drivers:
        """The drivers with the speed that they want where they are; who likes to drive fast does so in bends, too."""
        if not self.course.limited:
            return self.drivers
        allowed = self.course.speed_at(self.lon) * self.boldness
        return self.drivers._replace(desired_speed=np.minimum(self.drivers.desired_speed, allowed))

    @property
    def _pressure(self) -> Pressure:
        return pressure(self.course, self.lon, self.length, self.lane, self.lane == self.target)

    def _progress_rate(self) -> Values:
        """[1/s] of the lane changes that are going on."""
        pace = np.minimum(1.0, self.speed / FLUENT) / self.change_duration
        return np.where(self.lane == self.target, 0.0, pace)

    def _neighbours(self, lane: Int[np.ndarray, "S A"], other: Int[np.ndarray, "S A"] | None = None) -> Neighbours:
        """Whoever is nearest in the lane that is given for each vehicle, or in one of two."""
        there = np.empty((*lane.shape, lane.shape[-1]), dtype=bool)
        _mark_there(lane, lane if other is None else other, self.lane, self.target, self.valid, there)
        return neighbours(self.lon, self.length, there)


@compiled
def _mark_there(
    first: Int[np.ndarray, "S A"], second: Int[np.ndarray, "S A"], lane: Int[np.ndarray, "S A"],
    target: Int[np.ndarray, "S A"], valid: Bool[np.ndarray, "S A"], there: Bool[np.ndarray, "S A A"],
) -> None:  # fmt: skip
    """Tell whether vehicle j is in one of two lanes that are given for vehicle i."""
    for s in range(len(there)):
        for i in range(there.shape[1]):
            for j in range(there.shape[1]):
                in_first = lane[s, j] == first[s, i] or target[s, j] == first[s, i]
                in_second = lane[s, j] == second[s, i] or target[s, j] == second[s, i]
                there[s, i, j] = valid[s, j] and (in_first or in_second)


@compiled
def _write_states(
    lon: Values, speed: Values, lane: Int[np.ndarray, "S A"], target: Int[np.ndarray, "S A"], progress: Values,
    cubed: Values, rate: Values, wander: Float[np.ndarray, "S A 3"], lane_width: float,
    states: Float[np.ndarray, "S A 4"],
) -> None:  # fmt: skip
    """Write lon, lat [m], speed [m/s] and the rate of lat [m/s], given the cube of the progress and its rate [1/s]."""
    for s in range(len(lon)):
        for i in range(lon.shape[1]):
            amplitude, wave, phase = wander[s, i]
            at, way = progress[s, i], (target[s, i] - lane[s, i]) * lane_width
            angle = 2 * np.pi * lon[s, i] / wave + phase
            swing = way * cubed[s, i] * (10 - 15 * at + 6 * (at * at))
            pace = way * 30 * (at * at) * ((1 - at) * (1 - at)) * rate[s, i]
            across = pace + amplitude * np.cos(angle) * 2 * np.pi / wave * speed[s, i]
            states[s, i, 0] = lon[s, i]
            states[s, i, 1] = (lane[s, i] + 0.5) * lane_width + swing + amplitude * np.sin(angle)
            states[s, i, 2], states[s, i, 3] = np.hypot(speed[s, i], across), across


@compiled
def _move(
    acceleration: Values, rate: Values, dt: float, pause: float, lon: Values, speed: Values,
    lane: Int[np.ndarray, "S A"], target: Int[np.ndarray, "S A"], progress: Values, wait: Values,
) -> None:  # fmt: skip
    """Move all vehicles, and their lane changes at a rate [1/s], for dt [s]."""
    for s in range(len(lon)):
        for i in range(lon.shape[1]):
            progress[s, i] = min(1.0, progress[s, i] + rate[s, i] * dt)
            wait[s, i] = max(0.0, wait[s, i] - dt)
            if progress[s, i] >= 1:
                lane[s, i], progress[s, i], wait[s, i] = target[s, i], 0.0, pause
            faster = max(0.0, speed[s, i] + acceleration[s, i] * dt)
            lon[s, i] += (speed[s, i] + faster) / 2 * dt
            speed[s, i] = faster
