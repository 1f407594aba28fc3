"""The search for a plan, compiled: manoeuvres as guesses, descent from the best of them, and the choice.

Every target lane has a start: the last plan to that lane, or the cheapest of simple manoeuvres (steer to the lane at a
constant acceleration, from full braking to full throttle) with the least harmful one as its fail-safe branch; the lane
that the last plan aimed at has both. All starts descend together. Whatever comes out is evaluated
(`coverdrive.planning.check.evaluate`), and so are the simple manoeuvres and the rest of the last fail-safe branch, as
plans whose branches are one: they are taken where the descent finds nothing clear. What comes out unclear is drawn back
to the cheapest clear plan until it is clear. If nothing at all is clear, more ways to evade are tried, and what does
least harm is chosen; cost decides between what does about as much.

L target lanes, g accelerations, m plans, N nodes, K steps, P = K + 1 states.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.compiled import compiled, is_there, lent
from coverdrive.planning.check.evaluate import Plans, empty_plans, evaluate
from coverdrive.planning.check.merit import merit
from coverdrive.planning.problem.constants import Constants
from coverdrive.planning.problem.rollout import write, write_rows
from coverdrive.planning.solver.descent import descend
from coverdrive.planning.solver.manoeuvres import EVASIONS, WAYS, aim, evade, write_manoeuvre
from coverdrive.planning.surroundings import Surroundings

TOLERANCE = 1e-3
"""a step of the descent that lowers the merit by a smaller share is the last"""
_UNCLEAR = 1e12
"""more than any plan costs; added to the cost of those that are not clear"""
_PER_HARM = 1e7
"""price of the expected harm of contacts, against what slack and comfort cost"""
_PER_WORSE = 1e10
"""price of more harm than full braking in the own lane does, the first guess: only leaving the road costs more"""
_PER_DEPARTURE = 1e15
"""[1/m] price of leaving the road: more than any contact"""
_MORE_DEPARTURE = 0.05
"""[m] beyond the least that any plan leaves the road that count for nothing where nothing is clear: the rear corner of
a car at the edge moves out as it turns away"""
_ABRUPT = 1e6
"""more than a clear plan costs; added to manoeuvres, and twice to what exceeds the jerk limit"""
_ROUNDING = 1e-9
"""share of a limit"""
_HOPELESS = 2
"""iterations after which the descent ends where nothing is clear: what is clear is so by then, but for very few"""
_HALVINGS = 4
"""of the way from a clear plan to one that is not"""
BEGIN, GIVE_UP, GO_ON, IF_ARRIVED, CHOOSE, EVALUATE = 1, 2, 4, 8, 16, 32
"""parts of a search"""
NOTHING, NOT_YET = -1, -2
"""no plan"""


@lent
class Wanted(NamedTuple):
    """What is searched for."""

    lanes: Float[np.ndarray, " L"]
    """[m] lat of the centres of the target lanes"""
    held: int
    """index of the lane that the last plan aimed at, of the own one where that is not among them"""
    extra: Float[np.ndarray, " L"]
    """cost of choosing each target lane, on top of its plan's"""
    last: Float[np.ndarray, "L N 2"]
    """inputs of the last plan to each target lane"""
    rest: Float[np.ndarray, "K 2"]
    """inputs of the rest of the last fail-safe branch"""
    accelerations: Float[np.ndarray, " g"]
    """[m/s²] of the simple manoeuvres"""

    @property
    def guesses(self) -> int:
        """Number of plans that are known before the descent."""
        return len(self.lanes) * len(self.accelerations) + 1


def room_for(wanted: Wanted, constants: Constants) -> Plans:
    """Room for the plans of a search: guesses, then a start for each target lane and one more, then evasions."""
    return empty_plans(wanted.guesses + 1 + len(wanted.lanes) + EVASIONS, len(constants.tree.parent))


