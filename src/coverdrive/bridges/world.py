"""What a world that others wrote has to offer, and a drive in it.

Any planner drives in any such world, and so does the world's own driver, on the same seeds.
"""

from collections.abc import Hashable
from typing import NamedTuple, Protocol, runtime_checkable

from coverdrive.driving.driver import Command, Driver
from coverdrive.driving.perception import Told
from coverdrive.driving.recorder import Recorder
from coverdrive.road import Road
from coverdrive.simulation.trace import Trace

FAR = 200.0
"""[m] from the ego beyond which nobody matters within a plan of some seconds"""


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


def drive(world: World, driver: Driver, seed: int) -> Trace:
    """One drive of a driver that was made for the world's car, to the end or the ego's first contact."""
    recorder = Recorder(driver)
    recorder.reset()
    world.reset(seed)
    while not world.done:
        world.apply(recorder.step(*world.observe()))
    own, others, _ = world.observe()
    recorder.end(own, others)
    return recorder.trace()
