"""Why plans are not clear, in words; and that what a plan meets, told afterwards, is what the planner judged it by."""

from dataclasses import replace

import numpy as np
import pytest
from report_fakes import HORIZON

from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning.planner import MpcPlanner
from coverdrive.reporting.drives.reasons import Reason, first_contacts, reason_of, where_is
from coverdrive.road import Road
from coverdrive.simulation.drives.trace import Trace


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
        path in (0, 1, 2)
        and text
        == "would meet 3 of 6 predicted paths, hardest that of the vehicle ahead in the same lane, in 1.1 s, at 4.5 m/s"
    )


@pytest.mark.parametrize(
    ("ahead", "aside", "said"),
    [
        (3.0, 1.5, "beside in the same lane, now"),
        (3.0, 2.0, "beside on the left, now"),
        (2.0, 3.6, "beside on the left"),
        (-4.8, 0.5, "behind in the same lane, now"),
    ],
)
def test_where_it_is(trace, ahead: float, aside: float, said: str) -> None:
    assert said in reason_of(changed(trace, Status.UNSAFE, ahead, aside), 0).text


def test_who_is_on_the_line_is_partly_in_the_same_lane(trace) -> None:
    lats = np.array(trace.scene.lat)
    lats[0, :2] = 6.9, 7.5
    assert where_is(replace(trace, scene=replace(trace.scene, lat=lats)), 0, 1) == "ahead partly in the same lane"


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"lat": 0.5}, "would get 0.50 m off the road"),
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


ROAD, TIMES = Road.straight(), 0.25 * np.arange(13)


def straight(speed: float, lat: float = 1.8) -> Plan:
    states = np.stack([100 + speed * TIMES, *(np.full(13, value) for value in (lat, speed, 0.0))], axis=-1)
    return Plan(states, np.zeros((12, 2)), np.zeros(12), Status.UNSAFE, 0.0, 0.0, 0.25)


def boxes(*others: tuple[float, float, float], growth: float = 0.0) -> PredictedPaths:
    """Others from a place ahead of the ego [m], at a lat [m] and a speed [m/s]; 4 m by 2 m, and larger every second."""
    points = np.array([[(100 + ahead + speed * t, lat) for t in TIMES] for ahead, lat, speed in others])
    half_sizes = np.array([2.0, 1.0]) + growth * TIMES[:, None]
    return PredictedPaths(points, np.arange(1, len(others) + 1), np.tile(half_sizes, (len(others), 1, 1)), 0.25)


def test_time_and_speed_of_contact_by_hand() -> None:
    others = boxes((24.4, 1.8, 10.0), (4.0, 1.8, 20.0), (24.4, 5.4, 0.0), (-20.0, 1.8, 20.0))
    found = first_contacts(straight(20.0), others, ROAD, 4.8, 1.9)
    assert found.times == pytest.approx([2.0, 0.0, np.inf, np.inf])
    assert found.speeds == pytest.approx([10.0, 0.0, 0.0, 0.0], abs=1e-9)
    assert found.departure == 0


def test_a_box_that_grows_is_met_earlier() -> None:
    found = first_contacts(straight(20.0), boxes((24.4, 1.8, 10.0), growth=1.0), ROAD, 4.8, 1.9)
    assert found.times == pytest.approx([20 / 11])


def test_the_fail_safe_branch_is_looked_at() -> None:
    plan = replace(straight(20.0), fail_safe=straight(20.0, lat=5.4).states)
    found = first_contacts(plan, boxes((24.4, 1.8, 0.0), (24.4, 5.4, 0.0)), ROAD, 4.8, 1.9)
    assert np.isfinite(found.times).tolist() == [False, True]


def test_the_body_beyond_the_edge_of_the_road_is_told() -> None:
    for lat in (0.8, 10.8 - 0.8):
        found = first_contacts(straight(20.0, lat), boxes((500.0, 1.8, 0.0)), ROAD, 4.8, 1.9)
        assert found.departure == pytest.approx(0.15)


@pytest.mark.parametrize("gap", [8.0, 15.0, 30.0])
def test_the_worst_speed_is_the_severity_that_the_planner_gave(gap: float) -> None:
    planner = MpcPlanner()
    planner.reset(0.1)
    others = boxes(*((gap + 4.4, lat, 0.0) for lat in ROAD.centres), growth=0.2)
    plan = planner.plan(np.array([100.0, 1.8, 25.0, 0.0]), others, ROAD)
    vehicle = planner.settings.problem.vehicle
    found = first_contacts(plan, others, ROAD, vehicle.length, vehicle.width)
    assert plan.status is Status.UNSAFE and plan.severity > 5
    assert found.speeds.max() == pytest.approx(plan.severity, abs=1e-6)
