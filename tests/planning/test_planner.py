"""The planner in single calls and in closed loop."""

import _thread
import dataclasses
import itertools
import pickle
import sys
import threading

import numpy as np
import pytest
from planning_scenes import rollout, touches

import coverdrive.planning.planner as planning
import coverdrive.planning.surroundings as surroundings
from coverdrive.errors import SettingError
from coverdrive.geometry import boxes_overlap, turned_half_extents
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.problem.obstacles import ObstacleSettings, obstacles_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.tree import BranchSettings, held_on
from coverdrive.planning.problem.vehicle import VehicleSettings, step
from coverdrive.planning.rules.leaders import LeaderSettings
from coverdrive.planning.rules.manners import NONE
from coverdrive.planning.rules.wish import Wish
from coverdrive.planning.solver.search import BEGIN, CHOOSE, EVALUATE, GO_ON, IF_ARRIVED, NOT_YET, NOTHING, search
from coverdrive.reference_line import ReferenceLine
from coverdrive.reporting.drives.active_constraints import clearances
from coverdrive.road import Road

ROAD = Road.straight()
CAR = VehicleSettings()
PERIOD = 0.1


def drive(planner, state, cars, straight_paths, steps: int) -> tuple[np.ndarray, list[Plan], bool]:
    """States, plans, and whether the own car touched another; the cars (lon, lat, speed) keep speed and lane."""
    cars = np.array(cars, dtype=float).reshape(-1, 3)
    states, plans, contact = [np.array(state, dtype=float)], [], False
    planner.reset(PERIOD)
    for _ in range(steps):
        plans.append(planner.plan(states[-1], straight_paths(*cars), ROAD))
        states.append(step(states[-1], plans[-1].inputs[0], PERIOD))
        cars = cars + [PERIOD, 0.0, 0.0] * cars[:, [2, 2, 2]]
        own = (states[-1][:2], states[-1][3], CAR.half_sizes)
        contact |= bool(boxes_overlap(*own, cars[:, :2], np.zeros(len(cars)), CAR.half_sizes).any())
    return np.array(states), plans, contact


def test_empty_road_reaches_the_reference_speed_in_its_lane(straight_paths) -> None:
    states, plans, _ = drive(MpcPlanner(), [0, 1.8, 20, 0], [], straight_paths, 120)
    assert states[-1, 2] == pytest.approx(40.0, abs=1.0)
    np.testing.assert_allclose(states[:, 1], 1.8, atol=0.01)
    assert {plan.status for plan in plans} <= {Status.SOLVED, Status.FALLBACK}
    assert np.mean([plan.status is Status.SOLVED for plan in plans]) > 0.9
    assert max(plan.slack.max() for plan in plans) == 0


def test_a_slight_bend_makes_a_slight_difference(straight_paths) -> None:
    line = ReferenceLine(np.zeros(2), 0.0, np.full(1001, 1e-5), 1000.0)
    state, paths = np.array([0, 2.8, 20, 0.0]), straight_paths()
    plans = [MpcPlanner().plan(state, paths, road) for road in (ROAD, dataclasses.replace(ROAD, line=line))]
    np.testing.assert_allclose(plans[1].states, plans[0].states, atol=0.02)
    assert not np.array_equal(plans[1].states, plans[0].states)


def test_returns_to_the_centre_of_the_lane(straight_paths) -> None:
    states, _, _ = drive(MpcPlanner(), [0, 2.8, 20, 0.05], [], straight_paths, 60)
    assert states[-1, 1] == pytest.approx(1.8, abs=0.05)


def test_overtakes_a_slower_car(straight_paths) -> None:
    states, plans, contact = drive(MpcPlanner(), [0, 1.8, 20, 0], [(40, 1.8, 15)], straight_paths, 120)
    assert not contact
    assert states[-1, 0] > 40 + 15 * 12 + 10
    assert states[-1, 2] > 30
    assert {plan.status for plan in plans} <= {Status.SOLVED, Status.FALLBACK}


def test_mirrored_scene_gives_the_mirrored_plan(straight_paths) -> None:
    cars = [(25, 5.4, 16), (10, 9.0, 22)]
    mirrored = [(lon, 10.8 - lat, speed) for lon, lat, speed in cars]
    plan = MpcPlanner().plan(np.array([0, 5.6, 20, 0.02]), straight_paths(*cars), ROAD)
    other = MpcPlanner().plan(np.array([0, 10.8 - 5.6, 20, -0.02]), straight_paths(*mirrored), ROAD)
    np.testing.assert_allclose(other.states, plan.states * [1, -1, 1, -1] + [0, 10.8, 0, 0], atol=0.02)


