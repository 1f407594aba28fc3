"""The worst moment of a drive, and what is said of it."""

from dataclasses import replace

import numpy as np
import pytest
from report_fakes import COMES, LEAVES, STEPS, make_stray, make_trace

from coverdrive.plan import Status
from coverdrive.reporting.drives.reasons import where_is
from coverdrive.reporting.drives.worst_moment import Worst, nearest, worst_moment
from coverdrive.simulation.drives.outcome import Fault, Kind, Outcome
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.metrics import distances, gaps
from coverdrive.simulation.measures.misses import Windows, find_windows


def worst_of(trace: Trace) -> Worst:
    return worst_moment(trace, find_windows(trace))


def without(trace: Trace, *slots: int) -> Trace:
    valid = np.array(trace.scene.valid)
    valid[:, list(slots)] = False
    return replace(trace, scene=replace(trace.scene, valid=valid))


@pytest.mark.parametrize("measure", ["gap", "time"])
def test_who_is_nearest_is_whose_absence_makes_it_less_near(measure: str) -> None:
    trace = make_stray(40)
    values = gaps if measure == "gap" else lambda each: distances(each).time_to_collision
    found = nearest(trace, measure)
    assert found.moment == values(trace).argmin()
    here = [values(without(trace, slot))[found.moment] for slot in (1, 2)]
    assert here[found.slot - 1] > here[2 - found.slot] == values(trace)[found.moment]
    assert found.text.endswith(f"the vehicle {where_is(trace, found.moment, found.slot)}")


def test_the_worst_is_the_nearest_by_the_limits_of_a_near_miss() -> None:
    trace = make_trace(40)
    gap, time = nearest(trace, "gap"), nearest(trace, "time")
    assert worst_of(trace).moment == min(gap, time, key=lambda each: each.share).moment
    assert gap.share == pytest.approx(gaps(trace).min() / 1.0)


@pytest.mark.parametrize(("beside", "later", "moment"), [(1.5, True, 20), (0.5, True, 0), (1.5, False, 0)])
def test_how_it_was_put_there_counts_if_that_was_near_or_all(beside: float, later: bool, moment: int) -> None:
    """Vehicle 2 is that far [m] beside the ego at the start, and ahead of it once, 2 s later."""
    trace = without(make_trace(40), 1)
    lon, lat, speed, heading = (np.array(getattr(trace.scene, name)) for name in ("lon", "lat", "speed", "heading"))
    speed[:], heading[:] = 20.0, 0.0
    step = np.arange(41)
    lon[:, 2] = lon[:, 0] + np.select([step == 0, (step == 20) & later], [0.0, 8.0], 900.0)
    lat[:] = 1.8
    lat[0, 2] = 1.8 + 2.0 + beside
    valid = np.array(trace.scene.valid)
    valid[1:, 2] &= later
    changed = replace(trace.scene, lon=lon, lat=lat, speed=speed, heading=heading, valid=valid)
    worst = worst_of(replace(trace, scene=changed))
    assert worst[:2] == (moment, 2)
    assert f", the least {f'after the first {trace.horizon:g} s' if moment else 'of this drive'}, and " in worst.text


def in_contact(trace: Trace, statuses: str, partner: int) -> Trace:
    """Ended in a contact, with a plan that was clear (c), or not (n), in every step."""
    named = {"c": Status.SOLVED, "n": Status.UNSAFE}
    plans = [replace(plan, status=named[each]) for plan, each in zip(trace.plans, statuses, strict=True)]
    outcome = Outcome(Kind.SIDE, float(trace.time[-1]), partner, Fault.OTHER)
    return replace(trace, plans=tuple(plans), outcome=outcome)


@pytest.mark.parametrize(
    ("statuses", "partner", "moment", "name", "plan"),
    [
        ("ccnncccccnnn", 2, 9, "clear plan lost", "the clear plan is lost: the ego holds"),  # for good
        ("nncccccccccc", 2, LEAVES, "set left", "the plan, clear of every set, holds"),
        ("nnnnnnnnnnnn", 2, LEAVES, "set left", "no clear plan is found: the ego holds"),  # there was none to lose
        ("cccccccccccc", 1, STEPS, "contact", "the last plan, clear of every set, holds"),  # it stayed in its set
    ],
)
def test_a_contact_is_seen_where_it_began(statuses: str, partner: int, moment: int, name: str, plan: str) -> None:
    trace = in_contact(make_stray(), statuses, partner)
    worst = worst_of(trace)
    assert worst[:3] == (moment, partner, name)
    assert f" At {moment / 10:.1f} s it is {where_is(trace, moment, partner)}, and {plan}" in worst.text
    touch = f"in fact they touch {(STEPS - moment) / 10:.1f} s later" if moment < STEPS else "they touch"
    assert worst.text.endswith(f"; {touch} (side, at fault: other).")
    assert (name == "clear plan lost") is ("(would meet 1 of 6 predicted paths: this vehicle's, in " in worst.text)


def test_it_is_said_where_nobody_was_near() -> None:
    assert worst_of(without(make_trace(), 1, 2)) == Worst(0, -1, "start", "nobody was near in this drive")
    assert nearest(without(make_trace(), 1, 2), "gap") is None


