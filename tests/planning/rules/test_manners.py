"""Manners: what is wished for is kept where it can be, and never instead of a clear plan."""

import numpy as np
import pytest

from coverdrive.distances import kept
from coverdrive.plan import Status
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.problem.obstacles import obstacles_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.vehicle import step
from coverdrive.planning.rules.manners import NONE, MannersSettings, widen, wished
from coverdrive.road import Road
from coverdrive.scene import Scene

ROAD, PROBLEM, STATE = Road.straight(), ProblemSettings(), np.array([0.0, 5.4, 20.0, 0.0])
EVERYWHERE = [(lon, lat, 20.0) for lat in (1.8, 9.0) for lon in range(-10, 60, 10)]


FEW = MannersSettings(headway=0.0, beside=0.0, time_to_collision=0.0)


def boxes_for(
    straight_paths, manners: MannersSettings, *cars: tuple[float, float, float], state: np.ndarray = STATE
) -> np.ndarray:
    likely, _ = obstacles_of(straight_paths(*cars), PROBLEM.obstacles)
    boxes = likely.compress(wished(likely, state, PROBLEM.vehicle.width, manners), axis=2)
    widen(boxes, 0, state, PROBLEM, manners)
    return boxes


def test_behind_who_stands_there_is_room_to_pull_out(straight_paths) -> None:
    cars = (30, 5.4, 0), (50, 5.4, 1), (30, 1.8, 0)  # one in the way, one that drives, one beside
    boxes = boxes_for(straight_paths, FEW, *cars, state=np.array([0, 5.4, 0, 0]))
    half = straight_paths(cars[0]).half_sizes[0, 0]
    np.testing.assert_allclose(boxes[2].T, half[0] + np.array([[3.0], [0.0], [0.0]]) + np.zeros(boxes.shape[1]))


def test_a_wished_box_reaches_as_far_as_the_headway(straight_paths) -> None:
    manners = MannersSettings(headway=1.5, beside=0.7, time_to_collision=3.0)
    boxes = boxes_for(straight_paths, manners, (50, 5.4, 20), (50, 1.8, 14))
    half = straight_paths((50, 5.4, 20)).half_sizes[0, 0]
    np.testing.assert_allclose(boxes[2, :, 0], half[0] + 1.5 * 20)
    assert boxes[2, 0, 1] == pytest.approx(half[0] + 1.5 * 14 + 3.0 * 6)  # 6 m/s faster now
    assert boxes[2, -1, 1] == pytest.approx(half[0] + 1.5 * 14)  # and 3 s later, slowed down, no more
    np.testing.assert_allclose(boxes[3], half[1] + 0.7)


def test_the_follower_in_the_own_lane_keeps_its_distance_itself(straight_paths) -> None:
    boxes = boxes_for(straight_paths, MannersSettings(), (-20, 5.4, 20), (-20, 1.8, 20))
    np.testing.assert_allclose(boxes[1], 1.8)


def test_the_paper_wishes_nothing(straight_paths) -> None:
    assert boxes_for(straight_paths, NONE, (50, 5.4, 20)).shape[2] == 0


@pytest.mark.parametrize(("speed", "headway"), [(0.0, 1.0), (2.0, 1.072), (25 / 3, 1.3), (50 / 3, 1.6), (40.0, 1.6)])
def test_the_regulation_has_a_headway_for_every_speed(straight_paths, speed: float, headway: float) -> None:
    """The table of 5.2.3.3: 1.3 s at 30 km/h, 1.6 s at 60 km/h."""
    manners = MannersSettings(like="regulation", time_to_collision=0.0)
    alone, wished = (boxes_for(straight_paths, each, (300, 5.4, speed))[2] for each in (FEW, manners))
    assert wished - alone == pytest.approx(headway * speed)


def followed(straight_paths, settings: PlannerSettings) -> float:
    """[s] headway at which the ego is behind a car, with others on both sides, after 9 s."""
    planner, state, cars = MpcPlanner(settings), STATE.copy(), np.array([(15.0, 5.4, 20.0), *EVERYWHERE])
    planner.reset(0.1)
    for _ in range(90):
        state = step(state, planner.plan(state, straight_paths(*cars), ROAD).inputs[0], 0.1)
        cars[:, 0] += 0.1 * cars[:, 2]
    states = np.array([state, [cars[0, 0], 5.4, 20.0, 0.0]]).T[:, None]
    return kept(Scene(*states, np.full((1, 2), 4.8), np.full((1, 2), 1.9), np.full((1, 2), True)), ROAD, np.array([0]))[
        0
    ]