def search(
    do: int, plans: Plans, wanted: Wanted, around: Surroundings, constants: Constants, number: int = 0,
    tolerance: float = TOLERANCE, best: Float[np.ndarray, "L N 2"] | None = None,
) -> tuple[int, bool]:  # fmt: skip
    """Do some parts of a search, one after the other: a call takes some hundredths of a millisecond, whatever it does.

    Args:
        do: sum of the parts: `BEGIN` writes the guesses with all that follows from them, and writes the starts;
            `GIVE_UP` ends the search where nothing is clear soon; `GO_ON` lets the starts descend; `CHOOSE` evaluates
            what they have become, and chooses, `IF_ARRIVED` only if the descent is at its end; `EVALUATE` does so with
            one plan, as `coverdrive.planning.check.evaluate.evaluate`, by what may be other surroundings.
        plans: room for them, or what parts before have made of it.
        wanted: target lanes.
        around: what the plans are made for.
        constants: of the problem.
        number: of steps that the starts descend by at the most; or index of the plan to evaluate.
        tolerance: the descent ends if the last step of the cheapest lowers the merit by a smaller share, or if nothing
            is clear after the first steps.
        best: where the inputs of the best plan to each target lane are written.

    Returns:
        The index of the chosen plan, `NOTHING` if none has a cost or the search was given up, `NOT_YET` if none was to
        be chosen; and whether it comes out of the descent and keeps to the jerk limit, or the descent has ended.
    """
    return _search(do, plans, wanted, number, tolerance, around, constants, wanted.last if best is None else best)


def is_compiled() -> bool:
    """Whether the search need not be compiled any more, which takes some seconds."""
    return is_there(_search)


@compiled
def _search(
    do: int, plans: Plans, wanted: Wanted, number: int, tolerance: float, around: Surroundings, constants: Constants,
    best: Float[np.ndarray, "L N 2"],
) -> tuple[int, bool]:  # fmt: skip
    """All parts of a search: machine code of whatever Python calls comprises all that is called from there."""
    ended = False
    if do & EVALUATE:
        evaluate(plans, number, number + 1, around, constants)
    if do & BEGIN:
        _begin(plans, wanted, around, constants)
    if do & (GIVE_UP | GO_ON):
        ended, given_up = _go_on(plans, wanted, number, tolerance, do & GIVE_UP != 0, around, constants)
        if given_up:
            return NOTHING, True
    if do & CHOOSE or (do & IF_ARRIVED and ended):
        return _choose(plans, wanted, around, constants, best)
    return NOT_YET, ended


@compiled
def _begin(plans: Plans, wanted: Wanted, around: Surroundings, constants: Constants) -> None:
    """Write the guesses with all that follows from them, and write the starts."""
    tree, lanes, tried = constants.tree, wanted.lanes, len(wanted.accelerations)
    guesses = len(lanes) * tried
    for i in range(guesses):
        lane, acceleration = i // tried, wanted.accelerations[i % tried]
        write_manoeuvre(plans, i, lanes[lane], lane, lanes[lane], acceleration, 1.0, 1, around, constants)
    for n in range(len(tree.parent)):
        write(plans.inputs[guesses, n], wanted.rest[tree.moment[n] - 1])
    aim(plans, guesses, wanted.held, lanes[wanted.held])
    evaluate(plans, guesses, guesses + 1, around, constants)
    allowed = _allowed_departure(plans, guesses + 1)
    safest, least = 0, np.inf
    for i in range(guesses + 1):
        rank = _rank(plans, i, allowed)
        if rank < least:
            safest, least = i, rank
    for lane in range(len(lanes)):
        start, pair = guesses + 1 + lane, np.empty_like(plans.inputs[0])
        write_rows(plans.inputs[start], wanted.last[lane])
        aim(plans, start, lane, lanes[lane])
        least = merit(plans.inputs[start], plans.targets[start], around, constants).value
        if lane == wanted.held:
            start, least = guesses + 1 + len(lanes), np.inf
            aim(plans, start, lane, lanes[lane])
        seen = np.zeros(tried, np.bool_)
        for _ in range(tried):
            i = _cheapest(plans.driving, lane * tried, seen)
            if i < 0 or plans.driving[i] >= least:  # no fail-safe branch makes it cheaper
                break
            seen[i - lane * tried] = True
            for n in range(len(pair)):
                write(pair[n], plans.inputs[safest if tree.safe[n] else i, n])
            targets = np.array([lanes[lane], plans.targets[safest, 0]])
            cost = merit(pair, targets, around, constants).value
            if cost < least:
                least = cost
                write_rows(plans.inputs[start], pair)
                write(plans.targets[start], targets)


