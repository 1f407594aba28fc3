"""The driver in worlds that are not ours: frames, commands, goals and what it says to those who ask wrongly."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from driving_fakes import CAR, PREDICTOR, ROAD, begin, line, moved, straight_ahead, told
from simulation_fakes import ConstantPlanner

from coverdrive.driving.driver import Driver
from coverdrive.driving.goal import Goal
from coverdrive.errors import DataError, SettingError
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.problem.vehicle import VehicleSettings, step
from coverdrive.planning.rules.wish import NO_WISH
from coverdrive.prediction.stored import checked_scale
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import Road
from shape_checks import unchecked

OTHERS = {"ahead": ((60.0, 1.8, 15.0, 0.0), CAR), 7: ((-30.0, 5.4, 22.0, 0.0), CAR)}
OWN = (0.0, 1.8, 20.0, 0.0)
NOBODY = PredictedPaths(np.empty((0, 13, 2)), np.empty(0, dtype=int), np.empty((0, 13, 2)), 0.25)


def test_a_drive_can_be_repeated_and_reset_forgets() -> None:
    start, _ = begin(3)
    driver = Driver(PREDICTOR)
    firsts, seconds = [], []
    for commands in (firsts, seconds):
        driver.reset()
        (_, traffic), scene = begin(3), start.scene
        for _ in range(8):
            commands.append(driver.step(*told(scene), start.road))
            scene = moved(scene, traffic, commands[-1])
    assert [(each.acceleration, each.yaw_rate) for each in firsts] == [
        (each.acceleration, each.yaw_rate) for each in seconds
    ]
    assert any(each.acceleration != firsts[0].acceleration for each in firsts)


@pytest.mark.parametrize("heading", [0.7, 3.1, -2.0])
def test_where_the_map_has_its_axes_makes_no_difference(heading: float) -> None:
    turned = replace(ROAD, line=line(heading))

    def in_map(state):
        x, y = turned.to_map(state[0], state[1])
        return float(x), float(y), state[2], state[3] + heading + 4 * np.pi

    plain, there = Driver(PREDICTOR), Driver(PREDICTOR)
    own = np.array([0.0, 2.3, 20.0, 0.02])
    expected = plain.step(own, OTHERS, ROAD)
    command = there.step(in_map(own), {name: (in_map(state), size) for name, (state, size) in OTHERS.items()}, turned)
    assert command.scene.states == pytest.approx(expected.scene.states, abs=1e-8)
    assert (command.acceleration, command.yaw_rate) == pytest.approx(
        (expected.acceleration, expected.yaw_rate), abs=1e-6
    )


@pytest.mark.parametrize("curvature", [0.0, 1 / 1000, 1 / 150, -1 / 150])
def test_a_car_that_steers_as_told_follows_the_bend_of_the_road(curvature: float) -> None:
    """The car is a kinematic single-track model in map coordinates."""
    road, driver = replace(ROAD, line=line(0.3, curvature)), Driver(PREDICTOR, wanted_speed=20.0)
    x, y = (float(each) for each in road.to_map(0.0, 5.4))
    speed, heading, wheelbase = 20.0, 0.3, VehicleSettings().wheelbase
    for _ in range(80):
        command = driver.step((x, y, speed, heading), {}, road)
        for _ in range(10):
            x, y = x + 0.01 * speed * np.cos(heading), y + 0.01 * speed * np.sin(heading)
            heading += 0.01 * speed * np.tan(command.steering) / wheelbase
            speed += 0.01 * command.acceleration
    lon, lat = road.to_road(x, y)
    assert (138 if abs(curvature) > 1 / 500 else 150) < lon < 162  # tight curves are driven at 17 m/s
    assert lat == pytest.approx(5.4, abs=0.15)


def test_the_wheels_are_straight_where_the_car_stands() -> None:
    command = Driver(PREDICTOR).step((0.0, 1.8, 0.0, 0.0), {"wall": ((6.0, 1.8, 0.0, 0.0), (4.8, 10.0))}, ROAD)
    assert command.acceleration <= 0
    assert command.steering == 0


def test_what_is_said_of_the_car_reaches_the_planner_and_leaves_the_given_one() -> None:
    given = MpcPlanner()
    driver = Driver(PREDICTOR, given, length=12.0, width=2.5, wanted_speed=22.0, budget=0.05)
    settings = driver.planner.settings
    assert (settings.problem.vehicle.length, settings.problem.vehicle.width) == (12.0, 2.5)
    assert (settings.problem.cost.reference_speed, settings.budget) == (22.0, 0.05)
    assert given.settings == PlannerSettings()
    command = driver.step(OWN, OTHERS, ROAD)
    assert (command.scene.length[0], command.scene.width[0]) == (12.0, 2.5)
    assert Driver(PREDICTOR).planner.settings.budget is None


@pytest.mark.parametrize("measured", [False, True])
@pytest.mark.parametrize("curvature", [0.0, 1 / 300])
def test_another_road_is_driven_from_its_first_moment_on(curvature: float, measured: bool) -> None:
    """Its origin is elsewhere, and it has a lane less on the right; whoever is there is seen as before."""
    edges = 3.6 * np.arange(4)
    lines = [
        ReferenceLine(np.array([x, 5.4]), 0.0, np.full(701, bend), 700.0) for x, bend in ((0.0, 0.0), (70.0, curvature))
    ]
    roads = Road(edges - 5.4, 700.0, lines[0]), Road(edges[1:] - 5.4, 700.0, lines[1])
    driver, own = Driver(PREDICTOR, wanted_speed=20.0), np.array([20.0, 5.4, 20.0, 0.0])
    for k in range(28):
        there = (own[0] + 40.0, 5.4) if measured else (own[0] + 40.0, 5.4, 20.0, 0.0)
        command = driver.step(own, {"ahead": (there, CAR)}, roads[k >= 25])
        own[0] += 2.0
        if k >= 25:
            assert command.plan.status is Status.SOLVED
            assert command.yaw_rate == pytest.approx(20.0 * curvature, abs=0.06)
            assert command.scene.speed[1] == pytest.approx(20.0, rel=0.05)


@pytest.mark.parametrize(
    "road",
    [Road(np.array([7.2, 3.6, 0.0]), 100.0), Road(np.array([0.0, np.nan]), 100.0), Road(np.zeros(1), 100.0),
     Road(np.array([0.0, 3.6]), np.nan), *(Road(np.array([0.0, 3.6]), 100.0, speed_limit=v) for v in (-5.0, np.nan))],
    ids=["from the left", "nowhere", "no lane", "no length", "backwards", "no limit"],
)  # fmt: skip
def test_roads_that_nobody_can_drive_on_are_refused(road: Road) -> None:
    with pytest.raises(DataError, match=r"the (road has lane edges|road is nan m long|speed limit is).*expected"):
        Driver(PREDICTOR).step(OWN, OTHERS, road)
    if road.speed_limit is None:  # which planners do not ask for
        with pytest.raises(DataError, match=r"the (road has lane edges|road is nan m long).*expected"):
            MpcPlanner().plan(np.array(OWN), NOBODY, road)


@pytest.mark.parametrize("wrong", [{"length": "100"}, {"speed_limit": "30"}, {"side": "middle"}])
def test_roads_of_words_are_refused(wrong: dict[str, Any]) -> None:
    with unchecked(), pytest.raises(DataError, match=f"{next(iter(wrong.values()))}.*expected"):
        Driver(PREDICTOR).step(OWN, OTHERS, Road(**{"edges": np.array([0.0, 3.6]), "length": 100.0} | wrong))


@pytest.mark.parametrize("own", [(10**400, 1.8, 20, 0), np.array([0, 1.8, 20, 1j])])
def test_numbers_that_no_car_has_are_refused(own: Any) -> None:
    with unchecked(), pytest.raises(DataError, match=r"the ego: got .*expected finite numbers"):
        Driver(PREDICTOR).step(own, OTHERS, ROAD)


def test_a_goal_may_be_given_by_arrays() -> None:
    goals = (Goal(position=position, time=(10.0, 12.0)) for position in ((300.0, 340.0), np.array([300.0, 340.0])))
    with unchecked():
        one, other = (Driver(PREDICTOR).step(OWN, OTHERS, ROAD, goal) for goal in goals)
    assert (one.acceleration, one.yaw_rate) == (other.acceleration, other.yaw_rate)


def test_any_planner_drives() -> None:
    planner = ConstantPlanner(acceleration=-1.0, yaw_rate=0.1)
    command = Driver(PREDICTOR, planner).step(OWN, OTHERS, ROAD)
    assert (command.acceleration, command.yaw_rate, planner.resets) == (-1.0, 0.1, 1)
    assert np.tan(command.steering) == pytest.approx(VehicleSettings().wheelbase * 0.1 / 19.95)
    with pytest.raises(SettingError, match="wanted_speed can be said of our planner only"):
        Driver(PREDICTOR, planner, wanted_speed=20.0)
    with pytest.raises(SettingError, match="only our planner takes a goal"):
        Driver(PREDICTOR, planner).step(OWN, OTHERS, ROAD, Goal(lanes=1))


class Braking(MpcPlanner):
    """A planner of one's own with the settings of ours."""

    def plan(self, state, paths, road, wish=NO_WISH):
        return replace(super().plan(state, paths, road, wish), inputs=np.full((self.steps, 2), [-2.0, 0.0]))


