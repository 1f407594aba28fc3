"""What a planner returns: K steps between P = K + 1 states, and how it came by them."""

import enum
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import jax
import numpy as np
from jaxtyping import Float

from coverdrive.paths import PredictedPaths
from coverdrive.road import Road


class Status(enum.Enum):
    """How a plan was found, and what it promises."""

    SOLVED = "solved"
    """the best of the optimised plans; its fail-safe branch is clear of every predicted path at any time and stays on
    the road"""
    FALLBACK = "fallback"
    """as clear, but the rest of the last fail-safe branch, a simple manoeuvre to a lane at a constant acceleration, or
    what lies between one and an optimised plan: no optimised plan is clear and within the jerk limit"""
    UNSAFE = "unsafe"
    """nothing clear was found; of all that was tried, this keeps to the road as far as anything does, and does least
    harm; cost decides between what does about as much"""
    INVALID_INPUT = "invalid input"
    """the ego's state or a path is not known, so that nothing can be promised"""


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False)
class Plan:
    """One planned motion of the ego."""

    states: Float[np.ndarray, "P 4"]
    """lon [m], lat [m], speed [m/s], heading [rad] at the times k·dt, of the drive branch"""
    inputs: Float[np.ndarray, "K 2"]
    """acceleration [m/s²], yaw rate [rad/s] of the drive branch, each held for dt"""
    slack: Float[np.ndarray, " K"]
    """how far the ego's box, on the fail-safe branch, gets into a predicted one at each step and until the next: share
    of the way to its centre (0: not at all)"""
    status: Status
    cost: float
    """value of the objective"""
    seconds: float
    """[s] wall time that the plan took"""
    dt: float
    """[s]"""
    severity: float = 0.0
    """[m/s] where nothing is clear: relative speed at the first contact with a predicted box, of the worst box"""
    fail_safe: Float[np.ndarray, "P 4"] | None = None
    """the states of the fail-safe branch, which begins with the same steps, and is driven on where no better plan is
    found. None: there is only one branch"""

    @property
    def held(self) -> Float[np.ndarray, "P 4"]:
        """The states that keep clear of all: those of the fail-safe branch, or of the only one."""
        return self.states if self.fail_safe is None else self.fail_safe

    def applied(self, period: float) -> Float[np.ndarray, " 2"]:
        """The inputs that are applied for a period [s], after which there is another plan: their mean until then."""
        if period <= self.dt:
            return self.inputs[0].copy()
        share = np.clip(period / self.dt - np.arange(len(self.inputs)), 0.0, 1.0)
        return share @ self.inputs / share.sum()


@runtime_checkable
class Planner(Protocol):
    """Anything that plans: bring your own by writing these four members."""

    @property
    def dt(self) -> float:
        """[s] between two points of the paths that it plans against."""
        ...

    @property
    def steps(self) -> int:
        """Number K of its steps; it plans against paths of K + 1 points."""
        ...

    def reset(self, period: float) -> None:
        """Forget the previous plan; called before every episode with the time [s] between two plans.

        What takes long, such as compiling, belongs here: `plan` is called in the middle of a drive.
        """
        ...

    def plan(self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> Plan:
        """Plan from a state (lon, lat, speed, heading) against every predicted path."""
        ...