@compiled
def _cheapest(driving: Float[np.ndarray, " m"], first: int, seen: Bool[np.ndarray, " g"]) -> int:
    """Index of the plan with the cheapest drive branch among those not seen of a lane, −1 if none has a cost."""
    cheapest, least = -1, np.inf
    for i in range(len(seen)):
        if not seen[i] and driving[first + i] < least:
            cheapest, least = first + i, driving[first + i]
    return cheapest


@compiled
def _go_on(
    plans: Plans, wanted: Wanted, iterations: int, tolerance: float, giving_up: bool, around: Surroundings,
    constants: Constants,
) -> tuple[bool, bool]:  # fmt: skip
    """Let the starts descend by so many steps at the most, and before that by a few if ``giving_up``.

    Returns whether that is all, as the cheapest has arrived or nothing is clear after the first steps, and whether
    that was so in the few.
    """
    first = len(wanted.lanes) * len(wanted.accelerations) + 1
    if plans.clear[:first].any():
        return _descended(plans, wanted, iterations, tolerance, around, constants), False
    if giving_up:
        _descended(plans, wanted, _HOPELESS, tolerance, around, constants)
        if _hopeless(plans, wanted, around, constants):
            return True, True
    soon = min(iterations, _HOPELESS)
    arrived = _descended(plans, wanted, soon, tolerance, around, constants)
    if _hopeless(plans, wanted, around, constants) or arrived:
        return True, False
    return _descended(plans, wanted, iterations - soon, tolerance, around, constants), False


@compiled
def _descended(
    plans: Plans, wanted: Wanted, iterations: int, tolerance: float, around: Surroundings, constants: Constants
) -> bool:
    """Let the starts descend by so many steps at the most; returns whether the cheapest has arrived."""
    first = len(wanted.lanes) * len(wanted.accelerations) + 1
    starts = slice(first, first + 1 + len(wanted.lanes))
    extra = np.empty(1 + len(wanted.lanes))
    for b in range(len(extra)):
        extra[b] = wanted.extra[plans.lane[first + b]]
    descent = descend(plans.inputs[starts], plans.targets[starts], extra, around, constants, iterations, tolerance)
    for b in range(len(extra)):
        write_rows(plans.inputs[first + b], descent.inputs[b])
    return bool(descent.done[np.argmin(descent.value + extra)])


@compiled
def _hopeless(plans: Plans, wanted: Wanted, around: Surroundings, constants: Constants) -> bool:
    """Whether neither a guess is clear nor what the starts have become."""
    first = len(wanted.lanes) * len(wanted.accelerations) + 1
    last = first + 1 + len(wanted.lanes)
    evaluate(plans, first, last, around, constants)
    return not plans.clear[:last].any()


