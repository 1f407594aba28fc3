"""The planner in curves and where lanes end; and what it wants there."""

import numpy as np
import pytest
from bent_roads import LENGTH, in_map
from planning_scenes import CAR, PERIOD, PROBLEM
from test_bent_plans import beyond

from coverdrive.errors import SettingError
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning.planner import MpcPlanner
from coverdrive.planning.problem.vehicle import step
from coverdrive.planning.rules.target_lanes import target_lanes
from coverdrive.planning.rules.wish import Wish
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import LaneEdges, Road
from coverdrive.road_ahead import controls
from oracle.reference import ReferencePlanner

NOBODY = PredictedPaths(np.zeros((0, 13, 2)), np.zeros(0, int), np.zeros((0, 13, 2)), 0.25)
TIMES = 0.25 * np.arange(13)
EDGES = np.arange(4) * 3.6


def bend(curvature: np.ndarray, length: float = LENGTH) -> Road:
    return Road(EDGES, length, ReferenceLine(np.zeros(2), 0.4, curvature, length, lat=5.4))


def with_end(taper: float = 40.0) -> Road:
    """The right lane ends between 400 m and a taper later."""
    lat = np.tile(EDGES, (4, 1))
    lat[2:, 0] = 3.6
    return Road(EDGES, LENGTH, changing=LaneEdges(np.array([0.0, 400.0, 400.0 + taper, LENGTH]), lat))


def platoon(lon: float, time: float, speed: float) -> PredictedPaths:
    """Cars in the middle lane, bumper to bumper, at a speed."""
    number = np.arange(-150, 150)
    start = 6.0 * number + speed * time
    near = np.abs(start - lon) < 100
    points = np.zeros((near.sum(), 13, 2))
    points[..., 0], points[..., 1] = start[near, None] + speed * TIMES, 5.4
    return PredictedPaths(points, number[near] + 150, np.tile([2.4, 0.95], (len(points), 13, 1)), 0.25)


def drive(state: np.ndarray, road: Road, steps: int, others=lambda *_: NOBODY) -> tuple[np.ndarray, list[Plan]]:
    """The states (T, 4) and plans of a drive."""
    planner, states, plans = MpcPlanner(), [state], []
    planner.reset(PERIOD)
    for k in range(steps):
        plans.append(planner.plan(states[-1], others(states[-1][0], k * PERIOD), road))
        states.append(step(states[-1], plans[-1].inputs[0], PERIOD))
    return np.array(states), plans


@pytest.mark.parametrize("side", [-1, 1])
def test_it_slows_down_for_a_curve_in_time_and_stays_on_the_road(side: int) -> None:
    """From 40 m/s, 350 m before a curve of 150 m radius, to which 20 m of clothoid lead."""
    lon = np.linspace(0, LENGTH, 301)
    road = bend(side * np.clip((lon - 400) / 20, 0, 1) / 150)
    states, plans = drive(np.array([50.0, 1.8, 40.0, 0.0]), road, 180)
    real = controls(states[:-1], np.array([plan.inputs[0] for plan in plans]), road, CAR.wheelbase)
    assert states[-1, 0] > 450
    assert {plan.status for plan in plans} == {Status.SOLVED}
    assert np.abs(real.yaw_rate * real.speed).max() < 3.0 < 3.5 < CAR.max_lateral_acceleration
    assert real.acceleration.min() > -4.5
    assert np.interp(400.0, states[:, 0], states[:, 2]) < 24
    assert beyond(states, road) < 0
    assert np.abs(states[:, 1] - 1.8).max() < 0.3


def test_whoever_is_too_fast_brakes_as_hard_as_it_can() -> None:
    road = bend(np.where(np.arange(301) >= 70, 1 / 150, 0.0))
    _, plans = drive(np.array([100.0, 5.4, 40.0, 0.0]), road, 3)
    assert all(plan.inputs[0, 0] < -7 for plan in plans[1:])


def test_a_straight_line_makes_a_straight_road() -> None:
    state, paths = np.array([100.0, 1.8, 30.0, 0.02]), platoon(100.0, 0.0, 25.0)
    plans = [drive(state, road, 1, lambda *_: paths)[1][0] for road in (bend(np.zeros(301)), Road(EDGES, LENGTH))]
    np.testing.assert_allclose(plans[0].states, plans[1].states, atol=1e-3)


