"""Vehicles ahead that may brake hard: one more member for the nearest of every lane, as far as it can be heeded."""

from dataclasses import replace

import numpy as np
import pytest

from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning import planner as planning
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.rules.leaders import LeaderSettings, braking, leaders_of
from coverdrive.planning.solver.search import NOTHING
from coverdrive.road import Road

STATE = np.array([0.0, 5.4, 30.0, 0.0])
TIMES = 0.25 * np.arange(13)
EVERY = np.array([True, True, True])


def test_the_nearest_ahead_in_every_lane_brakes_to_a_stop(straight_paths) -> None:
    paths = straight_paths((20, 5.4, 6), (60, 5.8, 20), (15, 1.8, 30), (-10, 9.0, 20), (-20, 5.4, 20))
    paths.half_sizes[:, 1:] += 1.0
    paths = replace(paths, weight=np.array([0.7, 1.0, 1.0, 1.0, 0.5]))
    leaders = leaders_of(STATE, 2.4, paths, Road.straight())
    got = braking(leaders, paths, LeaderSettings(deceleration=4.0))
    assert got.vehicle.tolist() == [2, 0]
    standing = np.minimum(TIMES, 6 / 4)
    np.testing.assert_allclose(got.points[1, :, 0], 20 + 6 * standing - 2 * standing**2)
    np.testing.assert_allclose(got.points[0, :, 0], 15 + 30 * TIMES - 2 * TIMES**2)
    np.testing.assert_array_equal(got.half_sizes[1], np.tile([2.4, 0.95], (13, 1)))
    assert got.weight is not None and got.weight.max() < 0.5


def test_who_comes_ahead_from_beside_brakes_on_the_way(straight_paths) -> None:
    """Of two who change to the ego's lane ahead of it the nearer one, by its last path; nobody who does so behind, nor
    who only might, and has not begun.
    """
    paths = straight_paths((60, 1.8, 20), (20, 1.8, 20), (20, 1.8, 20), (-10, 9.0, 20), (30, 9.0, 20), (30, 9.0, 20))
    paths = replace(paths, vehicle=np.array([0, 1, 1, 2, 3, 3]))
    paths.points[:4, :, 1] += np.linspace(0, [3.6, 3.0, 3.6, -3.6], 13).T
    paths.points[5, :, 1] -= np.linspace(0, np.sqrt(3.6), 13) ** 2
    paths.half_sizes[2, 1:, 1] += 0.3
    leaders = leaders_of(STATE, 2.4, paths, Road.straight())
    assert leaders.lane.tolist() == [0, 2] and leaders.entering.tolist() == [2]
    got = braking(leaders, paths, LeaderSettings(deceleration=4.0))
    assert got.vehicle.tolist() == [1, 3, 1]
    np.testing.assert_allclose(got.points[2, :, 0], 20 + 20 * TIMES - 2 * TIMES**2)
    np.testing.assert_array_equal(got.points[2, :, 1], paths.points[2, :, 1])
    np.testing.assert_array_equal(got.half_sizes[2, :, 1], paths.half_sizes[2, :, 1])
    assert np.ptp(got.points[:2, :, 1]) > 0 == np.ptp(got.points[0, :, 1])


def test_nobody_brakes_where_nobody_is_ahead_or_nothing_is_assumed(straight_paths) -> None:
    behind, ahead = straight_paths((-10, 5.4, 20)), straight_paths((30, 5.4, 20))
    for paths, deceleration in ((behind, 4.0), (straight_paths(), 4.0), (ahead, 0.0)):
        leaders = leaders_of(STATE, 2.4, paths, Road.straight())
        assert len(braking(leaders, paths, LeaderSettings(deceleration=deceleration))) == 0


def speed_ahead(paths: PredictedPaths) -> float:
    """[m/s] in the lane of the ego."""
    leaders = leaders_of(STATE, 2.4, paths, Road.straight())
    return float(leaders.speed[leaders.lane == 1].min(initial=np.inf))


def test_the_speed_ahead_is_that_of_the_nearest_in_the_own_lane(straight_paths) -> None:
    paths = straight_paths((60, 5.4, 11), (30, 5.8, 22), (10, 1.8, 5), (-10, 5.4, 7))
    assert speed_ahead(paths) == pytest.approx(22)
    assert speed_ahead(paths.of(np.array([2, 3]))) == np.inf
    assert speed_ahead(straight_paths((20, 5.4, -1))) == 0


def test_what_is_lost_in_a_lane_is_the_time_behind_the_one_ahead(straight_paths) -> None:
    """At 40 m/s the one at 30 m/s, 60 m ahead, is reached after 6 s, and the one at 20 m/s, 20 m ahead, after 1 s."""
    paths = straight_paths((64.8, 1.8, 30), (24.8, 5.4, 20), (80, 5.4, 0))  # cars of 4.8 m
    leaders = leaders_of(STATE, 2.4, paths, Road.straight())
    np.testing.assert_allclose(leaders.lost(~EVERY, 40.0, 3.0, 8.0), [10**2 * 2, 20**2 * 5, 0])
    np.testing.assert_allclose(leaders.lost(~EVERY, 40.0, 3.0, 5.0), [0, 20**2 * 2, 0])
    assert leaders.lost(EVERY, 20.0, 3.0, 8.0).max() < 0.1