def test_a_planner_that_is_like_ours_is_not_taken_for_ours() -> None:
    given = Braking()
    driver = Driver(PREDICTOR, given)
    assert driver.planner is given
    assert driver.step(OWN, OTHERS, ROAD, Goal(lanes=1)).acceleration == -2.0
    with pytest.raises(SettingError, match="length can be said of our planner only"):
        Driver(PREDICTOR, given, length=6.0)


def driven(goal: Goal | None, moments: int, own=OWN, **cars) -> tuple[np.ndarray, float]:
    """Where the ego is after some steps (lon, lat, speed, heading), and its mean speed."""
    driver, state, speeds = Driver(PREDICTOR, wanted_speed=25.0), np.array(own), []
    for others in straight_ahead(moments, **cars):
        command = driver.step(state, others, ROAD, goal)
        state = step(state, np.array([command.acceleration, command.yaw_rate]), 0.1)
        speeds.append(state[2])
    return state, float(np.mean(speeds))


@pytest.mark.parametrize("lanes", [2, (1, 2)])
def test_goal_lanes_are_reached_and_kept_although_they_are_slower(lanes: int | tuple[int, ...]) -> None:
    slow = {"slow": (60.0, 9.0, 17.0), "slower": (75.0, 5.4, 17.0)}
    wanted = min(lanes) if isinstance(lanes, tuple) else lanes
    assert driven(Goal(lanes=lanes), 90, **slow)[0][1] == pytest.approx(ROAD.centres[wanted], abs=0.3)


