"""What the simulation asks of a predictor; `coverdrive.prediction` provides one, and so can you.

M motions, A vehicle slots, n times.
"""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.arguments import of_kind
from coverdrive.certificates.certificate import Certificate
from coverdrive.errors import SettingError
from coverdrive.paths import PredictedPaths
from coverdrive.road import Road
from coverdrive.scene import Scene


@runtime_checkable
class Belief(Protocol):
    """What an ego needs to know of the others: where they may be."""

    def predict(self, scene: Scene, road: Road, ego: int, dt: float, steps: int) -> PredictedPaths:
        """The possible paths of every valid slot but ``ego`` at the times 0, dt, …, steps·dt [s]."""
        ...


@runtime_checkable
class Scalable(Belief, Protocol):
    """Sets of any size, nested in one number λ, of which it is known what is proved."""

    @property
    def certificate(self) -> Certificate:
        """What is proved of how often vehicles leave them."""
        ...

    def scaled(self, scale: float) -> "Scalable":
        """The same with sets of another λ: 0 the likeliest path alone, 1 as they were calibrated."""
        ...


@runtime_checkable
class Learning(Belief, Protocol):
    """One that changes while it is asked, as `coverdrive.prediction.adaptive.Adaptive` does."""

    @property
    def period(self) -> float:
        """[s] between two moments at which it is asked."""
        ...

    def anew(self) -> Belief:
        """Another one that knows as much as this, and changes by itself."""
        ...


def check_belief(given: Belief) -> None:
    """Refuse, with a SettingError, what tells nothing of the others."""
    of_kind("predictor", given, Belief, "a predictor (predict), as `fit` makes or `Predictor.load` reads")


def as_given(belief: Belief) -> Belief:
    """A belief for one trial: what it learns there no other trial sees, so that none depends on who drove before."""
    return belief.anew() if isinstance(belief, Learning) else belief


def check_period(belief: Belief, period: float) -> None:
    """Refuse a belief that learns from moments other than ``period`` [s] apart, by `SettingError`."""
    if isinstance(belief, Learning) and abs(belief.period - period) > 1e-9:
        raise SettingError(
            f"this belief learns every {belief.period:g} s, but is asked every {period:g} s; give it that `period`"
        )


@runtime_checkable
class Predictor(Belief, Protocol):
    """Anything that says what a vehicle may do next, so that traffic can do it."""

    @property
    def horizon(self) -> float:
        """[s] that it looks ahead."""
        ...

    def choices(
        self, scene: Scene, road: Road, times: Float[np.ndarray, " n"]
    ) -> tuple[Float[np.ndarray, "A M n 2"], Float[np.ndarray, "A M n 2"], Bool[np.ndarray, "A M"]]:
        """Motions that every slot of an unbatched scene may drive: for simulated traffic that stays in its sets.

        As deviations [m] from constant velocity along lon and lat at times [s] from now, their rates [m/s], and which
        of them are in the predicted set; of slots without a vehicle anything.
        """
        ...