def test_follows_where_both_sides_are_blocked(straight_paths) -> None:
    cars = [(25, 5.4, 14), (22, 1.8, 14), (28, 9.0, 14)]
    states, plans, contact = drive(MpcPlanner(), [0, 5.4, 20, 0], cars, straight_paths, 120)
    assert not contact
    assert 13 < states[-1, 2] < 14.2
    assert max(plan.slack.max() for plan in plans) < 0.05


def test_stops_before_a_wall(straight_paths) -> None:
    wall = [(80, 1.8, 0), (80, 5.4, 0), (80, 9.0, 0)]
    states, _, contact = drive(MpcPlanner(), [0, 5.4, 20, 0], wall, straight_paths, 120)
    assert not contact
    assert states[-1, 2] == pytest.approx(0, abs=0.4)
    assert states[-1, 0] < 80 - 4.8


def test_wall_too_near_to_stop_shows_in_the_slack(straight_paths) -> None:
    wall = straight_paths((18, 1.8, 0), (18, 5.4, 0), (18, 9.0, 0))
    plan = MpcPlanner().plan(np.array([0, 5.4, 20, 0.0]), wall, ROAD)
    assert plan.slack.max() > 0.1
    assert plan.inputs[0, 0] < -5


def test_hardly_avoidable_contact_is_braked_for(straight_paths) -> None:
    """It brakes for the wall, from the second plan on fully, instead of squeezing through between two of its cars."""
    wall = [(30, 1.8, 0), (30, 5.4, 0), (30, 9.0, 0)]
    states, plans, _ = drive(MpcPlanner(), [0, 5.4, 20, 0], wall, straight_paths, 15)
    assert max(plan.inputs[0, 0] for plan in plans[1:]) < -7
    assert states[-1, 2] < 20 - 7 * 1.4


def test_does_not_dither_between_equal_lanes(straight_paths) -> None:
    states, _, contact = drive(MpcPlanner(), [0, 5.4, 20, 0], [(35, 5.4, 14)], straight_paths, 80)
    assert not contact
    sideways = np.sign(np.round(np.diff(states[states[:, 0] < 35, 1]), 2))
    assert len(set(sideways[sideways != 0])) == 1


def test_far_cars_change_nothing(straight_paths) -> None:
    near = [(30, 1.8, 15), (20, 5.4, 18)]
    far = [(900, 1.8, 10), (-700, 5.4, 30), (400, 9.0, 20)]
    state = np.array([0, 1.8, 20, 0.0])
    alone = MpcPlanner().plan(state, straight_paths(*near), ROAD)
    together = MpcPlanner().plan(state, straight_paths(*far, *near), ROAD)
    np.testing.assert_allclose(together.states, alone.states, atol=1e-9)
    assert together.cost == pytest.approx(alone.cost)


def test_same_calls_give_the_same_plans(straight_paths) -> None:
    cars = [(25, 1.8, 15), (10, 5.4, 18)]
    planner = MpcPlanner()
    first, _, _ = drive(planner, [0, 1.8, 20, 0], cars, straight_paths, 10)
    second, _, _ = drive(planner, [0, 1.8, 20, 0], cars, straight_paths, 10)
    np.testing.assert_array_equal(first, second)


def test_rear_vehicle_can_be_ignored(straight_paths) -> None:
    problem = ProblemSettings(obstacles=ObstacleSettings(ignore_rear=True))
    state, paths = np.array([0, 1.8, 15, 0.0]), straight_paths((-9, 1.8, 25), (30, 1.8, 15))
    ignoring = MpcPlanner(PlannerSettings(problem=problem)).plan(state, paths, ROAD)
    without = MpcPlanner().plan(state, paths.of(np.array([False, True])), ROAD)
    considering = MpcPlanner().plan(state, paths, ROAD)
    np.testing.assert_allclose(ignoring.states, without.states, atol=1e-9)
    assert considering.cost > ignoring.cost + 1


def test_follower_that_may_accelerate_does_not_push_the_car_into_others(straight_paths) -> None:
    """Boxed in: walls of cars on both sides, one ahead, and one behind that may come too near or keep its distance."""
    sides = [(lon, 5.4, 20) for lon in range(-20, 100, 6)]
    ahead, behind = (10.0, 1.8, 20), (-8, 1.8, 20)
    paths = straight_paths(ahead, behind, (-8, 1.8, 24), *sides)
    vehicle = np.array([0, 1, 1, *range(2, 2 + len(sides))])
    paths = PredictedPaths(paths.points, vehicle, paths.half_sizes, paths.dt)
    state = np.array([0, 1.8, 20, 0.0])
    plan = MpcPlanner().plan(state, paths, ROAD)
    assert plan.status is Status.UNSAFE
    assert plan.slack.max() > 0.1
    others = paths.of(np.arange(len(paths)) != 2)
    clear = clearances(plan.states, obstacles_of(others, ObstacleSettings())[0], VehicleSettings(), ObstacleSettings())
    assert clear.min() >= 1


