"""Why a plan is not clear, told afterwards: what its fail-safe branch first touches at any time, and where it ends.

Contact is that of `coverdrive.planning.sweep`. n paths, K steps, P = K + 1 states.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled
from coverdrive.paths import PredictedPaths
from coverdrive.planning.constants import constants_of
from coverdrive.planning.plan import Plan
from coverdrive.planning.problem import ProblemSettings
from coverdrive.planning.rollout import state_at
from coverdrive.planning.sweep import NEVER, contact_at, impact, write_edges
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
    constants = constants_of(
        ProblemSettings(steps=steps, dt=plan.dt, vehicle=VehicleSettings(length=length, width=width)), plan.dt
    )
    states, boxes, edges = plan.held - start, np.zeros((7, steps + 1, len(paths))), np.empty((steps, 2, 4))
    boxes[:2], boxes[2:4] = (paths.points - start[:2]).T, paths.half_sizes.T
    inputs = np.diff(states[:, 2:], axis=0) / plan.dt
    write_edges(states, inputs, edges, constants)
    found = np.array([np.full(len(paths), np.inf), np.zeros(len(paths))])
    _write_contacts(states, inputs, edges, boxes, plan.dt, found)
    beyond = np.maximum(edges[..., 3] - road.edges[-1], road.edges[0] - edges[..., 1])
    later = beyond.ravel()[1:]  # where it is now, no plan changes
    return FirstContacts(found[0], found[1], max(0.0, float(later.max())))


@compiled
def _write_contacts(
    states: Float[np.ndarray, "P 4"], inputs: Float[np.ndarray, "K 2"], edges: Float[np.ndarray, "K 2 4"],
    boxes: Float[np.ndarray, "7 P n"], dt: float, found: Float[np.ndarray, "2 n"],
) -> None:  # fmt: skip
    """Write when [s] and how fast [m/s] a motion with these edges first touches every box, where it does."""
    for slot in range(boxes.shape[2]):
        for k in range(len(inputs)):
            share = contact_at(edges, boxes, k, slot, 1.0)
            if share < NEVER:
                applied = inputs[k, 0], inputs[k, 1]
                found[0, slot] = (k + share) * dt
                found[1, slot] = impact(state_at(states, k, states[0]), applied, share, boxes, k, slot, dt)
                break
