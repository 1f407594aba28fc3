"""What a goal asks for on the way: speeds, lanes and places across the road."""

from dataclasses import replace

import numpy as np
import pytest

from coverdrive.driving.goal import Curves, Goal
from coverdrive.road import Road

ROAD = Road.straight(length=200.0)
FREE = np.full(101, 1e3)
"""[m/s] of a road without curves"""
RESPONSE = {False: 2.3, True: 1.1}
"""[s] of a planner, to whom a speed is urgent or not"""


def state(lon: float, lat: float, speed: float) -> np.ndarray:
    return np.array([lon, lat, speed, 0.0])


def test_who_has_time_left_stays_on_the_map() -> None:
    goal = Goal(time=(8.0, 8.0))
    assert goal.wish(state(20.0, 1.8, 15.0), ROAD, 0.0, 15.0).speed == 15.0
    late = goal.wish(state(120.0, 1.8, 15.0), ROAD, 0.0, 15.0)
    assert late.urgent and late.speed is not None and (late.speed - 15.0) / RESPONSE[True] < -1.5
    assert goal.wish(state(150.0, 1.8, 15.0), ROAD, 7.0, 15.0).speed == 15.0


def test_the_end_of_the_map_is_not_reached_before_the_time() -> None:
    goal, at, dt = Goal(time=(10.0, 10.0)), state(60.0, 1.8, 20.0), 0.1
    for moment in range(100):
        wish = goal.wish(at, ROAD, moment * dt, 20.0)
        assert wish.speed is not None
        at[2] = max(0.0, at[2] + dt * np.clip((wish.speed - at[2]) / RESPONSE[wish.urgent], -8.0, 3.0))
        at[0] += dt * at[2]
    assert 180.0 < at[0] < 197.0


def test_a_speed_limit_holds_unless_the_goal_needs_more() -> None:
    limited = Road(ROAD.edges, 1000.0, speed_limit=12.0)
    assert Goal().wish(state(0.0, 1.8, 12.0), limited, 0.0, 20.0).speed == 12.0
    hurried = Goal(position=(300.0, 310.0), time=(0.0, 15.0)).wish(state(0.0, 1.8, 12.0), limited, 0.0, 20.0).speed
    assert hurried is not None and hurried > 13.5


@pytest.mark.parametrize(("low", "high", "lane", "to"), [(0.03, 0.2, 1, 1), (-0.2, -0.03, 3, -1)])
def test_a_heading_is_that_of_a_lane_change_which_begins_in_time(low: float, high: float, lane: int, to: int) -> None:
    road = Road.straight(lanes=5)
    place = float(road.centres[2]) - 1.2 * to
    goal = Goal(lanes=2, lat=place, position=(200.0, 202.0), heading=(low, high), time=(11.0, 12.0))
    early = goal.wish(state(0.0, float(road.centres[lane]), 17.0), road, 0.0, 17.0)
    assert (early.lanes, early.lat) == ((lane,), None)
    late = [goal.wish(state(at, place, 17.0), road, at / 17.0, 17.0) for at in (160.0, 180.0, 195.0)]
    assert {wish.lanes for wish in late} == {(2,)}
    places = to * np.array([wish.lat for wish in late])
    assert (np.diff(places) > 0.5).all() and places[-1] > to * place > places[0]


def test_a_heading_along_the_road_changes_nothing_nor_one_across_it() -> None:
    plain = Goal(lanes=1, position=(100.0, 105.0), time=(6.0, 7.0))
    turned = Goal(lanes=1, position=(100.0, 105.0), time=(6.0, 7.0), heading=(-0.1, 0.1))
    at = state(40.0, 1.8, 15.0)
    across = Goal(lanes=1, position=(100.0, 105.0), time=(6.0, 7.0), heading=(0.6, 0.9))
    assert turned.wish(at, ROAD, 3.0, 15.0) == plain.wish(at, ROAD, 3.0, 15.0) == across.wish(at, ROAD, 3.0, 15.0)


