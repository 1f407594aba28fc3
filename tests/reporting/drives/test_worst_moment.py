"""The worst moment of a drive, and what is said of it."""

from dataclasses import replace

import numpy as np
import pytest
from report_fakes import COMES, LEAVES, STEPS, make_stray, make_trace

from coverdrive.plan import Status
from coverdrive.reporting.drives.reasons import where_is
from coverdrive.reporting.drives.worst_moment import Worst, nearest, worst_moment
from coverdrive.simulation.drives.outcome import Kind
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


def test_a_contact_is_the_worst() -> None:
    trace = make_trace(kind=Kind.SIDE)
    worst = worst_of(trace)
    assert (worst.moment, worst.slot) == (STEPS, 1)
    assert worst.text.startswith(f"side collision (at fault: other) with the vehicle {where_is(trace, STEPS, 1)}")
    assert "The last plan is" in worst.text


def test_it_is_said_where_nobody_was_near() -> None:
    assert worst_of(without(make_trace(), 1, 2)) == Worst(0, -1, "nobody was near in this drive")
    assert nearest(without(make_trace(), 1, 2), "gap") is None


def test_who_moved_across_and_what_its_sets_had_said() -> None:
    """Of vehicle 2, which is alone, and jumps by 3 m to the right out of its sets at moment 6 towards the ego."""
    trace = without(make_stray(), 1)
    worst = worst_of(trace)
    assert (worst.moment, worst.slot) == (LEAVES, 2)
    assert "4.8 m/s slower than the ego, it moved 3.0 m to the right, the ego moved" in worst.text
    seconds = LEAVES / 10
    assert f"beside in the same lane ({seconds:.1f} s before: beside on the left)" in worst.text
    windows = find_windows(trace)
    left = sum(windows.left[step, 2] <= seconds - step / 10 + 1e-6 for step in range(LEAVES))
    assert (
        left > 0
        and f"It left {left} of the {LEAVES} sets that were predicted for it in these {seconds:.1f} s." in worst.text
    )
    kept = Windows(windows.seen, np.full_like(windows.left, np.inf))
    assert f"It stayed in all {LEAVES} sets that were predicted" in worst_moment(trace, kept).text


def test_a_vehicle_that_came_is_followed_from_there() -> None:
    trace = without(make_stray(), 2)
    near = replace(trace.outcome, kind=Kind.SIDE, partner=1)
    worst = worst_of(replace(trace, outcome=near))
    assert (
        f"({(STEPS - COMES) / 10:.1f} s before" in worst.text
        and f" {STEPS - COMES} sets that were predicted" in worst.text
    )


@pytest.mark.parametrize(
    ("acceleration", "aside", "said"),
    [(-2.0, 0.0, "brakes at 2.0 m/s², keeps its lane"), (1.0, 3.6, "speeds up at 1.0 m/s², goes to the left"),
     (0.1, -3.6, "holds its speed, goes to the right")],
)  # fmt: skip
def test_what_the_plan_did(acceleration: float, aside: float, said: str) -> None:
    trace = make_trace(40)
    moment = worst_of(trace).moment
    plan = trace.plans[moment]
    states, inputs = np.array(plan.states), np.array(plan.inputs)
    states[:, 1], states[-1, 1], inputs[0, 0] = 5.4, 5.4 + aside, acceleration
    solved = replace(plan, states=states, inputs=inputs, status=Status.SOLVED)
    plans = (*trace.plans[:moment], solved, *trace.plans[moment + 1 :])
    assert worst_of(replace(trace, plans=plans)).text.endswith(
        f"The plan is solved (clear of every set): the ego {said}."
    )
    lost = replace(solved, status=Status.INVALID_INPUT)
    plans = (*trace.plans[:moment], lost, *trace.plans[moment + 1 :])
    assert "The plan is invalid input (what was seen" in worst_of(replace(trace, plans=plans)).text
