"""What the simulation asks of a traffic model; bring your own by writing the two methods of `Traffic`.

A traffic model that also has the method of `Starting` decides where its episodes begin. A vehicle slots, the
ego's included (slot 0), which a traffic model never moves.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Int

from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.roads.initial import InitialSettings


@dataclass(frozen=True, eq=False)
class TrafficStep:
    """What the uncontrolled vehicles did in one step."""

    scene: Scene
    """the vehicles after the step; the ego's slot is as it was"""
    base: Int[np.ndarray, " A"]
    """index of the base trajectory that each vehicle follows; −1 where it follows none"""
    stuck: Bool[np.ndarray, " A"]
    """whether a vehicle had to choose at the start of the step and found no choice that passes its check"""
    missed: Bool[np.ndarray, " A"]
    """whether a vehicle chose, at the start of the step, a base trajectory that the predictor calls impossible"""

    @staticmethod
    def without_bases(scene: Scene) -> "TrafficStep":
        """The step of vehicles that follow no base trajectories."""
        nobody = np.zeros(scene.vehicles, dtype=bool)
        return TrafficStep(scene, np.full(scene.vehicles, -1), nobody, nobody)


@runtime_checkable
class Traffic(Protocol):
    """Anything that moves the uncontrolled vehicles."""

    def reset(self, scene: Scene, road: Road, rng: np.random.Generator) -> None:
        """Begin an episode from ``scene``; all random choices of the episode come from ``rng``."""
        ...

    def step(self, scene: Scene, dt: float) -> TrafficStep:
        """Move every uncontrolled vehicle by ``dt`` [s] from ``scene``, which shows the ego as it is now."""
        ...


@dataclass(frozen=True, eq=False)
class Start:
    """Where and on which road an episode begins."""

    scene: Scene
    """all vehicles, the ego in slot 0"""
    road: Road
    """on which the episode takes place"""
    duration: float
    """[s] for which the traffic can go on; infinite unless it is recorded"""


@runtime_checkable
class Starting(Protocol):
    """A traffic model that decides where its episodes begin; called before `Traffic.reset`."""

    def start(self, settings: InitialSettings, vehicles: int, rng: np.random.Generator) -> Start:
        """Draw the start of an episode with ``vehicles`` uncontrolled vehicles; ``settings`` are the experiment's."""
        ...