def test_without_a_goal_the_faster_lane_is_taken() -> None:
    slow = {"slow": (60.0, 9.0, 17.0), "slower": (75.0, 5.4, 17.0)}
    assert driven(None, 90, **slow)[0][1] == pytest.approx(1.8, abs=0.3)


def test_no_goal_is_worth_a_contact() -> None:
    beside = {"beside": (0.0, 5.4, 20.0)}
    blocked = driven(Goal(lanes=1, speed=(20.0, 20.0)), 20, **beside)[0]
    assert blocked[1] < 5.4 - 1.9


def test_wanted_speeds() -> None:
    usual = driven(None, 100)[0]
    assert usual[2] == pytest.approx(25, abs=0.3)
    assert driven(Goal(speed=(14.0, 16.0)), 100)[0][2] == pytest.approx(16, abs=0.3)
    late = Goal(position=(150.0, 160.0), time=(10.0, 11.0))
    assert 150 <= driven(late, 100)[0][0] <= 160
    soon = Goal(position=(290.0, np.inf), time=(0.0, 10.0))
    assert driven(Goal(position=(900.0, np.inf), time=(0.0, 10.5)), 100)[0][2] > 40  # as fast as the car can be
    assert driven(soon, 100)[0][0] >= 288 > usual[0] + 30


def test_goals_that_nobody_can_reach_are_refused() -> None:
    with pytest.raises(SettingError, match=r"names the lanes \(3,\); expected some of 0 to 2"):
        Driver(PREDICTOR).step(OWN, OTHERS, ROAD, Goal(lanes=3))
    with pytest.raises(SettingError, match="the speed of a goal is"):
        Goal(speed=(20.0, 10.0))