@compiled
def _choose(
    plans: Plans, wanted: Wanted, around: Surroundings, constants: Constants, best: Float[np.ndarray, "L N 2"]
) -> tuple[int, bool]:
    """Evaluate what the starts have become, and choose."""
    first, lanes = len(wanted.lanes) * len(wanted.accelerations) + 1, len(wanted.lanes)
    last = first + 1 + lanes
    evaluate(plans, first, last, around, constants)
    cheapest, least = -1, np.inf
    for i in range(last):
        price = plans.cost[i] + _ABRUPT * abrupt(plans.inputs[i], around, constants)
        if plans.clear[i] and price < least:
            cheapest, least = i, price
    if cheapest >= 0:
        base = plans.inputs[cheapest].copy()
        for i in range(first, last):
            if not plans.clear[i]:
                _draw_back(plans, i, base, around, constants)
    else:
        last = evade(plans, last, wanted.lanes, around, constants)
    allowed = _allowed_departure(plans, last)
    standing, chosen, least = np.full(lanes, np.inf), -1, np.inf
    for i in range(last):
        lane, rank = plans.lane[i], _rank(plans, i, allowed)
        if plans.clear[i]:
            rank += _ABRUPT * ((i < first) + 2 * abrupt(plans.inputs[i], around, constants))
        if rank < standing[lane]:
            standing[lane] = rank
            write_rows(best[lane], plans.inputs[i])
        if rank + wanted.extra[lane] < least:
            chosen, least = i, rank + wanted.extra[lane]
    if chosen >= first + 1 + lanes + WAYS:  # it is steered more finely than a plan can say, and was chosen for that
        harm, expected = plans.harm[chosen], plans.expected[chosen]
        evaluate(plans, chosen, chosen + 1, around, constants)
        plans.harm[chosen], plans.expected[chosen] = harm, expected
    return chosen, first <= chosen < first + 1 + lanes and not abrupt(plans.inputs[chosen], around, constants)


@compiled
def abrupt(inputs: Float[np.ndarray, "N 2"], around: Surroundings, constants: Constants) -> bool:
    """Whether the first inputs differ from the previous ones by more than the jerk limit allows, along or across."""
    most, before = constants.vehicle.max_jerk * constants.period * (1 + _ROUNDING), around.previous_input
    across = max(around.state[2], 1.0) * abs(inputs[0, 1] - before[1])
    return max(abs(inputs[0, 0] - before[0]), across) > most


@compiled
def _mix(
    to: Float[np.ndarray, "N 2"], base: Float[np.ndarray, "N 2"], wanted: Float[np.ndarray, "N 2"], share: float
) -> None:
    """Write what lies a share of the way from a base to what is wanted."""
    for n in range(len(to)):
        for i in range(2):
            to[n, i] = base[n, i] + share * (wanted[n, i] - base[n, i])


@compiled
def _draw_back(
    plans: Plans, i: int, base: Float[np.ndarray, "N 2"], around: Surroundings, constants: Constants
) -> None:
    """Replace a plan that is not clear by the nearest one on the way to a clear one that is, found by bisection."""
    wanted, clear, unclear = plans.inputs[i].copy(), 0.0, 1.0
    for _ in range(_HALVINGS):
        share = (clear + unclear) / 2
        _mix(plans.inputs[i], base, wanted, share)
        evaluate(plans, i, i + 1, around, constants)
        if plans.clear[i]:
            clear = share
        else:
            unclear = share
    _mix(plans.inputs[i], base, wanted, clear)
    evaluate(plans, i, i + 1, around, constants)


@compiled
def _allowed_departure(plans: Plans, last: int) -> float:
    """[m] of leaving the road that count for nothing where nothing is clear."""
    least = np.inf
    for i in range(last):
        least = min(least, plans.departure[i])
    return least + _MORE_DEPARTURE


@compiled
def _rank(plans: Plans, i: int, allowed: float) -> float:
    """The lower, the better: clear plans by their cost; others by leaving the road, by being worse than full braking,
    by the harm to expect of them, and by their cost, which counts how deep and how early they get into boxes.
    """
    if plans.clear[i]:
        return plans.cost[i]
    leaving, worse = max(0.0, plans.departure[i] - allowed), max(0.0, plans.harm[i] - plans.harm[0])
    return _UNCLEAR + _PER_DEPARTURE * leaving + _PER_WORSE * worse + _PER_HARM * plans.expected[i] + plans.cost[i]
