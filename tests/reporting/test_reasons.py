"""The reason says whom the plan meets, when and how fast, or what else keeps it from being clear."""

from dataclasses import replace

import numpy as np
import pytest
from report_fakes import HORIZON

from coverdrive.plan import Status
from coverdrive.reporting.reasons import Reason, reason_of
from coverdrive.simulation.trace import Trace


def changed(
    trace: Trace, status: Status, ahead: float = 60.0, aside: float = 0.0, lat: float | None = None, **more
) -> Trace:
    """The first step with vehicle 1 so far ahead of the ego and to its left; the ego drives straight on."""
    scene, plan, paths = trace.scene, replace(trace.plans[0], status=status, **more), trace.paths[0]
    lon, lats = np.array(scene.lon), np.array(scene.lat)
    lon[0, 1], lats[0, 1] = lon[0, 0] + ahead, lats[0, 0] + aside
    if lat is not None:
        states = plan.states.copy()
        states[:, 1] = lat
        plan = replace(plan, states=states)
    own = paths.vehicle == 1
    points = paths.points + np.where(
        own[:, None, None], [lon[0, 1], lats[0, 1]] - paths.points[own][1, 0], [500.0, 0.0]
    )
    scene = replace(scene, lon=lon, lat=lats)
    return replace(trace, scene=scene, plans=(plan,), paths=(replace(paths, points=points),))


def test_what_is_clear_needs_no_reason(trace) -> None:
    assert reason_of(changed(trace, Status.SOLVED, ahead=6.0), 0) == Reason()


def test_whom_the_plan_meets_when_and_how_fast(trace) -> None:
    text, path, time = reason_of(changed(trace, Status.UNSAFE, ahead=10.0), 0)
    assert time == pytest.approx((10.0 - 2.5 - 2.5) / 4.4, abs=0.02)  # faster by 4.4 m/s
    assert (
        path in (0, 1, 2) and text == "meets 3 of 6 paths, hardest the vehicle ahead in its lane, in 1.1 s, at 4.5 m/s"
    )


@pytest.mark.parametrize(
    ("ahead", "aside", "said"),
    [(3.0, 2.0, "beside in its lane, now"), (2.0, 3.6, "beside on the left"), (-4.8, 0.5, "behind in its lane, now")],
)
def test_where_it_is(trace, ahead: float, aside: float, said: str) -> None:
    assert said in reason_of(changed(trace, Status.UNSAFE, ahead, aside), 0).text


def test_a_follower_that_is_trusted_is_named(trace) -> None:
    text = reason_of(changed(trace, Status.REAR, ahead=-4.8), 0).text
    assert text.startswith("if the vehicle behind does not brake: meets ")


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"lat": 0.5}, "gets 0.50 m off the road"),
        ({"severity": 2.0}, "could not brake behind a vehicle after its end, 2.0 m/s too fast"),
        ({}, "meets nothing that is seen now"),
    ],
)
def test_what_else_there_is(trace, more: dict, said: str) -> None:
    assert len(trace.plans[0].states) == HORIZON + 1
    assert reason_of(changed(trace, Status.UNSAFE, **more), 0) == Reason(said)


def test_nothing_is_told_of_what_cannot_be_true(trace) -> None:
    reason = reason_of(changed(trace, Status.INVALID_INPUT, ahead=6.0), 0)
    assert reason.path == -1 and "cannot be true" in reason.text
