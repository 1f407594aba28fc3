"""The settings of a problem as compiled code takes them: named tuples of numbers and arrays."""

from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.planning.cost import CostSettings
from coverdrive.planning.obstacles import ObstacleSettings
from coverdrive.planning.problem import ProblemSettings
from coverdrive.planning.vehicle import VehicleSettings

Vehicle: Any = namedtuple("Vehicle", VehicleSettings.model_fields)  # pyright: ignore[reportUntypedNamedTuple]
"""the fields of `VehicleSettings`"""
Cost: Any = namedtuple("Cost", CostSettings.model_fields)  # pyright: ignore[reportUntypedNamedTuple]
"""the fields of `CostSettings`"""
Shape: Any = namedtuple("Shape", ObstacleSettings.model_fields)  # pyright: ignore[reportUntypedNamedTuple]
"""the fields of `ObstacleSettings`"""


class Constants(NamedTuple):
    """What a problem is, with what follows from it alone. K steps; U = 2K inputs, accelerations before yaw rates."""

    steps: int
    """K"""
    dt: float
    """[s]"""
    vehicle: Any
    """of the type `Vehicle`"""
    cost: Any
    """of the type `Cost`"""
    shape: Any
    """of the type `Shape`"""
    inflation: float
    """factor on the summed half sizes"""
    weight: Float[np.ndarray, " K"]
    """factor on the errors of every state: the last one counts more"""
    slack: Float[np.ndarray, " K"]
    """weights c_k of the slacks"""
    curvature: Float[np.ndarray, " U"]
    """half the second derivatives of the costs of inputs, speed and heading with respect to every single input"""
    least_curvature: float
    """smallest eigenvalue of half their second derivatives with respect to all inputs; errors across the road,
    constraints and damping only add to it"""


def constants_of(problem: ProblemSettings) -> Constants:
    """The constants of a problem."""
    cost, steps = problem.cost, problem.steps
    weight = np.ones(steps)
    weight[-1] = cost.terminal
    summed = problem.dt * np.tril(np.ones((steps, steps)))
    change = np.eye(steps) - np.eye(steps, k=-1)
    straight = (
        np.kron(np.diag([cost.acceleration, cost.yaw_rate]), np.eye(steps))
        + np.kron(np.diag([cost.acceleration_change, cost.yaw_rate_change]), change.T @ change)
        + np.kron(np.diag([cost.speed, cost.heading]), summed.T @ (weight[:, None] * summed))
    )
    return Constants(
        steps=steps,
        dt=problem.dt,
        vehicle=Vehicle(**problem.vehicle.model_dump()),
        cost=Cost(**cost.model_dump()),
        shape=Shape(**problem.obstacles.model_dump()),
        inflation=problem.obstacles.inflation,
        weight=weight,
        slack=cost.slack_weights(steps),
        curvature=np.diag(straight).copy(),
        least_curvature=float(np.linalg.eigvalsh(straight)[0]),
    )
