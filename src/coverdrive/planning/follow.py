"""Whether a motion can be followed: after every period the rest of it is a new plan, and that must be clear, too.

The steps of the new plan lie elsewhere, and its inputs are the means of the old ones over them, so that a motion that
has to be followed to the centimetre gets lost.
"""

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.evaluate import compiled_empty, fill
from coverdrive.planning.merit import Surroundings

_NONE = -1e6
"""[m] half size of what is nowhere"""
_PLANS = 4
"""plans for which a motion is followed"""


@compiled
def harm_on_the_way(inputs: Float[np.ndarray, " U"], around: Surroundings, share: float, constants: Constants) -> float:
    """The most harm [m/s] that the rest of a motion does, as one of the next plans that is not clear; else 0.

    Args:
        inputs: of the motion, within the limits of the car.
        around: what the motion is made for.
        share: of a step, until the next plan.
        constants: of the problem.
    """
    rest, state, boxes, worst = inputs.copy(), around.state.copy(), around.boxes, 0.0
    no_target = np.zeros(1)
    for _ in range(_PLANS):
        applied = np.array([rest[0], rest[constants.steps]])
        _drive(state, applied, share * constants.dt)
        boxes, rest = _later(boxes, share), _shifted(rest, share)
        there = Surroundings(state.copy(), applied, around.edges, boxes)
        result = compiled_empty(1, len(rest))
        fill(rest.reshape(1, -1), no_target, there, constants, result, False)
        if not result.clear[0]:
            worst = max(worst, result.harm[0])
    return worst


@compiled
def _drive(state: Float[np.ndarray, " 4"], applied: Float[np.ndarray, " 2"], time: float) -> None:
    """Drive on exactly, to second order."""
    speed, heading = state[2] + applied[0] * time / 2, state[3] + applied[1] * time / 2
    state[0] += time * speed * np.cos(heading)
    state[1] += time * speed * np.sin(heading)
    state[2] += time * applied[0]
    state[3] += time * applied[1]


@compiled
def _later(boxes: Float[np.ndarray, "7 P n"], share: float) -> Float[np.ndarray, "7 P n"]:
    """The boxes after a share of a step; where they are beyond their paths is not known: there are none."""
    later = boxes.copy()
    for i in range(4):
        later[i, :-1] += share * (boxes[i, 1:] - boxes[i, :-1])
    later[2:4, -1] = _NONE
    return later


@compiled
def _shifted(inputs: Float[np.ndarray, " U"], share: float) -> Float[np.ndarray, " U"]:
    """The inputs after a share of a step, as means over the new steps; the last ones are held on."""
    steps, shifted = len(inputs) // 2, inputs.copy()
    for first in (0, steps):
        for k in range(first, first + steps - 1):
            shifted[k] += share * (inputs[k + 1] - inputs[k])
    return shifted
