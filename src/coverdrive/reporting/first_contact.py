"""Why a plan is not clear, told afterwards: what its fail-safe branch first touches at any time, and where it ends.

Contact is that of `coverdrive.planning.evaluate`. n paths, K steps, P = K + 1 states.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan
from coverdrive.planning.constants import Constants, constants_of
from coverdrive.planning.evaluate import first_contact
from coverdrive.planning.obstacles import FAR
from coverdrive.planning.problem import ProblemSettings
from coverdrive.planning.road_table import RoadTable, on_road, table_of
from coverdrive.planning.sweep import write_edges
from coverdrive.planning.vehicle import VehicleSettings
from coverdrive.road import Road


class FirstContacts(NamedTuple):
    """What the fail-safe branch of a plan does within its horizon."""

    times: Float[np.ndarray, " n"]
    """[s] of its first contact with every path; infinite without one"""
    speeds: Float[np.ndarray, " n"]
    """[m/s] relative speed then; 0 without one"""
    departure: float
    """[m] that it gets off the road after the start; 0 if it keeps to it"""


def first_contacts(plan: Plan, paths: PredictedPaths, road: Road, length: float, width: float) -> FirstContacts:
    """What a plan of a car of this length and width [m] meets of these paths, which have its times."""
    steps, start = len(plan.states) - 1, np.array([plan.held[0, 0], 0.0, 0.0, 0.0])
    constants, table = _on(road, steps, plan.dt, length, width)
    states, boxes, edges = plan.held - start, np.zeros((7, steps + 1, len(paths))), np.empty((steps, 2, 4))
    half_sizes = on_road(paths, float(plan.held[0, 0]), table).half_sizes[: len(paths)]  # after these, where lanes end
    boxes[:2], boxes[2:4] = (paths.points - start[:2]).T, half_sizes.T
    boxes[4] = FAR  # what comes after the end is not looked at
    inputs = np.diff(states[:, 2:], axis=0) / plan.dt
    write_edges(states, inputs, edges, constants)
    found = [first_contact(states, inputs, edges, slot, 1.0, boxes, constants) for slot in range(len(paths))]
    times, speeds = np.array(found).reshape(-1, 2).T
    right, left = np.moveaxis(
        road.edges_at(np.stack([plan.held[:-1, 0], plan.held[1:, 0]], axis=-1))[..., [0, -1]], -1, 0
    )
    beyond = np.maximum(edges[..., 3] - left, right - edges[..., 1])
    later = beyond.ravel()[1:]  # where it is now, no plan changes
    speeds = np.where(np.isfinite(times), np.abs(speeds), 0.0)
    return FirstContacts(times * plan.dt, speeds, max(0.0, float(later.max())))


@lru_cache(maxsize=4)
def _on(road: Road, steps: int, dt: float, length: float, width: float) -> tuple[Constants, RoadTable]:
    """The constants of a plan, and the table of the road that it is on."""
    problem = ProblemSettings(steps=steps, dt=dt, vehicle=VehicleSettings(length=length, width=width))
    table = table_of(road, problem)
    return constants_of(problem, dt)._replace(vehicle=table.vehicle), table