def test_who_can_move_on_from_a_lane_loses_no_more_than_until_then(straight_paths) -> None:
    """At 40 m/s the one at 20 m/s in lane 1 is reached after 1 s, and left for another lane 2 s after the plan.

    Nobody moves on to a lane that ends.
    """
    leaders = leaders_of(STATE, 2.4, straight_paths((24.8, 1.8, 25), (24.8, 5.4, 20), (34.8, 9.0, 30)), Road.straight())
    left, middle, right = 15**2, 20**2, 10**2
    for there, lost in (
        (EVERY, [5 * left, 2 * middle + 3 * right, 5 * right]),
        (np.array([True, True, False]), [5 * left, 2 * middle + 3 * left, 5 * right]),
        (np.array([False, True, False]), [5 * left, 5 * middle, 5 * right]),
    ):
        np.testing.assert_allclose(leaders.lost(there, 40.0, 3.0, 8.0), lost)


@pytest.mark.parametrize(("foresight", "lane"), [(0.0, 1.8), (3.0, 5.4)])
def test_who_foresees_to_be_held_up_changes_lanes_in_time(straight_paths, foresight: float, lane: float) -> None:
    planner = MpcPlanner(PlannerSettings(leaders=LeaderSettings(foresight=foresight)))
    paths = straight_paths((50.0, 1.8, 28.0), (20.0, 9.0, 30.0))
    plan = planner.plan(np.array([0.0, 1.8, 30.0, 0.0]), paths, Road.straight())
    assert plan.states[-1, 1] == pytest.approx(lane, abs=0.6)


@pytest.mark.parametrize(("free", "lane"), [(True, 5.4), (False, 1.8)])
def test_a_lane_is_worth_what_is_beyond_it(straight_paths, free: bool, lane: float) -> None:
    """Lanes 0 and 1 are as slow as each other; whoever moves to lane 1 gets on from there if lane 2 is free."""
    planner = MpcPlanner()
    planner.reset(0.1)
    slow = [(40.0, 1.8, 22.0), (40.0, 5.4, 22.0), (40.0, 9.0, 22.0)][: 2 if free else 3]
    plan = planner.plan(np.array([0.0, 1.8, 24.0, 0.0]), straight_paths(*slow), Road.straight())
    assert plan.states[-1, 1] == pytest.approx(lane, abs=0.6)


def planned(paths: PredictedPaths, road: Road, deceleration: float, **planner: float) -> Plan:
    settings = PlannerSettings(leaders=LeaderSettings(deceleration=deceleration), **planner)
    driver = MpcPlanner(settings)
    driver.reset(0.1)
    return driver.plan(np.array([0.0, 1.8, 30.0, 0.0]), paths, road)


def nearest_to_a_braking_leader(plan: Plan, lon: float, speed: float) -> float:
    """Least gap [m] of the fail-safe branch to a car that brakes at 4 m/s² from now on, where there is one lane."""
    return float((lon + speed * TIMES - 2 * TIMES**2 - plan.fail_safe[:, 0]).min()) - 4.8


@pytest.mark.parametrize(("deceleration", "heeded"), [(4.0, True), (0.0, False)])
def test_the_fail_safe_branch_keeps_clear_of_a_leader_that_brakes(straight_paths, deceleration, heeded) -> None:
    road = Road.straight(lanes=1)
    plan = planned(straight_paths((24.0, 1.8, 22.0)), road, deceleration)
    assert plan.status is Status.SOLVED
    assert (nearest_to_a_braking_leader(plan, 24.0, 22.0) >= 0) == heeded


@pytest.mark.parametrize("budget", [None, 1e-9])
def test_who_cannot_keep_clear_of_it_plans_for_the_sets_alone(straight_paths, budget) -> None:
    road, paths = Road.straight(lanes=1), straight_paths((11.5, 1.8, 22.0))
    plan = planned(paths, road, 4.0, budget=budget)
    assert plan.status in (Status.SOLVED, Status.FALLBACK)
    assert nearest_to_a_braking_leader(plan, 11.5, 22.0) < 0


def test_a_search_that_finds_nothing_clear_of_them_soon_ends(straight_paths, monkeypatch: pytest.MonkeyPatch) -> None:
    results, search = [], planning.search

    def searched(*args, **best):
        results.append(search(*args, **best))
        return results[-1]

    monkeypatch.setattr(planning, "search", searched)
    road, counts = Road.straight(lanes=1), []
    for ahead in (11.5, 24.0):
        assert planned(straight_paths((ahead, 1.8, 22.0)), road, 4.0).slack.max() == 0
        counts.append(results.count((NOTHING, True)))
        results.clear()
    assert counts == [2, 1]  # that of the reset is one of them
