"""What a plan meets, told afterwards, is what the planner judged it by."""

from dataclasses import replace

import numpy as np
import pytest

from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning.planner import MpcPlanner
from coverdrive.reporting.first_contact import first_contacts
from coverdrive.road import Road

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