def test_a_mirrored_curve_has_the_mirrored_plan() -> None:
    road, mirror = bend(np.linspace(0, 1 / 200, 301)), np.array([1, -1, 1, -1])
    state = np.array([100.0, 2.0, 20.0, 0.02])
    points = np.array([150.0, 5.4]) + np.outer(TIMES, [10.0, -0.5])
    paths = PredictedPaths(points[None], np.zeros(1, int), np.tile([2.4, 0.95], (1, 13, 1)), 0.25)
    mirrored = PredictedPaths(points[None] * [1, -1], np.zeros(1, int), paths.half_sizes, 0.25)
    plan = drive(state, road, 1, lambda *_: paths)[1][0]
    other = drive(state * mirror, road.mirrored(), 1, lambda *_: mirrored)[1][0]
    np.testing.assert_allclose(other.states * mirror, plan.states, atol=1e-6)


def test_it_leaves_a_lane_long_before_it_ends() -> None:
    states, plans = drive(np.array([50.0, 1.8, 25.0, 0.0]), with_end(), 130)
    assert {plan.status for plan in plans} == {Status.SOLVED}
    assert np.interp(250.0, states[:, 0], states[:, 1]) > 5.0
    assert states[:, 2].min() > 24


def test_it_stays_in_a_lane_that_ends_where_that_is_wished_for() -> None:
    planner, state = MpcPlanner(), np.array([300.0, 1.8, 20.0, 0.0])
    planner.reset(PERIOD)
    stays, leaves = (planner.plan(state, NOBODY, with_end(), Wish(15.0, lanes)).states[-1, 1] for lanes in ((0,), ()))
    assert stays == pytest.approx(1.8, abs=0.1) and leaves > 3


@pytest.mark.parametrize("start", [300.0, 320.0])
def test_it_takes_a_gap_beside_and_does_not_overtake_up_to_the_end_of_its_lane(start: float) -> None:
    """Two cars drive beside at 13.5 m/s; who passes the first one on the right may not come ahead of it in time."""

    def two(lon: float, time: float) -> PredictedPaths:
        points = np.full((2, 13, 2), 5.4)
        points[..., 0] = start + np.array([[17.0], [-21.0]]) + 13.5 * (time + TIMES)
        return PredictedPaths(points, np.array([1, 2]), np.tile([2.4, 0.95], (2, 13, 1)), 0.25)

    states, plans = drive(np.array([start, 3.4, 15.0, -0.1]), with_end(20.0), 60, two)
    assert {plan.status for plan in plans} == {Status.SOLVED}
    assert states[:, 2].min() > 12 and states[40, 1] > 5.0


@pytest.mark.parametrize("taper", [10.0, 40.0])
def test_it_stops_before_its_lane_ends_where_nobody_lets_it_out(taper: float) -> None:
    road = with_end(taper)
    states, plans = drive(np.array([250.0, 1.8, 20.0, 0.0]), road, 200, lambda lon, time: platoon(lon, time, 18.0))
    assert {plan.status for plan in plans} <= {Status.SOLVED, Status.FALLBACK}
    assert states[-1, 2] < 0.5
    assert 380 < states[-1, 0] < 400 + taper
    assert states[:, 1].max() < 3.6
    assert beyond(states, road) <= 0.01


def test_lanes_are_aimed_at_where_they_are() -> None:
    road = with_end()
    for lon, lanes, first in (
        (100.0, [0, 1], True),
        (250.0, [0, 1], False),
        (380.0, [0, 1], False),
        (500.0, [1, 2], False),
    ):
        got = target_lanes(np.array([lon, 1.8, 20.0, 0.0]), road, 3.0)
        assert (got.lanes, got.lasting.tolist()) == (lanes, [first, True, True])
    assert target_lanes(np.array([380.0, 5.4, 20.0, 0.0]), road, 3.0).lanes == [1, 2]  # not back
    got = target_lanes(np.array([380.0, 9.0, 20.0, 0.0]), Road.straight(), 3.0)
    assert (got.lanes, got.lat.tolist()) == ([2, 1], [9.0, 5.4])


def middle_ends() -> Road:
    """Of three lanes that in the middle narrows to nothing between 300 and 360 m."""
    lat = np.array([[0, 3.6, 7.2, 10.8], [0, 3.6, 7.2, 10.8], [1.8, 5.4, 5.4, 9.0], [1.8, 5.4, 5.4, 9.0]])
    return Road(EDGES, LENGTH, changing=LaneEdges(np.array([0.0, 300.0, 360.0, LENGTH]), lat))