def test_brakes_where_the_search_returns_no_numbers(straight_paths, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        planning, "search", lambda do, *args, **_: search(do, *args) if do == BEGIN else (NOTHING, False)
    )
    plan = MpcPlanner().plan(np.array([0, 1.8, 20, 0.0]), straight_paths((12, 1.8, 0)), ROAD)
    assert plan.status is Status.UNSAFE
    assert plan.severity > 10
    np.testing.assert_allclose(plan.inputs[:10, 0], -8.0)


def test_nobody_looks_at_the_clock_unless_asked() -> None:
    assert PlannerSettings().budget is None


def test_a_search_that_never_arrives_ends_with_the_time(straight_paths, monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock is a made-up one: every look at it takes a millisecond."""
    clock, calls = itertools.count(), []
    monkeypatch.setattr(planning.time, "perf_counter", lambda: next(clock) / 1000)

    def endless(do, *args, best):
        calls.append(do)
        chosen = search(do & ~IF_ARRIVED, *args, best=best)
        assert (chosen[0] == NOT_YET) is (do & CHOOSE == 0)
        return chosen

    monkeypatch.setattr(planning, "search", endless)
    plan = MpcPlanner(PlannerSettings(budget=0.0105, iterations=1000)).plan(
        np.array([0, 1.8, 20, 0.0]), straight_paths(), ROAD
    )
    assert plan.status is Status.SOLVED
    assert [bool(do & GO_ON) for do in calls] == [True] * 10 + [False]


def test_no_iteration_and_no_second_search_begin_when_the_time_is_spent(
    straight_paths, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []
    monkeypatch.setattr(planning, "search", lambda do, *args, **best: calls.append(do) or search(do, *args, **best))
    paths = straight_paths((6, 5.4, 0), (0, 1.8, 20), (0, 9.0, 20), (-7, 5.4, 20))
    state = np.array([0, 5.4, 20, 0.0])
    MpcPlanner(PlannerSettings(budget=1e-9)).plan(state, paths, ROAD)
    assert [do for do in calls if do != EVALUATE] == [BEGIN + CHOOSE]
    calls.clear()
    MpcPlanner().plan(state, paths, ROAD)
    begun = [do for do in calls if do & BEGIN]
    assert len(begun) == 2 and all(do & GO_ON for do in begun)  # leaders that brake, the sets alone


def test_the_more_paths_the_fewer_iterations_between_two_looks_at_the_clock(
    straight_paths, monkeypatch: pytest.MonkeyPatch
) -> None:
    iterations = []

    def at_once(do, *args, best):
        iterations.append(args[-1])
        return search(do | CHOOSE, *args, best=best)

    monkeypatch.setattr(planning, "search", at_once)
    for count in (10, 249, 1500):  # and a leader that brakes
        paths = straight_paths(*[(20.0 + i / 100, 1.8, 18 + i / 1000) for i in range(count)])
        MpcPlanner().plan(np.array([0, 5.4, 20, 0.0]), paths, ROAD)
    assert iterations == [8, 4, 1]


def test_a_search_has_no_more_iterations_than_are_set(straight_paths, monkeypatch: pytest.MonkeyPatch) -> None:
    iterations = []

    def endless(do, *args, best):
        iterations.append(args[-1])
        return search(do & ~IF_ARRIVED, *args, best=best)

    monkeypatch.setattr(planning, "search", endless)
    MpcPlanner(PlannerSettings(iterations=19)).plan(np.array([0, 5.4, 20, 0.0]), straight_paths(), ROAD)
    assert iterations == [8, 8, 3]


def test_what_cannot_be_reached_changes_nothing(straight_paths) -> None:
    """The plan is the same when nothing is left out: culling loses nothing."""
    state, rows = (
        np.array([0, 1.8, 20, 0.0]),
        [(d, 1.8 + 3.6 * (i % 3), 18.0) for i, d in enumerate(range(-200, 300, 20))],
    )
    culled = MpcPlanner().plan(state, straight_paths(*rows), ROAD)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(surroundings, "reachable", lambda _, boxes, *rest: np.ones(boxes.shape[2], dtype=bool))
        everything = MpcPlanner().plan(state, straight_paths(*rows), ROAD)
    np.testing.assert_allclose(culled.states, everything.states, atol=1e-9)


def compiled_functions() -> dict[str, int]:
    """Numbers of types of arguments for which the functions of the package are compiled."""
    modules = [module for name, module in sys.modules.items() if name.startswith("coverdrive.")]
    return {
        f"{module.__name__}.{name}": len(function.signatures)
        for module in modules
        for name, function in vars(module).items()
        if hasattr(function, "signatures") and not isinstance(function, type)
    }


def test_plans_compile_nothing_after_the_reset(straight_paths) -> None:
    planner = MpcPlanner()
    planner.reset(PERIOD)
    compiled = compiled_functions()
    assert len(compiled) > 20
    state = np.zeros((4, 2))[:, 0]
    state[:] = [0, 5.4, 20, 0]
    for count in (0, 3, 48, 49, 119):
        paths = straight_paths(*[(20.0 + i / 10, 1.8, 18) for i in range(count)])
        planner.plan(state, paths, ROAD)
        strided = np.zeros((count, 13, 4))[..., :2]
        strided[:] = paths.points
        planner.plan(state, dataclasses.replace(paths, points=strided), ROAD)
        single = paths.half_sizes.astype(np.float32)
        planner.plan(state, dataclasses.replace(paths, half_sizes=single), ROAD)
    assert compiled_functions() == compiled


def test_an_interrupt_in_the_middle_of_a_search_is_heeded(straight_paths, heeds_interrupts: None) -> None:
    """As often as chance decides, it arrives in compiled code."""
    paths, planner = straight_paths(*[(20.0 + i, 1.8, 18) for i in range(20)]), MpcPlanner()
    planner.reset(PERIOD)
    for _ in range(30):
        with pytest.raises(KeyboardInterrupt):
            threading.Timer(0.005, _thread.interrupt_main).start()
            while True:
                planner.plan(np.array([0, 5.4, 20, 0.0]), paths, ROAD)


@pytest.mark.parametrize("seed", range(20))
def test_the_fail_safe_branch_of_a_clear_plan_touches_no_path_and_keeps_to_the_road(straight_paths, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = [(rng.uniform(-20, 50), rng.choice([1.8, 5.4, 9.0]), rng.uniform(10, 25)) for _ in range(6)]
    paths = straight_paths(*rows)
    plan = MpcPlanner().plan(np.array([0, 5.4, 20, 0.0]), paths, ROAD)
    assert plan.fail_safe is not None
    np.testing.assert_array_equal(plan.fail_safe[:2], plan.states[:2])
    if plan.status in (Status.SOLVED, Status.FALLBACK):
        assert plan.severity == plan.slack.max() == 0
        assert not touches(plan.fail_safe[None], paths.points, paths.half_sizes, 20).any()
        extent = turned_half_extents(CAR.half_sizes, plan.fail_safe[:, 3])[:, 1]
        assert (plan.fail_safe[:, 1] - extent >= 0).all()
        assert (plan.fail_safe[:, 1] + extent <= 10.8).all()
    else:
        assert plan.slack.max() > 0 and plan.severity > 0


@pytest.mark.parametrize("period", [0.4, 1.0])
def test_a_clear_plan_that_is_driven_for_longer_than_its_first_step_touches_nothing(straight_paths, period) -> None:
    """Between bodies, what swerves and swerves back is driven as the mean of both."""
    rng, planner, clear = np.random.default_rng(1), MpcPlanner(), 0
    for _ in range(200):
        planner.reset(period)
        state = np.array([0.0, rng.uniform(1, 3), rng.uniform(5, 33), rng.normal(0, 0.02)])
        cars = [(rng.uniform(6, 50), rng.uniform(0.5, 6.5), rng.choice([0.0, 15.0])) for _ in range(2)]
        plan = planner.plan(state, straight_paths(*cars), ROAD)
        if plan.status not in (Status.SOLVED, Status.FALLBACK):
            continue
        clear += 1
        held = int(np.ceil(period / plan.dt))
        np.testing.assert_array_equal(plan.inputs[:held], np.broadcast_to(plan.inputs[0], (held, 2)))
        times, others = np.linspace(0, period, 41), np.tile(cars, (41, 1, 1))
        own = np.array([[step(state, plan.applied(period), float(time))] for time in times])
        others[..., 0] += times[:, None] * others[..., 2]
        bodies = own[..., :2], own[..., 3], CAR.half_sizes, others[..., :2], np.zeros((41, 2)), CAR.half_sizes
        assert not boxes_overlap(*bodies).any()
    assert clear > 100


def test_who_can_only_be_passed_by_steering_anew_at_every_plan_is_passed(straight_paths) -> None:
    """A motorcycle stands 8 m ahead; whoever turns the wheels once in each step of 0.25 s, or only brakes, hits it."""
    planner, state, wide = MpcPlanner(), np.array([100.0, 1.49, 13.61, 0.01]), Road.straight(4)
    where, half = (111.6, 1.7, 0.0), np.array([1.1, 0.4])
    planner.reset(PERIOD)
    for _ in range(20):
        paths = straight_paths(where)
        paths.half_sizes[:] = half
        inputs = planner.plan(state, paths, wide).inputs[0]
        for time in np.linspace(0, PERIOD, 11):
            own = step(state, inputs, float(time))
            assert not boxes_overlap(own[:2], own[3], CAR.half_sizes, np.array(where[:2]), np.array(0.0), half)
        state = step(state, inputs, PERIOD)
    assert state[0] > 113


def test_both_branches_begin_with_the_inputs_that_are_driven(straight_paths) -> None:
    """Behind a slower car the drive branch trusts what is likely; the other one does not."""
    state, paths = np.array([0, 1.8, 20, 0.0]), straight_paths((25, 1.8, 20), (25, 1.8, 20), (0, 5.4, 20))
    time, points = 0.25 * np.arange(13), paths.points.copy()
    points[1, :, 0] = 25 + 20 * np.minimum(time, 2.5) - 4 * np.minimum(time, 2.5) ** 2
    paths = PredictedPaths(points, np.array([0, 0, 1]), paths.half_sizes, 0.25, weight=np.array([0.9, 0.1, 1.0]))
    plan = MpcPlanner().plan(state, paths, ROAD)
    assert plan.fail_safe is not None and plan.status in (Status.SOLVED, Status.FALLBACK)
    np.testing.assert_allclose(plan.states, rollout(state, plan.inputs, 0.25), atol=1e-9)
    np.testing.assert_array_equal(plan.fail_safe[1], plan.states[1])
    assert plan.fail_safe[-1, 2] < plan.states[-1, 2] - 3
    assert not touches(plan.fail_safe[None], paths.points, paths.half_sizes, 20).any()
    single = ProblemSettings(branches=BranchSettings(fail_safe=False))
    plan = MpcPlanner(PlannerSettings(problem=single)).plan(state, paths, ROAD)
    np.testing.assert_array_equal(plan.fail_safe, plan.states)


def test_the_next_search_starts_from_the_last_plan_and_its_fail_safe_rest(
    straight_paths, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = []
    monkeypatch.setattr(planning, "search", lambda *args, **best: wanted.append(args[2]) or search(*args, **best))
    planner, state, paths = MpcPlanner(), np.array([0, 1.8, 20, 0.0]), straight_paths((40, 1.8, 15))
    planner.reset(PERIOD)
    first = planner.plan(state, paths, ROAD)
    planner.plan(step(state, first.inputs[0], PERIOD), paths, ROAD)
    assert first.fail_safe is not None
    speeds = np.diff(first.fail_safe[:, 2]) / 0.25
    drive = planner._calm.tree.drive
    shift, before, after = held_on(12, PERIOD, 0.25), *wanted[-2:]
    np.testing.assert_array_equal(before.rest, 0.0)
    np.testing.assert_array_equal(before.last, 0.0)
    np.testing.assert_allclose(after.rest[:, 0], shift @ speeds, atol=1e-9)
    (held,) = (i for i, each in enumerate(after.last) if np.allclose(each[drive], shift @ first.inputs, atol=1e-9))
    assert after.held == held
    lost = 0.1 / 0.25 * (40 - 15) ** 2 * 2.0  # of the wanted speed in the first lane, until it can be in the next
    np.testing.assert_allclose(
        after.extra, np.array([lost, 0.0]) + PlannerSettings().lane_change * (np.arange(2) != held)
    )


@pytest.mark.parametrize("seed", range(6))
def test_where_predictions_come_true_there_is_always_a_clear_plan(straight_paths, seed: int) -> None:
    """Every car does what was predicted: the rest of the last fail-safe branch stays clear until there is better."""
    rng = np.random.default_rng(seed)
    cars = [(lon, rng.choice([1.8, 5.4, 9.0]), rng.uniform(8, 16)) for lon in range(30, 110, 16)]
    _, plans, contact = drive(MpcPlanner(), [0, 5.4, 18, 0], cars, straight_paths, 60)
    assert not contact
    assert {plan.status for plan in plans} <= {Status.SOLVED, Status.FALLBACK}
    assert max(plan.slack.max() for plan in plans) == 0


def test_a_vanished_vehicle_is_not_forgotten_at_once(straight_paths) -> None:
    planner, state = MpcPlanner(PlannerSettings(manners=NONE)), np.array([0, 5.4, 20, 0.0])
    planner.reset(PERIOD)
    blocked = [(24, 5.4, 12), (0, 1.8, 20), (2, 9.0, 20)]
    first = planner.plan(state, straight_paths(*blocked), ROAD)
    after = planner.plan(step(state, first.inputs[0], PERIOD), straight_paths(), ROAD)
    assert first.inputs[0, 0] < -1
    assert after.inputs[0, 0] < -1
    for _ in range(6):
        after = planner.plan(step(state, first.inputs[0], PERIOD), straight_paths(), ROAD)
    assert after.inputs[0, 0] > 1


@pytest.mark.parametrize("index", range(4))
def test_unknown_state_is_reckoned_and_promises_nothing(straight_paths, index: int) -> None:
    state, paths = np.array([0, 1.8, 20, 0.0]), straight_paths((60, 1.8, 15))
    planner = MpcPlanner()
    planner.reset(PERIOD)
    first = planner.plan(state, paths, ROAD)
    state[index] = np.nan
    plan = planner.plan(state, paths, ROAD)
    assert plan.status is Status.INVALID_INPUT
    np.testing.assert_array_equal(plan.slack, 1.0)
    np.testing.assert_allclose(plan.states[0], step(first.states[0], first.inputs[0], PERIOD), atol=1e-9)
    without = MpcPlanner().plan(state, paths, ROAD)
    assert without.status is Status.INVALID_INPUT
    np.testing.assert_allclose(without.inputs[:9, 0], -8.0)


def test_where_the_state_stays_unknown_the_ego_follows_its_plan_for_the_grace_and_then_brakes(straight_paths) -> None:
    planner, nothing = MpcPlanner(), np.full(4, np.nan)
    planner.reset(PERIOD)
    planner.plan(np.array([0, 1.8, 20, 0.0]), straight_paths((60, 5.4, 20)), ROAD)
    plans = [planner.plan(nothing, straight_paths((60, 5.4, 20)), ROAD) for _ in range(40)]
    assert all(plan.status is Status.INVALID_INPUT for plan in plans)
    assert min(plan.inputs[0, 0] for plan in plans[:5]) > 0
    np.testing.assert_allclose([plan.inputs[0, 0] for plan in plans[5:30]], -8.0)
    assert plans[-1].states[-1, 2] == pytest.approx(0.0)
    seen = planner.plan(np.array([40, 1.8, 5, 0.0]), straight_paths((90, 5.4, 20)), ROAD)
    assert seen.status in (Status.SOLVED, Status.FALLBACK) and seen.inputs[0, 0] > 0


@pytest.mark.parametrize("jump", [(30, 0, 0, 0), (0, 3, 0, 0), (0, 0, -10, 0), (0, 0, 0, 0.4)])
def test_a_jump_for_one_period_is_bridged(straight_paths, jump) -> None:
    """As the car goes where its plan leads to, the plan is the one that a true measurement gives."""
    planner, undisturbed, state = MpcPlanner(), MpcPlanner(), np.array([0, 1.8, 20, 0.0])
    planner.reset(PERIOD)
    undisturbed.reset(PERIOD)
    for moment in range(8):
        paths = straight_paths((40 + 1.5 * moment, 1.8, 15))
        measured = state + np.array(jump) * (moment == 4)
        plan, wanted = planner.plan(measured, paths, ROAD), undisturbed.plan(state, paths, ROAD)
        assert (plan.status is Status.INVALID_INPUT) == (moment == 4)
        np.testing.assert_allclose(plan.states, wanted.states, atol=1e-3)
        state = step(state, wanted.inputs[0], PERIOD)


@pytest.mark.parametrize("jump", [(40.0, 0.0), (0.0, 3.0)])
def test_where_all_others_jump_as_well_it_is_the_origin_that_has_moved(straight_paths, jump) -> None:
    """Without a jump the plan brakes for the slower car ahead; with it, it does the same."""
    planner, state = MpcPlanner(), np.array([0, 5.4, 25, 0.0])
    planner.reset(PERIOD)
    for moment in range(6):
        lon, lat = np.array(jump) * (moment >= 3)
        others = [(30 + 1.2 * moment, 5.4, 12), (2.5 * moment, 1.8, 25), (2.5 * moment, 9.0, 25)]
        paths = straight_paths(*[(other[0] + lon, other[1] + lat, other[2]) for other in others])
        road = Road(np.array(ROAD.edges) + lat, ROAD.length)
        plan = planner.plan(state + np.array([lon, lat, 0, 0]), paths, road)
        assert plan.status is not Status.INVALID_INPUT
        assert plan.inputs[0, 0] < -1
        state = step(state, plan.inputs[0], PERIOD)


def test_a_lasting_jump_is_believed_after_the_grace(straight_paths) -> None:
    planner, state = MpcPlanner(), np.array([0, 1.8, 20, 0.0])
    planner.reset(PERIOD)
    plans, measured = [], []
    for moment in range(12):
        measured.append(state + np.array([30.0, 0, 0, 0]) * (moment > 0))
        plans.append(planner.plan(measured[-1], straight_paths((200, 5.4, 20)), ROAD))
        state = step(state, plans[-1].inputs[0], PERIOD)
    assert [plan.status is Status.INVALID_INPUT for plan in plans] == [False] + 5 * [True] + 6 * [False]
    assert min(plan.inputs[0, 0] for plan in plans) > 0
    for plan, true in zip(plans[6:], measured[6:], strict=True):
        np.testing.assert_array_equal(plan.states[0], true)


@pytest.mark.parametrize("period", [0.05, 0.1, 0.25])
def test_noise_is_no_jump(straight_paths, period: float) -> None:
    planner, state, rng = MpcPlanner(), np.array([0, 1.8, 35, 0.0]), np.random.default_rng(0)
    planner.reset(period)
    for _ in range(100):
        noise = rng.normal(0, [0.2, 0.2, 0.3, 0.02])
        plan = planner.plan(state + noise, straight_paths((state[0] + 25, state[1], 30)), ROAD)
        assert plan.status is not Status.INVALID_INPUT
        state = step(state, plan.inputs[0], period)


def test_a_vehicle_that_appears_is_kept_clear_of_at_once(straight_paths) -> None:
    planner, state = MpcPlanner(), np.array([0, 1.8, 20, 0.0])
    planner.reset(PERIOD)
    sides = [(0, 5.4, 20), (60, 5.4, 20)]
    first = planner.plan(state, straight_paths(*sides), ROAD).inputs[0, 0]
    assert first > 0
    plan = planner.plan(state, straight_paths(*sides, (25, 1.8, 10)), ROAD)
    assert plan.fail_safe is not None and plan.status is Status.SOLVED
    assert plan.inputs[0, 0] == pytest.approx(first - CAR.max_jerk * PERIOD)
    assert plan.inputs[2, 0] < -2 and plan.fail_safe[-1, 2] < 14


def test_unknown_path_of_a_new_vehicle_brakes_and_promises_nothing(straight_paths) -> None:
    paths = straight_paths((30, 1.8, 15), (20, 5.4, 15))
    paths.points[1, 4, 0] = np.inf
    planner = MpcPlanner()
    plan = planner.plan(np.array([0, 1.8, 20, 0.0]), paths, ROAD)
    assert plan.status is Status.INVALID_INPUT
    np.testing.assert_array_equal(plan.slack, 1.0)
    np.testing.assert_allclose(plan.inputs[:5, 0], -8.0)
    again = planner.plan(plan.states[1], straight_paths((60, 1.8, 15)), ROAD)
    assert again.status in (Status.SOLVED, Status.FALLBACK)


def test_paths_at_other_times_are_refused(straight_paths) -> None:
    paths = straight_paths((30, 1.8, 15))
    state = np.array([0, 1.8, 20, 0.0])
    slower = PredictedPaths(paths.points, paths.vehicle, paths.half_sizes, 0.5)
    with pytest.raises(SettingError, match=r"13 points every 0\.5 s"):
        MpcPlanner().plan(state, slower, ROAD)
    shorter = PredictedPaths(paths.points[:, :7], paths.vehicle, paths.half_sizes[:, :7], 0.25)
    with pytest.raises(SettingError, match="7 points"):
        MpcPlanner().plan(state, shorter, ROAD)


def test_a_pickled_planner_goes_on_as_before(straight_paths) -> None:
    cars = straight_paths((25, 1.8, 15), (10, 5.4, 18))
    planner, state = MpcPlanner(), np.array([0, 1.8, 20, 0.0])
    first = planner.plan(state, cars, ROAD)
    copy = pickle.loads(pickle.dumps(planner))
    state = step(state, first.inputs[0], PERIOD)
    np.testing.assert_array_equal(copy.plan(state, cars, ROAD).states, planner.plan(state, cars, ROAD).states)


def test_a_car_off_its_limits_still_gets_a_plan(straight_paths) -> None:
    """Off the road, turned too far and too fast: every bound gives way, none makes the problem infeasible."""
    plan = MpcPlanner().plan(np.array([0, -1.0, 50, -0.5]), straight_paths((40, 1.8, 20)), ROAD)
    assert plan.status in (Status.SOLVED, Status.FALLBACK, Status.UNSAFE)
    assert plan.states[-1, 3] > -0.3
    assert plan.states[-1, 2] < 50


def test_wishes_choose_speed_and_lanes_for_one_plan_only(straight_paths) -> None:
    state, paths, planner, ends = np.array([0, 1.8, 20, 0.0]), straight_paths((200, 9.0, 30)), MpcPlanner(), []
    for wish in (Wish(), Wish(15.0, lanes=(2,)), Wish(15.0), Wish(lanes=(1, 2)), Wish()):
        planner.reset(PERIOD)
        ends.append(planner.plan(state, paths, ROAD, wish).states[-1])
    usual, both, slow, beside, again = ends
    assert usual[2] > 25 and usual[1] == pytest.approx(1.8, abs=0.05)
    assert both[1] > 3 and both[2] < 17
    assert slow[1] == pytest.approx(1.8, abs=0.05) and slow[2] < 17
    assert beside[1] > 3 and beside[2] > 25
    assert np.array_equal(again, usual)
    assert Wish(lanes=(1, 4)).away(range(6)).tolist() == [1, 0, 1, 1, 0, 1]
    assert Wish().away([3]).tolist() == [0]
    for wrong in ({"speed": np.nan}, {"lat": np.inf}, {"braking": np.nan}):
        with pytest.raises(SettingError, match="of a wish: expected a finite number"):
            Wish(**wrong)


def test_what_is_urgent_counts_more_than_comfort_for_one_plan_only(straight_paths) -> None:
    state, paths, planner, found = np.array([0, 1.8, 20, 0.0]), straight_paths((200, 9.0, 30)), MpcPlanner(), []
    for urgent in (False, True, False):
        planner.reset(PERIOD)
        found.append(planner.plan(state, paths, ROAD, Wish(22.0, lanes=(1,), urgent=urgent)).states)
    calm, hurried, again = found
    assert (calm[6, 1:3] + 0.4 < hurried[6, 1:3]).all()
    assert hurried[-1, 1:3] == pytest.approx([5.4, 22.0], abs=0.2)
    assert np.array_equal(again, calm)


def test_what_is_urgent_is_not_held_back_by_what_vehicles_ahead_may_do_besides(straight_paths) -> None:
    trusting = PlannerSettings(leaders=LeaderSettings(deceleration=0))
    state, paths, found = np.array([0, 5.4, 20, 0.0]), straight_paths((20, 5.4, 20)), []
    for settings, urgent in ((None, False), (None, True), (trusting, True)):
        found.append(MpcPlanner(settings).plan(state, paths, ROAD, Wish(22.0, lanes=(1,), urgent=urgent)).inputs)
    calm, hurried, without = found
    assert calm[:4, 0].max() < 0 < hurried[:4, 0].min()
    assert np.array_equal(hurried, without)


def test_who_changes_a_plan_does_not_change_the_next_one(straight_paths) -> None:
    state, paths, seconds = np.array([0, 1.8, 20, 0.0]), straight_paths((40, 1.8, 15)), []
    for changed in (False, True):
        planner = MpcPlanner()
        planner.reset(PERIOD)
        first = planner.plan(state, paths, ROAD)
        after = step(state, first.inputs[0], PERIOD)
        if changed:
            for each in (first.inputs, first.states, first.slack):
                each[:] = -1.0
        seconds.append(planner.plan(after, paths, ROAD))
    assert np.array_equal(seconds[0].inputs, seconds[1].inputs)


def test_a_solved_plan_keeps_to_the_jerk_limit_where_vehicles_appear(straight_paths) -> None:
    """Along and across; who has to exceed it says so by the status."""
    planner, jerks, fallbacks = MpcPlanner(), list[float](), 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        planner.reset(PERIOD)
        state, applied = np.array([0.0, rng.choice([1.8, 5.4, 9.0]), rng.uniform(10, 40), 0.0]), np.zeros(2)
        gap = rng.uniform(0.3, 2.5) * state[2]
        cars = [(gap, state[1], rng.uniform(0, 0.8) * state[2])]
        cars += [(rng.uniform(-20, 60), lat, rng.uniform(0.5, 1.1) * state[2]) for lat in (1.8, 5.4, 9.0)]
        for now in range(8):
            there = [(lon + (speed * PERIOD) * now, lat, speed) for lon, lat, speed in cars if now >= 4]
            plan = planner.plan(state, straight_paths(*there), Road.straight())
            change = np.abs(plan.inputs[0] - applied) / PERIOD
            fallbacks += plan.status is Status.FALLBACK
            if plan.status is Status.SOLVED:
                jerks += [change[0], change[1] * state[2]]
            state, applied = step(state, plan.inputs[0], PERIOD), plan.inputs[0]
    assert len(jerks) > 500
    assert fallbacks > 5
    assert max(jerks) <= VehicleSettings().max_jerk * (1 + 1e-6)