@pytest.mark.parametrize(
    ("own", "others", "message"),
    [
        ((0.0, 1.8, 20.0), {}, r"the ego: got \(0.0, 1.8, 20.0\); expected finite numbers: x \[m\]"),
        ((0.0, 1.8, np.nan, 0.0), {}, "the ego: got"),
        ((0.0, 1.8, 300.0, 0.0), {}, "the ego drives at 300 m/s; expected at most 150"),
        (OWN, {"a": ((9.0, 1.8, np.inf, 0.0), CAR)}, "vehicle 'a': got .* leave a vehicle out while it is not known"),
        (OWN, {"a": ((9.0, 1.8, 2.0), CAR)}, "vehicle 'a': got"),
        (OWN, {5: ((9.0, 1.8, 20.0, 0.0), (0.0, 1.9))}, "vehicle 5 is 0 m long and 1.9 m wide"),
        (OWN, {5: ((9.0, 1.8, 20.0, 0.0), (4.8,))}, r"vehicle 5: got \(4.8,\); expected finite numbers: length"),
        (OWN, {"me": (OWN, CAR)}, r"vehicle 'me' is at \(0, 1.8\) m, where the ego is; leave the ego out"),
    ],
)
def test_bad_input_is_named(own, others, message: str) -> None:
    with pytest.raises(DataError, match=message):
        Driver(PREDICTOR).step(own, others, ROAD)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"speed": 20.0}, "the speed of a goal is 20.0; expected its least and its largest value"),
        ({"time": (np.nan, 3.0)}, "the time of a goal is"),
        ({"time": (np.inf, np.inf)}, "the time of a goal is"),
        ({"lanes": 1.5}, "the lanes of a goal: expected a whole number"),
        ({"lanes": (0, -1)}, "the lanes of a goal: expected a whole number"),
        ({"lat": np.nan}, "the lat of a goal: expected a number"),
    ],
)
def test_goals_that_are_none_are_refused(wrong: dict, message: str) -> None:
    with unchecked(), pytest.raises(SettingError, match=message):
        Goal(**wrong)


def test_lanes_may_be_numbers_of_numpy() -> None:
    with unchecked():
        for lanes, expected in ((np.int64(1), (1,)), (np.array([1]), (1,)), (np.array([0, 1]), (0, 1)), ((), ())):
            assert Goal(lanes=lanes).any_lane == expected  # pyright: ignore[reportArgumentType]


def test_a_place_may_be_reached_at_any_time_from_some_on() -> None:
    """Somebody is 300 m away, at 20 m/s: who has to be there after 30 s at the earliest slows down."""
    state = np.array([0.0, 5.4, 20.0, 0.0])
    goal = Goal(position=(300.0, 320.0), time=(30.0, np.inf))
    speed = goal.wish(state, ROAD, 0.0, 20.0).speed
    assert speed is not None and speed < 20.0


def test_bad_settings_are_refused() -> None:
    with unchecked(), pytest.raises(SettingError, match="smoothing: expected SmoothingSettings, got 'x'"):
        Driver(PREDICTOR, smoothing="x")  # pyright: ignore[reportArgumentType]
    with unchecked(), pytest.raises(SettingError, match=r"scaled by a number between 0, .* got '1'"):
        checked_scale("1")  # pyright: ignore[reportArgumentType]
    for lanes, width in ((1.5, 3.6), (3, np.nan), (3, -1.0)):
        with unchecked(), pytest.raises(SettingError, match=r"lanes: expected a whole|width"):
            Road.straight(lanes, width)  # pyright: ignore[reportArgumentType]
    with pytest.raises(SettingError, match=r"length: .*greater than or equal to 1, got 0.0"):
        Driver(PREDICTOR, length=0.0)
    for period in (0, 1e-6, 2.0):
        with pytest.raises(SettingError, match=rf"the period between two steps is {period} s"):
            Driver(PREDICTOR, period=period)
        with pytest.raises(SettingError, match=rf"the period between two steps is {period} s"):
            MpcPlanner().reset(period)
    for options, words in (({"road": None}, "road: expected a Road"), ({"goal": "x"}, "goal: expected a Goal")):
        with unchecked(), pytest.raises(SettingError, match=words):
            Driver(PREDICTOR).step((10.0, 1.8, 20.0, 0.0), {}, **{"road": ROAD} | options)
    with unchecked(), pytest.raises(DataError, match=r"the state has the shape \(3,\)"):
        MpcPlanner().plan(np.zeros(3), PredictedPaths(np.zeros((0, 13, 2)), np.zeros(0, int), None, 0.25), ROAD)


@pytest.mark.parametrize(("period", "acceleration"), [(0.1, 1.0), (0.25, 1.0), (0.5, 2.0), (0.625, 2.4)])
def test_of_a_plan_is_applied_what_it_says_until_the_next_one(period: float, acceleration: float) -> None:
    inputs = np.stack([[1.0, 3.0, 4.0, 0.0], np.zeros(4)], axis=-1)
    plan = Plan(np.zeros((5, 4)), inputs, np.zeros(4), Status.SOLVED, 0.0, 0.0, 0.25)
    assert plan.applied(period) == pytest.approx([acceleration, 0.0])
