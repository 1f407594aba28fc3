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
    """the best of the optimised plans; it is clear of every predicted path at any time and stays on the road"""
    FALLBACK = "fallback"
    """as clear, but the rest of the last plan, or a simple braking or swerving manoeuvre: no optimised plan is clear
    and cheaper"""
    REAR = "rear"
    """nothing clear was found; it is clear of everything else if the vehicle directly behind in the own lane (paper,
    Remark 2) reacts and brakes as a careful driver would"""
    UNSAFE = "unsafe"
    """nothing clear was found; of all that was tried, this keeps to the road and is least severe"""
    BLIND = "blind"
    """the own state or a path is not known, so that nothing can be promised"""


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False)
class Plan:
    """One planned motion of the own car."""

    states: Float[np.ndarray, "P 4"]
    """lon [m], lat [m], speed [m/s], heading [rad] at the times k·dt"""
    inputs: Float[np.ndarray, "K 2"]
    """acceleration [m/s²], yaw rate [rad/s], each held for dt"""
    slack: Float[np.ndarray, " K"]
    """how far the own box gets into a predicted one at each step: share of the way to its centre (0: not at all)"""
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
    """the states of a second branch that begins with the same steps, and is driven where no better plan is found. None:
    there is only one"""


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
