"""When a drive was nearest to a contact, and why, in words: who came from where, what its sets said, what the plan did.

A moment is as bad as its gap is small beside `NEAR_GAP`, or its time to collision beside `NEAR_TIME`.
"""

from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.plan import Status
from coverdrive.reporting.drives.reasons import reason_of, where_is
from coverdrive.scene import Scene
from coverdrive.simulation.drives.outcome import Kind
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.metrics import distances, gaps
from coverdrive.simulation.measures.misses import Windows
from coverdrive.simulation.measures.notable import NEAR_GAP, NEAR_TIME
from coverdrive.simulation.roads.initial import EGO

Measure = Literal["gap", "time"]
"""Of nearness: the distance of the bodies, or the time to collision"""

_STILL = 0.2
"""[m/s²] a smaller acceleration is not worth a word"""
_ASIDE = 0.5
"""[m] a smaller way across is not"""
_FASTER = 0.5
"""[m/s] nor is a smaller difference of speeds"""


_ROUNDING = 1e-6
"""[s] of a time"""


class Nearest(NamedTuple):
    """When the ego was nearest to somebody."""

    moment: int
    slot: int
    """who that was"""
    share: float
    """how near, as a share of the limit below which a drive is a near miss"""
    text: str
    """how near, and where it was seen from the ego"""


class Worst(NamedTuple):
    """The worst moment of a drive."""

    moment: int
    slot: int
    """who was there; −1 for nobody"""
    text: str


def nearest(trace: Trace, measure: Measure) -> Nearest | None:
    """The moment of the least gap, or time to collision, of a drive; None if nobody is met."""
    values = _values(trace, measure)
    moment = int(values.argmin())
    value = float(values[moment])
    if not np.isfinite(value):
        return None
    slot = int(_values(_one_by_one(trace, moment), measure).argmin())
    least, limit = {
        "gap": (f"least gap, {value:.2f} m to", NEAR_GAP),
        "time": (f"least time to collision, {value:.1f} s with", NEAR_TIME),
    }[measure]
    return Nearest(moment, slot, value / limit, f"{least} the vehicle {where_is(trace, moment, slot)}")


def worst_moment(trace: Trace, windows: Windows) -> Worst:
    """The contact of a drive that ended in one, else the moment when it was nearest to one.

    Args:
        trace: the drive.
        windows: all of its windows.
    """
    outcome = trace.outcome
    if outcome.kind is not Kind.FINISHED and outcome.partner is not None:
        moment, slot = len(trace), outcome.partner
        fault = f"at fault: {outcome.at_fault.value}"
        how = f"{outcome.kind.value} collision ({fault}) with the vehicle {where_is(trace, moment, slot)}"
    else:
        near = [each for measure in ("gap", "time") if (each := nearest(trace, measure))]
        if not near:
            return Worst(0, -1, "nobody was near in this drive")
        moment, slot, _, how = min(near, key=lambda each: each.share)
    said = " ".join([how + _came(trace, moment, slot) + ".", _sets(trace, windows, moment, slot), _plan(trace, moment)])
    return Worst(moment, slot, said)


def _values(trace: Trace, measure: Measure) -> Float[np.ndarray, " m"]:
    return gaps(trace) if measure == "gap" else distances(trace).time_to_collision


def _one_by_one(trace: Trace, moment: int) -> Trace:
    """A moment once for every slot, with nobody but the ego and that slot."""
    scene, slots = trace.scene, np.arange(trace.scene.vehicles)
    values = {name: np.repeat(np.asarray(each)[[moment]], len(slots), axis=0) for name, each in vars(scene).items()}
    values["valid"] = values["valid"] & ((slots == EGO) | (slots == slots[:, None]))
    return replace(trace, scene=Scene(**values))


def _since(trace: Trace, moment: int, slot: int) -> int:
    """The moment one horizon before, or when the vehicle came."""
    first = max(0, moment - round(trace.horizon / float(trace.time[1])))
    return first + int(np.asarray(trace.scene.valid)[first : moment + 1, slot].argmax())


def _came(trace: Trace, moment: int, slot: int) -> str:
    """From where a vehicle came, who of the two moved across, and how fast they are."""
    first = _since(trace, moment, slot)
    scene, seconds = trace.scene, float(trace.time[moment] - trace.time[first])
    was, now = (where_is(trace, each, slot) for each in (first, moment))
    place = f" ({seconds:.1f} s before: {was}{', too' * (was == now)})" if first < moment else ""
    faster = float(scene.speed[moment, slot] - scene.speed[moment, EGO])
    said = list[str]()
    if abs(faster) >= _FASTER:
        said.append(f"it is {abs(faster):.1f} m/s {'faster' if faster > 0 else 'slower'} than the ego")
    for name, who in (("it", slot), ("the ego", EGO)):
        aside = float(scene.lat[moment, who] - scene.lat[first, who])
        if abs(aside) >= _ASIDE:
            said.append(f"{name} moved {abs(aside):.1f} m to the {'left' if aside > 0 else 'right'}")
    return place + "".join(f", {each}" for each in said)


def _sets(trace: Trace, windows: Windows, moment: int, slot: int) -> str:
    """What the sets said that were predicted for a vehicle within one horizon before."""
    first = _since(trace, moment, slot)
    if first == moment:
        return "Nothing had been predicted for it before."
    number, since = moment - first, trace.time[moment] - trace.time[first:moment]
    left = int((windows.left[first:moment, slot] <= since + _ROUNDING).sum())
    held = f"left {left} of the {number}" if left else f"stayed in all {number}"
    return f"It {held} sets that were predicted for it in these {since[0]:.1f} s."


def _plan(trace: Trace, moment: int) -> str:
    """What the ego planned; at the end of a drive, what it last had."""
    step = min(moment, len(trace) - 1)
    plan, road = trace.plans[step], trace.road
    acceleration = float(plan.inputs[0, 0])
    speed = f"{'speeds up' if acceleration > 0 else 'brakes'} at {abs(acceleration):.1f} m/s²"
    here, there = (int(road.lane_at(state[0], state[1])) for state in (plan.states[0], plan.states[-1]))
    lane = "keeps its lane" if here == there else f"goes to the {'left' if there > here else 'right'}"
    clear = "clear of every set" if plan.status in (Status.SOLVED, Status.FALLBACK) else reason_of(trace, step).text
    does = f"{'holds its speed' if abs(acceleration) < _STILL else speed}, {lane}"
    return f"The {'last ' * (step < moment)}plan is {plan.status.value} ({clear}): the ego {does}."