def test_a_headway_is_kept_behind_somebody_and_more_where_more_is_wished(straight_paths) -> None:
    wished = {like: followed(straight_paths, PlannerSettings(manners=MannersSettings(like=like)))
              for like in ("paper", "human", "regulation")}  # fmt: skip
    assert wished["paper"] < 0.5 < 0.65 < wished["human"] < 1.2 < wished["regulation"]


def sideways(straight_paths, settings: PlannerSettings) -> float:
    """[m/s] across the road at the most, on the way past a car that is slower."""
    planner, state, most = MpcPlanner(settings), np.array([0.0, 5.4, 25.0, 0.0]), 0.0
    planner.reset(0.1)
    for moment in range(60):
        paths = straight_paths((60 + 1.5 * moment, 5.4, 15), (60 + 1.5 * moment, 1.8, 15))
        state = step(state, planner.plan(state, paths, ROAD).inputs[0], 0.1)
        most = max(most, abs(state[2] * np.sin(state[3])))
    assert state[1] > 8  # it has passed on the left
    return most


def test_no_headway_asks_for_more_than_calm_braking(straight_paths) -> None:
    """Somebody is as fast, 10 m ahead: the box begins where the ego comes to at 2 m/s², at last at the headway."""
    alone, eased = (boxes_for(straight_paths, each, (14.8, 5.4, 20)) for each in (FEW, MannersSettings(headway=0.7)))
    beside = boxes_for(straight_paths, MannersSettings(headway=0.7), (14.8, 1.8, 20))
    begins = eased[0] - PROBLEM.obstacles.inflation * (eased[2] + PROBLEM.vehicle.length / 2)
    time = 0.25 * np.arange(13)
    np.testing.assert_allclose(beside[2], alone[2] + 14)  # who is in no way of the ego's asks for all of it at once
    np.testing.assert_allclose(begins[:5, 0], (20 * time - time**2)[:5], atol=0.5)
    np.testing.assert_allclose(eased[2, -1], alone[2, -1] + 14)


@pytest.mark.parametrize("lon", [10, 14])
def test_a_headway_is_found_again_calmly(straight_paths, lon: float) -> None:
    """After somebody came in 5 or 9 m ahead, as fast as the ego: with 8 m/s² where all of it is asked for at once."""
    planner, state, slowed = MpcPlanner(), np.array([0.0, 1.8, 20.0, 0.0]), list[float]()
    planner.reset(0.1)
    for moment in range(60):
        inputs = planner.plan(state, straight_paths((lon + 2 * moment, 1.8, 20)), Road.straight(1)).inputs[0]
        slowed.append(float(inputs[0]))
        state = step(state, inputs, 0.1)
    assert min(slowed) > -4.5
    assert (lon + 120 - state[0] - 4.8) / state[2] > 0.9


@pytest.mark.parametrize("comes_in", [False, True])
def test_nobody_slower_is_braked_for_harder_than_needed(straight_paths, comes_in: bool) -> None:
    """Seen 50 m ahead and 10 m/s slower, in the lane or on the way into it: with 8 m/s² if all of it were asked for."""
    planner, state, slowed = MpcPlanner(), np.array([0.0, 5.4 if comes_in else 1.8, 30.0, 0.0]), list[float]()
    planner.reset(0.1)
    times, road = 0.1 * np.arange(90), Road.straight(2 if comes_in else 1)
    share = np.clip(times / 3.5, 0, 1)
    lat = 1.8 + 3.6 * share**2 * (3 - 2 * share) * comes_in
    for now in times:
        paths = straight_paths((50 + 20 * now, 1.8, 20))
        paths.points[0, :, 1] = np.interp(now + 0.25 * np.arange(13), times, lat)
        inputs = planner.plan(state, paths, road).inputs[0]
        slowed.append(float(inputs[0]))
        state = step(state, inputs, 0.1)
    assert -5.0 < min(slowed) < -1.0
    assert comes_in or (50 + 20 * times[-1] - state[0] - 4.8) / state[2] > 0.6  # or it passes where that one was


def test_lanes_are_changed_as_calmly_as_people_do(straight_paths) -> None:
    wished = [
        sideways(straight_paths, PlannerSettings(manners=MannersSettings(sideways=most))) for most in (1.0, 1.71, 10.0)
    ]
    assert wished[0] < 1.1 < 1.5 < wished[1] < 1.8 < wished[2]
    assert NONE.fastest_sideways == np.inf


def test_a_wish_takes_no_clear_plan_away(straight_paths) -> None:
    """Boxed in with half a headway to everybody."""
    paths = straight_paths((10, 5.4, 20), (-10, 5.4, 20), *EVERYWHERE)
    plan = MpcPlanner(PlannerSettings(manners=MannersSettings(headway=3.0, beside=2.0))).plan(STATE, paths, ROAD)
    assert plan.status is Status.SOLVED and plan.slack.max() == 0
