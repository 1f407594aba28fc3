"""What the simulation asks of a predictor; `coverdrive.prediction` provides one, and so can you.

M base trajectories, A vehicle slots, n times.
"""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.paths import PredictedPaths
from coverdrive.road import Road
from coverdrive.scene import Scene


@runtime_checkable
class Basis(Protocol):
    """The base trajectories (paper §2.1), as deviations from constant velocity."""

    @property
    def horizon(self) -> float:
        """[s] length of every base trajectory."""
        ...

    def rollout(self, times: Float[np.ndarray, " n"]) -> tuple[Float[np.ndarray, "M n 2"], Float[np.ndarray, "M n 2"]]:
        """Deviation [m] along lon and lat of every base trajectory at any times [s], and its rate [m/s]."""
        ...


@runtime_checkable
class Predictor(Protocol):
    """Anything that says which base trajectories a vehicle may follow."""

    @property
    def basis(self) -> Basis:
        """The base trajectories that the verdicts are about."""
        ...

    def possible(self, scene: Scene, road: Road) -> Bool[np.ndarray, "A M"]:
        """Which base trajectories every slot of an unbatched scene may follow; arbitrary for invalid slots."""
        ...

    def predict(self, scene: Scene, road: Road, ego: int, dt: float, steps: int) -> PredictedPaths:
        """The possible paths of every valid slot but ``ego`` at the times 0, dt, …, steps·dt [s]."""
        ...
