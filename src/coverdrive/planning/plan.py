"""What a planner returns: K steps between P = K + 1 states, and how it came by them."""

import enum
from typing import Protocol, runtime_checkable

import equinox as eqx
import numpy as np
from jaxtyping import Float

from coverdrive.paths import PredictedPaths
from coverdrive.road import Road


class Status(enum.Enum):
    """How a plan was found."""

    SOLVED = "solved"
    """the fast solver converged"""
    RETRIED = "retried"
    """the fast solver failed, the robust one converged"""
    FALLBACK = "fallback"
    """no solver converged; a braking manoeuvre is used instead"""


class Plan(eqx.Module):
    """One planned motion of the own car."""

    states: Float[np.ndarray, "P 4"]
    """lon [m], lat [m], speed [m/s], heading [rad] at the times k·dt"""
    inputs: Float[np.ndarray, "K 2"]
    """acceleration [m/s²], yaw rate [rad/s], each held for dt"""
    slack: Float[np.ndarray, " K"]
    """how far the obstacle constraints of each step are violated (0: not at all)"""
    status: Status
    cost: float
    """value of the objective"""
    seconds: float
    """[s] wall time that the plan took"""
    dt: float
    """[s]"""


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
        """Forget the previous plan; called before every episode with the time [s] between two plans."""
        ...

    def plan(self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> Plan:
        """Plan from a state (lon, lat, speed, heading) against every predicted path."""
        ...
