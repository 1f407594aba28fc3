"""The search for a plan, compiled: manoeuvres as guesses, descent from the best of them, and the choice.

Every target lane has two starts: the last plan to that lane, and the cheapest of simple manoeuvres (steer to the lane
at a constant acceleration, from full braking to full throttle), so that a last plan that got stuck is left behind. All
starts descend together. Whatever comes out is driven within the limits of the car and judged by the cost of
`coverdrive.planning.cost` against every box; so are the simple manoeuvres and the last plans themselves, which are what
is left when the descent finds nothing clear.

L target lanes, B = 2L starts, m motions, P = K + 1 states.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field

from coverdrive.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.descent import descend
from coverdrive.planning.judge import drive_step, judge
from coverdrive.planning.merit import Surroundings
from coverdrive.planning.motion import lane_seeking
from coverdrive.planning.vehicle import VehicleSettings
from coverdrive.settings import Settings

_UNCLEAR = 1e12
"""more than any motion costs; added to the cost of those that are not clear"""
_lane_seeking = compiled(lane_seeking)


class SearchSettings(Settings):
    """How long the search goes on."""

    tolerance: float = Field(default=3e-3, gt=0, le=1)
    """a step of the descent that lowers the merit by a smaller share is the last"""
    braking_guesses: int = Field(default=4, ge=2, le=100)
    """number of constant accelerations from full braking to none that are tried as manoeuvres"""

    def accelerations(self, vehicle: VehicleSettings) -> Float[np.ndarray, " g"]:
        """[m/s²] of the simple manoeuvres."""
        braking = np.linspace(-vehicle.max_deceleration, 0.0, self.braking_guesses)
        return np.concatenate([braking, [vehicle.max_acceleration / 2, vehicle.max_acceleration]])


class Wanted(NamedTuple):
    """What is searched for."""

    targets: Float[np.ndarray, " L"]
    """[m] lat of the centres of the target lanes"""
    extra: Float[np.ndarray, " L"]
    """cost of choosing each target lane, on top of its plan's"""
    lane: Int[np.ndarray, " B"]
    """index of the target of each start"""
    starts: Float[np.ndarray, "B U"]
    """inputs of the last plan to each target lane; the other L count only if ``resumed``"""
    resumed: bool
    """whether the starts are those of an unfinished search, with which no manoeuvre competes"""


class Arrays(NamedTuple):
    """The chosen motion, and what the next search starts from."""

    states: Float[np.ndarray, "P 4"]
    inputs: Float[np.ndarray, " U"]
    slack: Float[np.ndarray, " K"]
    off_road: Float[np.ndarray, " K"]
    descended: Float[np.ndarray, "B U"]
    """inputs of all motions that descended"""
    descended_lane: Int[np.ndarray, " B"]
    """index of the target of each"""
    best: Float[np.ndarray, "L U"]
    """inputs of the cheapest of each target lane"""


class Found(NamedTuple):
    """What a search found."""

    arrays: Arrays
    cost: float
    """of the chosen motion"""
    lane: int
    """index of its target"""
    clear: bool
    """whether it touches nothing and stays on the road"""
    optimised: bool
    """whether it comes out of the descent"""
    done: bool
    """whether the cheapest motion has arrived"""


def search(
    around: Surroundings,
    wanted: Wanted,
    accelerations: Float[np.ndarray, " g"],
    iterations: int,
    tolerance: float,
    constants: Constants,
) -> Found:
    """Search for the cheapest plan.

    Args:
        around: what the plan is made for.
        wanted: target lanes and starts.
        accelerations: [m/s²] of the simple manoeuvres.
        iterations: of the descent, at the most.
        tolerance: a step of the descent that lowers the merit by a smaller share is the last.
        constants: of the problem.
    """
    steps, lanes, starts = constants.steps, len(wanted.targets), len(wanted.starts)
    arrays = Arrays(
        states=np.empty((steps + 1, 4)),
        inputs=np.empty(2 * steps),
        slack=np.empty(steps),
        off_road=np.empty(steps),
        descended=np.empty((starts, 2 * steps)),
        descended_lane=np.empty(starts, np.int64),
        best=np.empty((lanes, 2 * steps)),
    )
    return Found(arrays, *_search(around, wanted, accelerations, iterations, tolerance, constants, arrays))


