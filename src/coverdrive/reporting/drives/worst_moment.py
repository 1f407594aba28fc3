"""Where to look in a drive, and what happened there, in words and in order of time.

A drive that ended in a contact went wrong before it: when the clear plan was lost for good, else when the other one
left its predicted set. Of all others it is the moment when the ego was nearest to somebody, by its gap beside
`NEAR_GAP`, or by its time to collision beside `NEAR_TIME`; how it was put there at the start counts if that was a near
miss, or if nothing came later.
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
from coverdrive.simulation.measures.metrics import clear_plans, distances, gaps
from coverdrive.simulation.measures.misses import Windows, left_recently
from coverdrive.simulation.measures.notable import NEAR_GAP, NEAR_TIME
from coverdrive.simulation.roads.initial import EGO

Measure = Literal["gap", "time"]
"""Of nearness: the distance of the bodies, or the time to collision"""

_STILL = 0.2
"""[m/s²] a smaller acceleration is not worth a word"""
_ASIDE = 0.5
"""[m] a smaller way across is not"""
_FASTER = 1.0
"""[m/s] nor is a smaller difference of speeds"""
_NEAR = 2.0
"""[s] headway from which on whoever is ahead is not either"""
_LONG = 8.0
"""[m] a vehicle of that length is a lorry or a bus"""


_ROUNDING = 1e-6
"""[s] of a time"""


class Nearest(NamedTuple):
    """When the ego was nearest to somebody."""

    moment: int
    slot: int
    """who that was"""
    share: float
    """how near, as a share of the limit below which a drive is a near miss"""
    away: str
    """how near, in words"""
    text: str
    """the same, and where it was seen from the ego"""


class Worst(NamedTuple):
    """The worst moment of a drive."""

    moment: int
    slot: int
    """who was there; −1 for nobody"""
    name: str
    """what is worst in it"""
    text: str
    """how it came about, and what came of it"""


def nearest(trace: Trace, measure: Measure, first: int = 0) -> Nearest | None:
    """The moment of the least gap, or time to collision, of a drive from a first one on; None if nobody is met."""
    values = np.where(np.arange(len(trace.time)) < first, np.inf, _values(trace, measure))
    moment = int(values.argmin())
    value = float(values[moment])
    if not np.isfinite(value):
        return None
    slot = int(_values(_one_by_one(trace, moment), measure).argmin())
    where = f"the vehicle {where_is(trace, moment, slot)}"
    share, away, text = {
        "gap": (value / NEAR_GAP, f"{value:.2f} m away", f"least gap, {value:.2f} m to {where}"),
        "time": (
            value / NEAR_TIME, f"{value:.1f} s from a collision", f"least time to collision, {value:.1f} s with {where}"
        ),
    }[measure]  # fmt: skip
    return Nearest(moment, slot, share, away, text)


def worst_moment(trace: Trace, windows: Windows) -> Worst:
    """The moment at which a drive that ended in a contact went wrong; of another one, when it was nearest to one.

    Args:
        trace: the drive.
        windows: all of its windows.
    """
    outcome = trace.outcome
    if outcome.kind is not Kind.FINISHED and outcome.partner is not None:
        slot, away = outcome.partner, ""
        moment, name = _went_wrong(trace, windows, slot)
        later = float(trace.time[-1] - trace.time[moment])
        touch = f"in fact they touch {later:.1f} s later" if later > 0 else "they touch"
        end = f"; {touch} ({outcome.kind.value}, at fault: {outcome.at_fault.value})"
    else:
        worst, since = _nearest(trace, 0), "of this drive"
        if worst is None:
            return Worst(0, -1, "start", "nobody was near in this drive")
        started = round(trace.horizon / float(trace.time[1]))
        if worst.moment < started and worst.share >= 1 and (later := _nearest(trace, started)):
            worst, since = later, f"after the first {trace.horizon:g} s"
        moment, slot, _, away, _ = worst
        name, away, end = "worst moment", f", {away}, the least {since}", ""
    first = _since(trace, moment, slot)
    was, now = (where_is(trace, each, slot) for each in (first, moment))
    then = f"At {trace.time[moment]:.1f} s it is {'still ' * (was == now and first < moment)}{now}{away}"
    return Worst(
        moment,
        slot,
        name,
        f"{_came(trace, windows, moment, slot)} {then}, and {_plan(trace, moment, slot, name)}{end}.",
    )


def _nearest(trace: Trace, first: int) -> Nearest | None:
    """When the ego was nearest to somebody by gap or time, from a first moment on; None if nobody was near."""
    near = [each for measure in ("gap", "time") if (each := nearest(trace, measure, first))]
    return min(near, key=lambda each: each.share, default=None)


def _went_wrong(trace: Trace, windows: Windows, slot: int) -> tuple[int, str]:
    """The moment from which on no plan was clear until the contact, else the vehicle had left its set; else that."""
    for name, wrong in (
        ("clear plan lost", ~clear_plans(trace)), ("set left", left_recently(trace, windows)[:, slot])
    ):  # fmt: skip
        since = len(wrong) - int(np.logical_and.accumulate(wrong[::-1]).sum())
        if 0 < since < len(wrong):
            return since, name
    return len(trace), "contact"


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


def _came(trace: Trace, windows: Windows, moment: int, slot: int) -> str:
    """From where a vehicle came, how fast, what it did within one horizon, what its sets said, and what the ego did."""
    scene, first = trace.scene, _since(trace, moment, slot)
    faster = float(scene.speed[first, slot] - scene.speed[first, EGO])
    pace = f", {abs(faster):.1f} m/s {'faster' if faster > 0 else 'slower'} than the ego" * (abs(faster) >= _FASTER)
    came = "came up" if first > 0 and not scene.valid[first - 1, slot] else "was"
    who = f"a {'long ' * bool(scene.length[moment, slot] > _LONG)}vehicle {came} {where_is(trace, first, slot)}{pace}"
    began = f"At {trace.time[first]:.1f} s {who}; "
    if first == moment:
        return f"{began}nothing had been predicted for it."
    number, since = moment - first, trace.time[moment] - trace.time[first:moment]
    left = int((windows.left[first:moment, slot] <= since + _ROUNDING).sum())
    sets = "stayed in all" if not left else "got out of all" if left == number else f"got out of {left} of"
    sets += f" the {number} sets that were predicted for it"
    if number == 1:
        sets = f"{'got out of' if left else 'stayed in'} the set that was predicted for it"
    own = " and ".join(_did(trace, first, moment, EGO))
    *did, last = [*_did(trace, first, moment, slot), sets]
    return f"{began}it {', '.join(did)}{' and ' * bool(did)}{last}{f', while the ego {own}' * bool(own)}."


def _did(trace: Trace, first: int, moment: int, slot: int) -> list[str]:
    """How a vehicle changed its speed and its place across."""
    faster, aside = (
        float(each[moment, slot] - each[first, slot]) for each in (trace.scene.speed, trace.scene.lat)
    )  # fmt: skip
    return [
        *[f"{'sped up' if faster > 0 else 'slowed'} by {abs(faster):.1f} m/s"] * (abs(faster) >= _FASTER),
        *[f"moved {_across(aside)}"] * (abs(aside) >= _ASIDE),
    ]


def _across(aside: float) -> str:
    """A way across the road [m], in words."""
    return f"{abs(aside):.1f} m to the {'left' if aside > 0 else 'right'}"


def _leader(trace: Trace, moment: int, slot: int) -> str:
    """Behind whom the ego drives, if that is somebody else than the vehicle of the slot, and near."""
    scene, road = trace.scene, trace.road
    lon, lane = scene.lon[moment], road.lane_at(scene.lon[moment], scene.lat[moment])
    gap = lon - lon[EGO] - (scene.length[moment] + scene.length[moment, EGO]) / 2
    gap = np.where(np.asarray(scene.valid)[moment] & (lane == lane[EGO]) & (lon > lon[EGO]), gap, np.inf)
    ahead, faster = int(gap.argmin()), scene.speed[moment] - scene.speed[moment, EGO]
    if ahead == slot or gap[ahead] > _NEAR * max(float(scene.speed[moment, EGO]), _FASTER):
        return ""
    pace = float(faster[ahead])
    told = f" that is {abs(pace):.1f} m/s {'faster' if pace > 0 else 'slower'}" * (abs(pace) >= _FASTER)
    return f", {max(0.0, float(gap[ahead])):.0f} m behind a vehicle{told}"


def _plan(trace: Trace, moment: int, slot: int, name: str) -> str:
    """What the ego planned; at the end of a drive, what it last had."""
    step = min(moment, len(trace) - 1)
    plan, road = trace.plans[step], trace.road
    acceleration = float(plan.inputs[0, 0])
    speed = f"{'speeds up' if acceleration > 0 else 'brakes'} at {abs(acceleration):.1f} m/s²"
    here, there = (int(road.lane_at(state[0], state[1])) for state in (plan.states[0], plan.states[-1]))
    aside = float(plan.states[-1, 1] - plan.states[0, 1])
    lane = f"goes to the {'left' if there > here else 'right'}"
    if here == there:
        lane = "keeps its lane" if abs(aside) < _ASIDE else f"moves {_across(aside)}"  # of one between two lanes
    does = f"{'holds its speed' if abs(acceleration) < _STILL else speed} and {lane}{_leader(trace, step, slot)}"
    if plan.status in (Status.SOLVED, Status.FALLBACK):
        return f"the {'last ' * (step < moment)}plan, clear of every set, {does}"
    lost = "the clear plan is lost" if name == "clear plan lost" else "no clear plan is found"
    why, path, _ = reason_of(trace, step)
    if path >= 0 and trace.paths[step].vehicle[path] == slot:
        why = why.replace(f"that of the vehicle {where_is(trace, step, slot)}", "this vehicle's")
    return f"{lost}: the ego {does} ({why})"