@pytest.mark.parametrize(
    ("goal", "urgent"),
    [
        (Goal(lanes=0, position=(110.0, 120.0), time=(6.0, 7.0)), False),
        (Goal(lanes=0, position=(140.0, 145.0), time=(6.0, 7.0)), True),
        (Goal(lanes=1, position=(110.0, 120.0), time=(6.0, 7.0)), True),
        (Goal(lanes=0, position=(50.0, 60.0), time=(2.0, 3.0)), True),
    ],
    ids=["on time", "late", "another lane", "soon"],
)
def test_it_is_urgent_where_comfort_would_come_too_late(goal: Goal, urgent: bool) -> None:
    assert goal.wish(state(20.0, 1.8, 15.0), ROAD, 0.0, 15.0).urgent is urgent


@pytest.mark.parametrize(
    ("lanes", "lat", "urgent"),
    [(1, 3.5, True), (1, 3.7, True), (1, 4.3, True), (1, 4.5, False), ((0, 1), 3.7, False), ((1, 2), 3.7, True)],
)
def test_a_lane_change_is_urgent_until_one_is_in_the_lane(
    lanes: int | tuple[int, ...], lat: float, urgent: bool
) -> None:
    goal = Goal(lanes=lanes, position=(110.0, 120.0), time=(6.0, 7.0))
    assert goal.wish(state(20.0, lat, 15.0), ROAD, 0.0, 15.0).urgent is urgent


def test_nothing_is_urgent_for_who_is_at_a_place_near_the_edge() -> None:
    goal = Goal(lanes=1, lat=4.1, position=(110.0, 120.0), time=(6.0, 7.0))
    assert not goal.wish(state(20.0, 3.9, 15.0), ROAD, 0.0, 15.0).urgent


def test_nobody_hurries_to_a_place_that_is_behind() -> None:
    wish = Goal(lanes=0, position=(50.0, 60.0), time=(2.0, 9.0)).wish(state(61.0, 1.8, 15.0), ROAD, 5.0, 15.0)
    assert (wish.speed, wish.urgent) == (15.0, False)


@pytest.mark.parametrize(("speed", "stops"), [((0.0, 0.3), True), ((2.0, 3.0), False), (None, False)])
def test_only_who_is_to_stand_plans_to_brake_on(speed: tuple[float, float] | None, stops: bool) -> None:
    goal = Goal(lanes=0, position=(48.0, 52.0), speed=speed, time=(6.0, 7.0))
    assert (goal.wish(state(20.0, 1.8, 9.0), ROAD, 0.0, 9.0).braking > 0.5) is stops


def driven(
    goal: Goal, at: np.ndarray, usual: float, road: Road = ROAD, curves: Curves = (2.0, FREE), known: bool = True
) -> tuple[float, float]:
    """Time [s] at which a car that does as it is told is in the goal, and how hard it brakes before [m/s²].

    In curves it is no faster than it may, whether or not the goal has known them.
    """
    assert goal.time is not None
    hardest, dt = 0.0, 0.1
    (low, high), (nearest, farthest) = goal.speed or (0.0, np.inf), goal.position or (0.0, road.length)
    for moment in range(round(goal.time[1] / dt) + 1):
        if low <= at[2] <= high and nearest <= at[0] <= farthest and moment * dt >= goal.time[0]:
            return moment * dt, hardest
        wish = goal.wish(at, road, moment * dt, usual, curves if known else None)
        assert wish.speed is not None
        speed = min(wish.speed, float(np.interp(at[0], curves[0] * np.arange(len(curves[1])), curves[1])))
        change = float(np.clip((speed - at[2]) / RESPONSE[wish.urgent], -8.0, 3.0))
        at[0] += dt * at[2]
        at[2], hardest = max(0.0, at[2] + dt * change), min(hardest, change * (at[2] > 0.5))
    raise AssertionError(f"never in {goal}, but at {at}")


