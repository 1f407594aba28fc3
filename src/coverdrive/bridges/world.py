"""What a world that others wrote has to offer, and a drive in it.

Any planner drives in any such world, and so does the world's own driver, on the same seeds.
"""

import itertools
from collections.abc import Hashable, Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol, runtime_checkable

import jax
import numpy as np

from coverdrive.driving.driver import Command, Driver
from coverdrive.driving.perception import Perception, Told
from coverdrive.driving.recorder import Recorder, trace_of
from coverdrive.errors import SettingError
from coverdrive.paths import PredictedPaths
from coverdrive.recordings.tracks.smoothing import SmoothingSettings
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drives.fault import collision_at
from coverdrive.simulation.drives.outcome import Fault, Kind, Outcome
from coverdrive.simulation.drives.trace import Decision, Trace, driven
from coverdrive.simulation.roads.initial import EGO
from coverdrive.simulation.traffic.motion import constant_velocity, with_states

FAR = 200.0
"""[m] from the ego beyond which nobody matters within a plan of some seconds"""


_FORGET = 3.0
"""[s] after which somebody who has vanished is forgotten"""


class Observation(NamedTuple):
    """What a driver is told, in this order the arguments of `Driver.step`."""

    own: tuple[float, float, float, float]
    """x [m], y [m], speed [m/s], heading [rad] of the ego's centre in map coordinates"""
    others: dict[Hashable, Told]
    """state and size of every other vehicle nearby by its name"""
    road: Road


class Car(NamedTuple):
    """What is said of the ego when its `Driver` is made: `Driver(predictor, **world.car._asdict())`."""

    length: float
    """[m]"""
    width: float
    """[m]"""
    period: float
    """[s] between two commands"""


@runtime_checkable
class World(Protocol):
    """A simulator with one car that can be driven from outside."""

    @property
    def car(self) -> Car:
        """The ego, and how often it is driven."""
        ...

    @property
    def done(self) -> bool:
        """Whether the drive is over."""
        ...

    @property
    def crashed(self) -> bool:
        """Whether the ego touched anybody, as the world sees it, which is over then."""
        ...

    def reset(self, seed: int) -> None:
        """Begin the drive of a seed."""
        ...

    def observe(self) -> Observation:
        """What is there now."""
        ...

    def apply(self, command: Command | None) -> None:
        """Go on by one period; without a command the world's own driver has the wheel, from the first one on."""
        ...


def drive(world: World, driver: Driver | None, seed: int, duration: float | None = None) -> Trace:
    """One drive to the end or the ego's first contact.

    Args:
        world: where.
        driver: that was made for the world's car; None: the world's own, whose plans are what it did, and who predicts
            nothing.
        seed: of the drive.
        duration: [s] after which it ends in any case.

    Raises:
        SettingError: the driver was made for another period than the world's.
    """
    if driver and abs(driver.period - world.car.period) > 1e-9:
        raise SettingError(
            f"this world is told every {world.car.period:g} s, the driver decides every {driver.period:g} s; make it "
            "with that `period`"
        )
    world.reset(seed)
    steps = np.inf if duration is None else max(1, round(duration / world.car.period))
    trace = _driven(world, driver, steps) if driver else _watched(world, steps)
    return trace if trace.outcome.kind is not Kind.FINISHED or not world.crashed else _imminent(trace)


def _driven(world: World, driver: Driver, steps: float) -> Trace:
    recorder = Recorder(driver)
    recorder.reset()
    while not world.done and steps > 0:
        world.apply(recorder.step(*world.observe()))
        steps -= 1
    own, others, _ = world.observe()
    recorder.end(own, others)
    return recorder.trace()


def _watched(world: World, steps: float) -> Trace:
    """What the world's own driver does."""
    seen = [world.observe()]
    while not world.done and len(seen) <= steps:
        world.apply(None)
        seen.append(world.observe())
    return watched(world.car, seen)


def watched(car: Car, seen: Sequence[Observation], seconds: Sequence[float] | None = None) -> Trace:
    """A drive of somebody who does not say what he predicts and plans.

    Args:
        car: the ego.
        seen: every moment, one period apart, two at least.
        seconds: [s] wall time of every plan, if it is known.
    """
    sight, road = Perception((car.length, car.width), car.period, _FORGET, SmoothingSettings()), seen[0].road
    scenes = [sight.scene(own, others, road) for own, others, _ in seen]
    times = [0.0] * (len(seen) - 1) if seconds is None else seconds
    done = [_done(*pair, car.period, time) for pair, time in zip(itertools.pairwise(scenes), times, strict=True)]
    return trace_of(scenes, done, road, car.period)


def _done(before: Scene, after: Scene, period: float, seconds: float) -> Decision:
    """What the ego did in a step; nothing was predicted."""
    faster, turned = (after.states[EGO] - before.states[EGO])[2:]
    inputs = np.array([[faster, np.remainder(turned + np.pi, 2 * np.pi) - np.pi]]) / period
    paths = PredictedPaths(np.empty((0, 2, 2)), np.empty(0, dtype=int), np.empty((0, 2, 2)), period)
    return Decision(paths, driven(before, after, inputs, period, seconds), 0.0, seconds, seconds)


def _imminent(trace: Trace) -> Trace:
    """The same with the collision that its world saw a moment before there is contact."""
    scenes = [jax.tree.map(lambda each, k=k: each[k], trace.scene) for k in range(len(trace) + 1)]
    dt, last = float(trace.time[1]), scenes[-1]
    scenes.append(with_states(last, constant_velocity(last.states, np.array([dt]))[:, 0]))
    found = collision_at(len(scenes) - 1, scenes, dt, trace.road)
    found = found or Outcome(Kind.FRONTAL, 0.0, at_fault=Fault.EGO)  # nobody knows
    return replace(trace, outcome=replace(found, time=float(trace.time[-1])))
