"""The settings of a problem as compiled code takes them: named tuples of numbers and arrays."""

from collections import namedtuple
from typing import Any, NamedTuple

import numpy as np

from coverdrive.compiled import lent
from coverdrive.planning.problem.obstacles import ObstacleSettings
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.tree import Tree, begun, tree_of
from coverdrive.planning.problem.vehicle import VehicleSettings

Vehicle: Any = namedtuple("Vehicle", [*VehicleSettings.model_fields, "sharpest", "braking"])  # pyright: ignore
"""the fields of `VehicleSettings`, the tangent of the largest steering angle, and the deceleration that is sure"""
Shape: Any = namedtuple("Shape", ObstacleSettings.model_fields)  # pyright: ignore[reportUntypedNamedTuple]
"""the fields of `ObstacleSettings`"""


@lent
class Constants(NamedTuple):
    """What a problem is, with what follows from it alone."""

    steps: int
    """K"""
    dt: float
    """[s]"""
    vehicle: Any
    """of the type `Vehicle`"""
    shape: Any
    """of the type `Shape`"""
    inflation: float
    """factor on the summed half sizes"""
    period: float
    """[s] from one plan to the next"""
    held: int
    """steps that begin until then: their inputs are one, as that is what will be driven"""
    tree: Tree
    """the steps of a plan, and what they cost"""


def constants_of(problem: ProblemSettings, period: float) -> Constants:
    """The constants of a problem that is posed anew every ``period`` [s]."""
    shared = problem.branches.shared(period, problem.steps, problem.dt)
    return Constants(
        steps=problem.steps,
        dt=problem.dt,
        vehicle=vehicle_of(problem.vehicle),
        shape=Shape(**problem.obstacles.model_dump()),
        inflation=problem.obstacles.inflation,
        period=period,
        held=begun(period, problem.steps, problem.dt),
        tree=tree_of(problem.cost, problem.branches, shared, problem.steps, problem.dt),
    )


def vehicle_of(settings: VehicleSettings) -> Any:
    """A vehicle on a straight road, of the type `Vehicle`."""
    sharpest = np.tan(settings.max_steering)
    return Vehicle(**settings.model_dump(), sharpest=sharpest, braking=settings.max_deceleration)