@pytest.mark.parametrize("time", [(18.5, 19.5), (20.0, 21.0)])
def test_who_knows_a_curve_ahead_hurries_before_it(time: tuple[float, float]) -> None:
    """Of 250 m, the last 100 are driven at 10 m/s; before them the speed falls by 1.5 m/s²."""
    places = 2.0 * np.arange(200)
    before = np.sqrt(100 + 3 * np.maximum(150 - places, 0))
    curves = 2.0, np.where(places < 150, before, np.where(places < 260, 10.0, 1e3))
    goal, road = Goal(position=(250.0, 256.0), time=time), Road.straight(length=400.0)
    arrival, hardest = driven(goal, state(0.0, 1.8, 14.0), 14.0, road, curves)
    assert time[0] <= arrival <= time[1] and hardest > -2.0
    with pytest.raises(AssertionError, match="never in"):
        driven(goal, state(0.0, 1.8, 14.0), 14.0, road, curves, known=False)


def test_curves_that_slow_nobody_down_change_nothing() -> None:
    goal, at = Goal(position=(150.0, 156.0), time=(8.0, 9.0)), state(0.0, 1.8, 14.0)
    assert goal.wish(at, ROAD, 0.0, 14.0) == goal.wish(at, ROAD, 0.0, 14.0, (2.0, FREE))


@pytest.mark.parametrize("time", [(4.0, 6.0), (11.0, 13.0), (40.0, 41.0)])
def test_who_is_to_stop_stands_in_the_place_before_it_is_too_late(time: tuple[float, float]) -> None:
    goal = Goal(lanes=0, position=(48.0, 52.0), speed=(0.0, 0.3), time=time)
    assert driven(goal, state(20.0, 1.8, 9.0), 9.0)[1] > -3.0


@pytest.mark.parametrize("soonest", [20.0, 40.0, 300.0])
@pytest.mark.parametrize(
    "goal", [Goal(), Goal(position=(77.0, 83.0)), Goal(position=(150.0, 156.0), speed=(8.0, 12.0))]
)
def test_who_is_long_before_the_time_waits(goal: Goal, soonest: float) -> None:
    late = replace(goal, time=(soonest, soonest + 1))
    arrival, hardest = driven(late, state(20.0, 1.8, 14.0), 14.0)
    assert arrival >= soonest and hardest > -4.0


@pytest.mark.parametrize("latest", [10.0, 60.0, 600.0])
def test_nobody_waits_where_any_time_will_do(latest: float) -> None:
    arrival, hardest = driven(Goal(position=(150.0, 156.0), time=(0.0, latest)), state(20.0, 1.8, 14.0), 14.0)
    assert 8.0 < arrival < 11.0 and hardest > -2.0


@pytest.mark.parametrize(
    ("goal", "speed", "holds"),
    [
        (Goal(speed=(0.0, 0.0), time=(8.0, 9.0)), 0.1, True),
        (Goal(lanes=0, position=(40.0, 60.0), speed=(0.0, 0.3), time=(8.0, 9.0)), 0.1, True),
        (Goal(speed=(0.0, 0.0), time=(8.0, 9.0)), 0.2, False),
        (Goal(speed=(0.0, 0.9)), 0.1, False),
        (Goal(speed=(0.5, 0.5), time=(8.0, 9.0)), 0.1, False),
        (Goal(lanes=1, position=(40.0, 60.0), speed=(0.0, 0.3), time=(8.0, 9.0)), 0.1, False),
        (Goal(lanes=0, position=(55.0, 60.0), speed=(0.0, 0.3), time=(8.0, 9.0)), 0.1, False),
        (Goal(lanes=0, position=(40.0, 45.0), speed=(0.0, 0.3), time=(8.0, 9.0)), 0.1, False),
    ],
)
def test_it_holds_where_the_goal_is_met_by_standing(goal: Goal, speed: float, holds: bool) -> None:
    assert goal.firmly(state(50.0, 1.8, speed), ROAD, 0.5) == (pytest.approx(speed / 0.5) if holds else 0.0)