@compiled
def _search(
    around: Surroundings,
    wanted: Wanted,
    accelerations: Float[np.ndarray, " g"],
    iterations: int,
    tolerance: float,
    constants: Constants,
    arrays: Arrays,
) -> tuple[float, int, bool, bool, bool]:
    """Fill the arrays of what is found, and return the numbers."""
    lanes = len(wanted.targets)
    guesses, of_guess = _manoeuvres(around, wanted.targets, accelerations, constants)
    simple_inputs = np.concatenate((guesses, wanted.starts[:lanes]))
    simple_lane = np.concatenate((of_guess, np.arange(lanes)))
    simple = judge(simple_inputs, wanted.targets[simple_lane], around, constants)
    if wanted.resumed:
        starts, lane = wanted.starts, wanted.lane
    else:
        price = simple.lasting_cost + wanted.extra[simple_lane]
        last = len(guesses) + np.arange(lanes)
        fresh = np.concatenate((last, _cheapest(price[: len(guesses)], of_guess, lanes)))
        starts, lane = simple_inputs[fresh], simple_lane[fresh]
    target, extra = wanted.targets[lane], wanted.extra[lane]
    descent = descend(starts, target, extra, around, constants, iterations, tolerance)
    optimised = judge(descent.inputs, target, around, constants)
    of_motion = np.concatenate((lane, simple_lane))
    rank = np.concatenate((optimised.lasting_cost, simple.lasting_cost))
    shape = constants.shape
    for i in range(len(rank)):
        judged, j = (optimised, i) if i < len(lane) else (simple, i - len(lane))
        clear = judged.slack[j].max() <= shape.margin and judged.off_road[j].max() <= shape.edge_margin
        rank[i] = (rank[i] if np.isfinite(rank[i]) else np.inf) + (0.0 if clear else _UNCLEAR)
    for each, i in enumerate(_cheapest(rank, of_motion, lanes)):
        arrays.best[each] = optimised.inputs[i] if i < len(lane) else simple.inputs[i - len(lane)]
    chosen = np.argmin(rank + wanted.extra[of_motion])
    judged, j = (optimised, chosen) if chosen < len(lane) else (simple, chosen - len(lane))
    arrays.states[:], arrays.inputs[:] = judged.states[j], judged.inputs[j]
    arrays.slack[:], arrays.off_road[:] = judged.slack[j], judged.off_road[j]
    arrays.descended[:], arrays.descended_lane[:] = descent.inputs, lane
    done = descent.done[np.argmin(descent.value + extra)]
    return judged.cost[j], of_motion[chosen], rank[chosen] < _UNCLEAR, bool(chosen < len(lane)), bool(done)


@compiled
def _cheapest(price: Float[np.ndarray, " m"], lane: Int[np.ndarray, " m"], lanes: int) -> Int[np.ndarray, " L"]:
    """Index of the cheapest motion to each lane."""
    best = np.zeros(lanes, np.int64)
    for each in range(lanes):
        best[each] = np.argmin(np.where(lane == each, price, np.inf))
    return best


@compiled
def _manoeuvres(
    around: Surroundings,
    targets: Float[np.ndarray, " L"],
    accelerations: Float[np.ndarray, " g"],
    constants: Constants,
) -> tuple[Float[np.ndarray, "m U"], Int[np.ndarray, " m"]]:
    """Inputs of the simple manoeuvres, lane by lane, and the index of each one's target."""
    steps, guesses = constants.steps, len(accelerations)
    inputs, lane = np.empty((len(targets) * guesses, 2 * steps)), np.empty(len(targets) * guesses, np.int64)
    for i in range(len(inputs)):
        lane[i] = i // guesses
        state = (around.state[0], around.state[1], around.state[2], around.state[3])
        for k in range(steps):
            turn = _lane_seeking(state[1], state[2], state[3], targets[lane[i]])
            applied, state = drive_step(state, (accelerations[i % guesses], turn), constants)
            inputs[i, k], inputs[i, steps + k] = applied
    return inputs, lane