def test_where_a_lane_in_the_middle_has_ended_those_beside_it_are_neighbours() -> None:
    road = middle_ends()
    got = target_lanes(np.array([450.0, 3.6, 20.0, 0.0]), road, 3.0)
    assert (got.lanes, got.lat.tolist()) == ([0, 2], [3.6, 7.2])
    assert target_lanes(np.array([450.0, 7.2, 20.0, 0.0]), road, 3.0).lanes == [2, 0]
    assert target_lanes(np.array([100.0, 1.8, 20.0, 0.0]), road, 3.0).lanes == [0, 1]
    assert target_lanes(np.array([290.0, 1.8, 20.0, 0.0]), road, 3.0).lanes == [0]  # the next one ends


def test_it_leaves_a_lane_in_the_middle_before_it_ends() -> None:
    states, plans = drive(np.array([50.0, 5.4, 25.0, 0.0]), middle_ends(), 130)
    assert {plan.status for plan in plans} == {Status.SOLVED}
    assert abs(np.interp(290.0, states[:, 0], states[:, 1]) - 5.4) > 2.0
    assert states[:, 2].min() > 24


@pytest.mark.parametrize(("lon", "lane"), [(20.0, 5.4), (250.0, 9.0)])
def test_nobody_changes_lanes_for_one_beyond_that_ends(straight_paths, lon: float, lane: float) -> None:
    """Lanes 1 and 2 are as slow as each other; lane 0 is free, but ends 400 m from the origin."""
    planner = MpcPlanner()
    planner.reset(0.1)
    paths = straight_paths((lon + 40.0, 9.0, 22.0), (lon + 40.0, 5.4, 22.0))
    plan = planner.plan(np.array([lon, 9.0, 24.0, 0.0]), paths, with_end())
    assert plan.states[-1, 1] == pytest.approx(lane, abs=0.6)


def test_lanes_that_shift_are_aimed_at_where_they_will_be() -> None:
    lat = np.tile(EDGES, (4, 1))
    lat[2:] += 2.0
    road = Road(EDGES, LENGTH, changing=LaneEdges(np.array([0.0, 200.0, 240.0, LENGTH]), lat))
    got = target_lanes(np.array([200.0, 5.4, 20.0, 0.0]), road, 3.0)
    assert got.lat == pytest.approx([6.9, 3.3, 10.5])


def test_the_general_solver_is_for_straight_roads() -> None:
    planner = ReferencePlanner()
    with pytest.raises(SettingError, match="straight roads"):
        planner.plan(np.array([50.0, 1.8, 20.0, 0.0]), NOBODY, bend(np.full(301, 1 / 300)))


def test_a_drive_around_half_a_circle_ends_where_it_leads() -> None:
    """What is driven in the road frame is on the lane's centre in the map."""
    road = bend(np.full(301, 1 / 200))
    states, _ = drive(np.array([50.0, 5.4, 20.0, 0.0]), road, 150)
    centre, heading = in_map(states, road)
    line = road.line
    assert line is not None
    left = np.array([-np.sin(0.4), np.cos(0.4)]) * 200
    assert np.hypot(*(centre - left).T) == pytest.approx(np.full(len(centre), 200.0), abs=0.05)
    assert PROBLEM.cost.curve_share * CAR.max_lateral_acceleration * 200 > states[-1, 2] ** 2 > 300
    assert np.unwrap(heading)[-1] > 1.5


def test_at_an_edge_that_comes_inwards_it_turns_away_instead_of_stopping() -> None:
    """5 mm from it, any way away first moves the rear corner out; the road narrows by 1 %."""
    lat = np.tile(EDGES, (2, 1))
    lat[1, 0] = 3.0
    road = Road(EDGES, LENGTH, changing=LaneEdges(np.array([0.0, 300.0]), lat))
    start = np.array([50.0, road.edges_at(np.array([50.0]))[0, 0] + CAR.width / 2 + 0.005, 10.0, 0.0])
    states, plans = drive(start, road, 30)
    assert plans[0].status is Status.UNSAFE and plans[-1].status is Status.SOLVED
    assert states[:, 2].min() > 8.0 and states[-1, 2] > 12.0
    assert beyond(states, road) < 0.05
