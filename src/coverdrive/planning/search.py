"""The search for a plan, compiled: manoeuvres as guesses, descent from the best of them, and the choice.

Every target lane has two starts: the last plan to that lane, and the cheapest of simple manoeuvres (steer to the lane
at a constant acceleration, from full braking to full throttle), so that a last plan that got stuck is left behind. All
starts descend together. Whatever comes out is driven within the limits of the car and evaluated against every box
(`coverdrive.planning.evaluate`); so are the simple manoeuvres and the last plans themselves, which are what is left
when the descent finds nothing clear. If nothing at all is clear, more ways to evade are tried. Of everything that does
no more harm than full braking in the lane and than the rest of the last plan, the cheapest is chosen then: what gets
into boxes least and latest.

L target lanes, B = 2L starts, m motions, P = K + 1 states.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from pydantic import Field

from coverdrive.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.descent import descend
from coverdrive.planning.evaluate import Evaluated, drive_step, evaluate
from coverdrive.planning.follow import harm_on_the_way
from coverdrive.planning.merit import Surroundings
from coverdrive.planning.motion import lane_seeking
from coverdrive.planning.vehicle import VehicleSettings
from coverdrive.settings import Settings

_UNCLEAR = 1e12
"""more than any motion costs; added to the cost of those that are not clear"""
_PER_HARM = 1e11
"""[s/m] price of the harm of contacts: more than comfort and slack are worth"""
_PER_DEPARTURE = 1e15
"""[1/m] price of leaving the road: more than any contact"""
_NO_DEPARTURE = 0.005
"""[m] of leaving the road that count for nothing where nothing is clear"""
_PLACES = 9
"""across the road, to which a car evades"""
_FARTHEST = 4.0
"""[m] across the road to such a place"""
_HURRY = 1.6
"""times faster than a lane is changed in comfort"""
_HARD = np.array([1.0, 0.5, 0.0])
"""shares of full braking while it evades"""
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
    last: Float[np.ndarray, "L U"]
    """inputs of the last plan to each target lane"""
    lane: Int[np.ndarray, " B"]
    """index of the target of each start"""
    starts: Float[np.ndarray, "B U"]
    """inputs where an unfinished search goes on; they count only if ``resumed``"""
    share: float
    """of a step, until the next plan; at most 1"""
    resumed: bool
    """whether the search goes on, instead of starting from the last plans and the manoeuvres"""


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
    """inputs of the best of each target lane"""


class Chosen(NamedTuple):
    """The chosen motion in numbers."""

    cost: float
    """of the motion; no number if there is none"""
    severity: float
    """[m/s] of its worst contact"""
    harm: float
    """[m/s] expected of all contacts"""
    departure: float
    """[m] by which it leaves the road, summed over the steps"""
    lane: int
    """index of its target"""
    clear: bool
    """whether it touches nothing at any time and stays on the road"""
    optimised: bool
    """whether it comes out of the descent"""


class Found(NamedTuple):
    """What a search found."""

    arrays: Arrays
    chosen: Chosen
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
        best=np.zeros((lanes, 2 * steps)),
    )
    numbers, done = _search(around, wanted, accelerations, iterations, tolerance, constants, arrays)
    return Found(arrays, Chosen(*numbers), done)


@compiled
def _search(
    around: Surroundings,
    wanted: Wanted,
    accelerations: Float[np.ndarray, " g"],
    iterations: int,
    tolerance: float,
    constants: Constants,
    arrays: Arrays,
) -> tuple[tuple[float, float, float, float, int, bool, bool], bool]:
    """Fill the arrays of what is found, and return the numbers of `Chosen` and whether the search is done."""
    lanes = len(wanted.targets)
    guesses, of_guess = _manoeuvres(around, wanted.targets, accelerations, 1.0, constants)
    simple_lane = np.concatenate((of_guess, np.arange(lanes)))
    simple = evaluate(np.concatenate((guesses, wanted.last)), wanted.targets[simple_lane], around, constants)
    lane, starts = wanted.lane, wanted.starts
    if not wanted.resumed:
        price = simple.lasting_cost + wanted.extra[simple_lane]
        last = len(guesses) + np.arange(lanes)
        fresh = np.concatenate((last, _cheapest(price[: len(guesses)], of_guess, lanes)))
        lane, starts = simple_lane[fresh], simple.inputs[fresh]
    target, extra = wanted.targets[lane], wanted.extra[lane]
    descent = descend(starts, target, extra, around, constants, iterations, tolerance)
    optimised = evaluate(descent.inputs, target, around, constants)
    standing = np.full(lanes + 1, np.inf)
    held = int(np.argmin(wanted.extra))
    driven = len(guesses) + held
    allowed = min(simple.harm[0], simple.harm[driven])
    lost = simple.clear[driven] and harm_on_the_way(simple.inputs[driven], around, wanted.share, constants) > 0
    strict = not lost
    chosen = Chosen(np.nan, 0.0, 0.0, 0.0, 0, False, False)
    chosen = _better(chosen, optimised, lane, True, strict, -1, allowed, around, wanted, constants, standing, arrays)
    chosen = _better(
        chosen, simple, simple_lane, False, strict, driven, allowed, around, wanted, constants, standing, arrays
    )
    if not chosen.clear:
        places = _places(around, constants)
        braking = -constants.vehicle.max_deceleration * _HARD
        evading, of_place = _manoeuvres(around, places, braking, _HURRY, constants)
        lane_of = _nearest(places, wanted.targets)[of_place]
        candidates = evaluate(evading, wanted.targets[lane_of], around, constants)
        chosen = _better(
            chosen, candidates, lane_of, False, strict, -1, allowed, around, wanted, constants, standing, arrays
        )
    arrays.descended[:], arrays.descended_lane[:] = descent.inputs, lane
    done = bool(descent.done[np.argmin(descent.value + extra)])
    of_contact = chosen.severity, chosen.harm, chosen.departure
    return (chosen.cost, *of_contact, chosen.lane, chosen.clear, chosen.optimised), done


@compiled
def _better(
    chosen: Chosen,
    candidates: Evaluated,
    lane: Int[np.ndarray, " m"],
    optimised: bool,
    strict: bool,
    driven: int,
    allowed: float,
    around: Surroundings,
    wanted: Wanted,
    constants: Constants,
    standing: Float[np.ndarray, " L1"],
    arrays: Arrays,
) -> Chosen:
    """What is chosen with more candidates; ``standing`` holds the rank of the best of each lane, and of the chosen.

    The candidate ``driven`` goes on with what is driven. It is free to have little room, and if not ``strict``, because
    it gets lost as well, so are all. Ranks that are no numbers are never better.
    """
    for i in range(len(lane)):
        handicap = wanted.extra[lane[i]]
        free = i == driven or not strict
        rank = _rank(candidates, i, free, allowed)
        if rank < _UNCLEAR and not free and rank + handicap < standing[-1]:
            candidates.harm[i] = harm_on_the_way(candidates.inputs[i], around, wanted.share, constants)
            rank = _rank(candidates, i, False, allowed)
        if rank < standing[lane[i]]:
            standing[lane[i]] = rank
            arrays.best[lane[i]] = candidates.inputs[i]
        if rank + handicap < standing[-1]:
            standing[-1] = rank + handicap
            arrays.states[:], arrays.inputs[:] = candidates.states[i], candidates.inputs[i]
            arrays.slack[:], arrays.off_road[:] = candidates.slack[i], candidates.off_road[i]
            of_contact = candidates.severity[i], candidates.harm[i], candidates.departure[i]
            chosen = Chosen(candidates.cost[i], *of_contact, lane[i], candidates.clear[i], optimised)
    return chosen


@compiled
def _rank(candidates: Evaluated, i: int, free: bool, allowed: float) -> float:
    """The lower, the better: clear motions by their cost; others first by leaving the road, then by more harm [m/s]
    than is allowed, then by the cost that counts how deep and how early they get into boxes.

    A clear motion that has hardly any room, or gets lost on the way, is one of the others, unless it is ``free``.
    """
    if candidates.clear[i] and (free or candidates.harm[i] == 0):
        return candidates.lasting_cost[i]
    leaving, more = max(0.0, candidates.departure[i] - _NO_DEPARTURE), max(0.0, candidates.harm[i] - allowed)
    return _UNCLEAR + _PER_DEPARTURE * leaving + _PER_HARM * more + candidates.lasting_cost[i]


@compiled
def _cheapest(price: Float[np.ndarray, " m"], lane: Int[np.ndarray, " m"], lanes: int) -> Int[np.ndarray, " L"]:
    """Index of the cheapest motion to each lane."""
    best = np.zeros(lanes, np.int64)
    for each in range(lanes):
        best[each] = np.argmin(np.where(lane == each, price, np.inf))
    return best


@compiled
def _places(around: Surroundings, constants: Constants) -> Float[np.ndarray, " e"]:
    """[m] lat of the places to which a car evades: where it is, and across the road as far as it is near."""
    lat, half_width = around.state[1], constants.vehicle.width / 2 + constants.shape.edge_margin
    right = max(lat - _FARTHEST, min(lat, around.edges[0] + half_width))
    left = min(lat + _FARTHEST, max(lat, around.edges[1] - half_width))
    places = np.full(_PLACES + 1, lat)
    for i in range(_PLACES):
        places[i] = right + (left - right) * i / (_PLACES - 1)
    return places


@compiled
def _nearest(places: Float[np.ndarray, " e"], targets: Float[np.ndarray, " L"]) -> Int[np.ndarray, " e"]:
    """Index of the target lane that is nearest to each place."""
    result = np.empty(len(places), np.int64)
    for i in range(len(places)):
        result[i] = np.argmin(np.abs(targets - places[i]))
    return result


@compiled
def _manoeuvres(
    around: Surroundings,
    targets: Float[np.ndarray, " e"],
    accelerations: Float[np.ndarray, " g"],
    hurry: float,
    constants: Constants,
) -> tuple[Float[np.ndarray, "m U"], Int[np.ndarray, " m"]]:
    """Inputs of simple manoeuvres, target by target, and the index of each one's target."""
    steps, guesses = constants.steps, len(accelerations)
    inputs, lane = np.empty((len(targets) * guesses, 2 * steps)), np.empty(len(targets) * guesses, np.int64)
    for i in range(len(inputs)):
        lane[i] = i // guesses
        state = (around.state[0], around.state[1], around.state[2], around.state[3])
        for k in range(steps):
            turn = _lane_seeking(state[1], state[2], state[3], targets[lane[i]], hurry)
            applied, state = drive_step(state, (accelerations[i % guesses], turn), constants)
            inputs[i, k], inputs[i, steps + k] = applied
    return inputs, lane
