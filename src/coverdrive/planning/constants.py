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
    form: Float[np.ndarray, "U U"]
    """cost of inputs u and their changes: uᵀ·form·u − 2·previous_inputᵀ·pull·u + constant"""
    pull: Float[np.ndarray, "2 U"]
    """see ``form``"""
    straight: Float[np.ndarray, "U U"]
    """``form`` and the curvature of the costs of speed and heading, which are sums of the inputs"""


def constants_of(problem: ProblemSettings) -> Constants:
    """The constants of a problem."""
    cost, steps = problem.cost, problem.steps
    weight = np.ones(steps)
    weight[-1] = cost.terminal
    form, pull = _input_form(cost, steps)
    summed = problem.dt * np.tril(np.ones((steps, steps)))
    gathered = summed.T @ (weight[:, None] * summed)
    straight = form + np.kron(np.diag([cost.speed, cost.heading]), gathered)
    return Constants(
        steps=steps,
        dt=problem.dt,
        vehicle=Vehicle(**problem.vehicle.model_dump()),
        cost=Cost(**cost.model_dump()),
        shape=Shape(**problem.obstacles.model_dump()),
        inflation=problem.obstacles.inflation,
        weight=weight,
        slack=cost.slack_weights(steps),
        form=form,
        pull=pull,
        straight=straight,
    )


def _input_form(cost: CostSettings, steps: int) -> tuple[Float[np.ndarray, "U U"], Float[np.ndarray, "2 U"]]:
    change = np.eye(steps) - np.eye(steps, k=-1)
    form, pull = np.zeros((2 * steps, 2 * steps)), np.zeros((2, 2 * steps))
    weights = ((cost.acceleration, cost.acceleration_change), (cost.yaw_rate, cost.yaw_rate_change))
    for i, (size, changes) in enumerate(weights):
        own = slice(i * steps, (i + 1) * steps)
        form[own, own] = size * np.eye(steps) + changes * change.T @ change
        pull[i, i * steps] = changes
    return form, pull