def test_who_moved_across_and_what_its_sets_had_said() -> None:
    """Of vehicle 2, which is alone, and jumps by 3 m to the right out of its sets at moment 6 towards the ego."""
    trace = without(make_stray(), 1)
    worst = worst_of(trace)
    assert (worst.moment, worst.slot) == (LEAVES, 2)
    windows = find_windows(trace)
    left = sum(windows.left[step, 2] <= (LEAVES - step) / 10 + 1e-6 for step in range(LEAVES))
    aside = trace.scene.lat[LEAVES, 0] - trace.scene.lat[0, 0]
    told = (
        "At 0.0 s a vehicle was beside on the left, 4.8 m/s slower than the ego; it moved 3.0 m to the right and {} "
        f"the {LEAVES} sets that were predicted for it, while the ego moved {aside:.1f} m to the left. "
        f"At {LEAVES / 10:.1f} s it is beside in the same lane, 0.00 m away, the least of this drive, and "
    )
    got_out = "got out of all" if left == LEAVES else f"got out of {left} of"
    assert left > 0 and worst.text.startswith(told.format(got_out))
    kept = Windows(windows.seen, np.full_like(windows.left, np.inf))
    assert worst_moment(trace, kept).text.startswith(told.format("stayed in all"))


def test_how_fast_it_was_and_became_and_that_it_is_long() -> None:
    trace = without(make_stray(), 1)
    scene = trace.scene
    speed, length = np.array(scene.speed), np.array(scene.length)
    speed[:, 2] -= np.linspace(0.0, 6.0, STEPS + 1)
    length[:, 2] = 12.0
    text = worst_of(replace(trace, scene=replace(scene, speed=speed, length=length))).text
    assert (
        "a long vehicle was beside" in text and " 4.8 m/s slower than the ego; it slowed by 3.0 m/s, moved 3.0" in text
    )


def test_one_set_is_said_as_one_and_who_is_ahead_is_told() -> None:
    """Vehicle 2 is beside from the first step on, and vehicle 1 drives ahead of the ego."""
    trace = make_trace()
    scene = trace.scene
    lon, speed = np.array(scene.lon), np.array(scene.speed)
    lon[:, 1], speed[:, 1] = lon[:, 0] + 15.0, speed[:, 0] - 3.0
    lon[:, 2] = np.where(np.arange(STEPS + 1) == 1, lon[:, 0], lon[:, 0] + 300.0)
    near = replace(trace, scene=replace(scene, lon=lon, speed=speed))
    gap = 15.0 - (scene.length[1, 0] + scene.length[1, 1]) / 2
    worst = worst_of(near)
    assert (worst.moment, worst.slot) == (1, 2)
    assert "it got out of the set that was predicted for it" in worst.text
    assert f"keeps its lane, {gap:.0f} m behind a vehicle that is 3.0 m/s slower" in worst.text
    alone = worst_of(without(near, 1)).text
    assert "keeps its lane" in alone and "m behind" not in alone


def test_a_vehicle_that_came_is_followed_from_there() -> None:
    trace = without(make_stray(), 2)
    near = replace(trace.outcome, kind=Kind.SIDE, partner=1)
    worst = worst_of(replace(trace, outcome=near))
    assert worst.text.startswith(f"At {COMES / 10:.1f} s a vehicle came up ahead in the same lane, ")
    assert f"stayed in all the {STEPS - COMES} sets that were predicted for it" in worst.text
    valid = np.array(trace.scene.valid)
    valid[:STEPS, 1] = False
    late = replace(trace, scene=replace(trace.scene, valid=valid), outcome=near)
    assert "came up ahead on the right, 4.4 m/s slower than the ego; nothing had been pred" in worst_of(late).text


@pytest.mark.parametrize(
    ("acceleration", "aside", "said"),
    [(-2.0, 0.0, "brakes at 2.0 m/s² and keeps its lane"), (1.0, 3.6, "speeds up at 1.0 m/s² and goes to the left"),
     (0.1, -3.6, "holds its speed and goes to the right"), (0.1, 0.9, "holds its speed and moves 0.9 m to the left")],
)  # fmt: skip
def test_what_the_plan_did(acceleration: float, aside: float, said: str) -> None:
    trace = make_trace(40)
    moment = worst_of(trace).moment
    plan = trace.plans[moment]
    states, inputs = np.array(plan.states), np.array(plan.inputs)
    states[:, 1], states[-1, 1], inputs[0, 0] = 5.4, 5.4 + aside, acceleration
    solved = replace(plan, states=states, inputs=inputs, status=Status.SOLVED)
    plans = (*trace.plans[:moment], solved, *trace.plans[moment + 1 :])
    assert worst_of(replace(trace, plans=plans)).text.endswith(f"the plan, clear of every set, {said}.")
    lost = replace(solved, status=Status.INVALID_INPUT)
    plans = (*trace.plans[:moment], lost, *trace.plans[moment + 1 :])
    assert f"no clear plan is found: the ego {said} (what was seen" in worst_of(replace(trace, plans=plans)).text
