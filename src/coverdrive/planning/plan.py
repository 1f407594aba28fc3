"""What a planner returns: K steps of K+1 states, and how it came by them."""

import enum
from typing import Protocol

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

    states: Float[np.ndarray, "K+1 4"]
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


class Planner(Protocol):
    """Anything that plans: bring your own by writing these two methods."""

    def reset(self) -> None:
        """Forget the previous plan; called before every episode."""
        ...

    def plan(self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> Plan:
        """Plan from a state (lon, lat, speed, heading) against every predicted path."""
        ...
