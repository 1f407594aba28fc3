"""What the search chooses among plans, and what it does where nothing is clear."""

import numpy as np
import pytest
from planning_scenes import (
    CAR,
    CONSTANTS,
    DT,
    PERIOD,
    STEPS,
    STRAIGHT,
    around,
    driven,
    evaluated,
    fail_safe,
    scene,
    touches,
    whole,
)

import coverdrive.planning.solver.search as search
from coverdrive.planning.check.evaluate import Plans, drive_step, empty_plans
from coverdrive.planning.check.merit import merit
from coverdrive.planning.solver import manoeuvres
from coverdrive.planning.solver.manoeuvres import accelerations_of, lane_seeking
from coverdrive.planning.solver.search import (
    BEGIN,
    CHOOSE,
    EVALUATE,
    GO_ON,
    Wanted,
    room_for,
)
from coverdrive.planning.surroundings import Surroundings

NODES = len(CONSTANTS.tree.parent)
STATE = np.array([0.0, 5.4, 20.0, 0.0])


def wanted_of(lanes: list[float], last: np.ndarray | None = None, rest: np.ndarray | None = None) -> Wanted:
    return Wanted(
        lanes=np.array(lanes),
        held=0,
        extra=np.array([0.0, 20.0, 20.0])[: len(lanes)],
        last=np.zeros((len(lanes), NODES, 2)) if last is None else last,
        rest=np.zeros((STEPS, 2)) if rest is None else rest,
        accelerations=accelerations_of(CAR),
    )


def searched(wanted: Wanted, surroundings: Surroundings, iterations: int = 24) -> tuple[Plans, int, bool, np.ndarray]:
    plans, best = room_for(wanted, CONSTANTS), wanted.last.copy()
    do = BEGIN + (GO_ON if iterations else 0) + CHOOSE
    return plans, *search.search(do, plans, wanted, surroundings, CONSTANTS, iterations, best=best), best


def test_guesses_brake_keep_the_speed_and_accelerate() -> None:
    accelerations = accelerations_of(CAR, braking=4)
    np.testing.assert_allclose(accelerations, [-8, -16 / 3, -8 / 3, 0, 1.5, 3])


def test_simple_manoeuvres_are_steered_to_their_lane_on_both_branches(straight_paths) -> None:
    wanted = wanted_of([5.4, 1.8, 9.0])
    plans, *_ = searched(wanted, around(STATE, straight_paths()), iterations=0)
    tree, tried = CONSTANTS.tree, len(wanted.accelerations)
    for i in range(3 * tried):
        np.testing.assert_array_equal(plans.inputs[i, tree.drive], plans.inputs[i, tree.fail_safe])
        assert plans.lane[i] == i // tried
    keeping = plans.states[[3, tried + 3, 2 * tried + 3]][:, tree.drive[-1], 1]
    np.testing.assert_allclose(keeping, [5.4, 1.8, 9.0], atol=0.4)


def test_a_search_starts_from_the_last_plan_and_from_the_cheapest_manoeuvre(straight_paths) -> None:
    """In the lane that the last plan aimed at from both, in the others from the cheaper one."""
    surroundings = around(STATE, straight_paths((40, 5.4, 12), (10, 1.8, 22)))
    last = np.zeros((3, NODES, 2))
    last[:2, :, 0] = 0.5
    last[2, :, 1] = 0.3  # off the road
    wanted, tree = wanted_of([5.4, 1.8, 9.0], last=last), CONSTANTS.tree
    plans, tried, first = room_for(wanted, CONSTANTS), len(wanted.accelerations), wanted.guesses
    search.search(BEGIN, plans, wanted, surroundings, CONSTANTS)
    np.testing.assert_array_equal(plans.inputs[first], last[0])
    np.testing.assert_array_equal(plans.lane[first : first + 4], [0, 1, 2, 0])
    safest = np.flatnonzero(plans.clear[:first])[np.argmin(plans.cost[:first][plans.clear[:first]])]
    for start, lane in ((first + 3, 0), (first + 2, 2)):
        branches = [plans.inputs[start, tree.safe], plans.inputs[start, tree.drive]]
        np.testing.assert_array_equal(branches[0], plans.inputs[safest, tree.safe])
        drive = plans.inputs[lane * tried : (lane + 1) * tried][:, tree.drive]
        assert np.equal(drive, branches[1]).all((1, 2)).any()
    for start, lane in enumerate([0, 1, 2], start=first):
        former = merit(last[lane], np.full(2, wanted.lanes[lane]), surroundings, CONSTANTS).value
        assert merit(plans.inputs[start], plans.targets[start], surroundings, CONSTANTS).value <= former


def test_a_clear_plan_is_chosen_wherever_one_is_known(straight_paths) -> None:
    """The cheapest of those that are clear, with the price of another lane: first optimised plans within the jerk
    limit, then manoeuvres within it.
    """
    clear, exceeding = 0, 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        rows = [(rng.uniform(-25, 60), rng.choice([1.8, 5.4, 9.0]), rng.uniform(5, 30)) for _ in range(6)]
        wanted, paths = wanted_of([5.4, 1.8, 9.0]), straight_paths(*rows)
        surroundings = around(STATE, paths)
        plans, chosen, optimised, best = searched(wanted, surroundings)
        assert chosen >= 0
        known = np.isfinite(plans.cost) & plans.clear
        assert bool(plans.clear[chosen]) is bool(known.any())
        if not known.any():
            continue
        clear += 1
        price, first = plans.cost + wanted.extra[plans.lane], wanted.guesses
        abrupt = np.array([search.abrupt(each, surroundings, CONSTANTS) for each in plans.inputs])
        worth = 2 * abrupt + (np.arange(len(known)) < first)
        assert price[chosen] == price[known & (worth == worth[known].min())].min()
        assert optimised is bool(worth[chosen] == 0)
        exceeding += abrupt[chosen]
        np.testing.assert_array_equal(best[plans.lane[chosen]], plans.inputs[chosen])
        assert not touches(driven(STATE, fail_safe(plans)[[chosen]], 1)[1], paths.points, paths.half_sizes, 20).any()
    assert clear > 10
    assert 0 < exceeding < clear


def test_a_plan_that_is_not_clear_is_drawn_back_to_one_that_is(straight_paths) -> None:
    """The last plan, which keeps the speed towards a standing car, as far as possible from the cheapest clear one."""
    surroundings, wanted = around(STATE, straight_paths((79, 5.4, 0))), wanted_of([5.4])
    plans, *_ = searched(wanted, surroundings, iterations=0)
    at, clear = wanted.guesses, np.flatnonzero(plans.clear)
    abrupt = [search.abrupt(plans.inputs[i], surroundings, CONSTANTS) for i in clear]
    price = np.where(clear == at, np.inf, plans.cost[clear] + 1e6 * np.array(abrupt))
    base = plans.inputs[clear[np.argmin(price)]]
    assert plans.clear[at] and base[0, 0] < -1
    share = 1 - plans.inputs[at, 0, 0] / base[0, 0]
    assert 0.1 < share < 0.9
    np.testing.assert_allclose(plans.inputs[at], (1 - share) * base, atol=1e-9)
    assert not evaluated(((1 - share - 0.5**search._HALVINGS) * base)[None], surroundings).clear[0]


@pytest.mark.parametrize("lon", [12.0, 16.0, 20.0])
def test_where_nothing_is_clear_a_gap_is_taken_or_else_it_brakes(straight_paths, lon: float) -> None:
    """A wall of three cars, or one with a gap between two lanes, too near to stop before it."""
    wall = straight_paths((lon, 1.8, 0), (lon, 5.4, 0), (lon, 9.0, 0))
    plans, chosen, _, _ = searched(wanted_of([5.4, 1.8, 9.0]), around(STATE, wall))
    assert not plans.clear[chosen]
    known = np.isfinite(plans.cost)
    on_road = known & (plans.departure <= 0.005)
    assert on_road[chosen]
    assert plans.harm[chosen] <= plans.harm[on_road].min() + 0.5
    assert plans.severity[chosen] <= plans.severity[on_road].min() + 0.5


def test_evasions_reach_places_between_the_lanes_and_keep_to_the_road(straight_paths) -> None:
    """Cars on both sides, and one ahead that leaves a gap beside it but in no lane."""
    paths = straight_paths((24, 5.4, 0), (24, 1.3, 0), (24, 10.0, 0), (-9, 5.4, 30))
    wanted = wanted_of([5.4, 1.8, 9.0])
    plans, _, _, _ = searched(wanted, around(STATE, paths))
    evasions = plans.states[wanted.guesses + 4 :, CONSTANTS.tree.drive]
    assert np.ptp(plans.inputs[wanted.guesses + 4 :, 0, 0]) == pytest.approx(8.0)
    assert evasions[:, -1, 1].min() < 2.5 and evasions[:, -1, 1].max() > 8.3
    ends = np.unique(np.round(evasions[:, -1, 1], 1))
    assert len(ends) >= 9


def steered(state: np.ndarray, lat: float, acceleration: float) -> np.ndarray:
    """The inputs (K, 2) of a car in a hurry to a lat."""
    state, inputs, elapsed = tuple(state), [(0.0, 0.0)], PERIOD
    for _ in range(STEPS):
        wish = acceleration, lane_seeking(*state[1:], lat, manoeuvres._HURRY)
        applied, state = drive_step(state, wish, inputs[-1], elapsed, DT, STRAIGHT, CONSTANTS.vehicle)
        inputs.append(applied)
        elapsed = DT
    return np.array(inputs[1:])


@pytest.mark.parametrize("away", [3.0, 4.0])
@pytest.mark.parametrize("speed", [20.0, 35.0])
@pytest.mark.parametrize("left", [False, True])
def test_evasions_that_brake_stop_short_of_the_edge_and_keep_to_the_road(
    straight_paths, away: float, speed: float, left: bool
) -> None:
    """From who is in contact already. The negative control is steered to the edge itself: a car swings beyond that."""
    room = CAR.width / 2 + CONSTANTS.shape.edge_margin
    lat, edge = (10.8 - away, 10.8 - room) if left else (away, room)
    state, wanted = np.array([0.0, lat, speed, 0.0]), wanted_of([5.4, 1.8, 9.0])
    surroundings = around(state, straight_paths((0.0, lat, speed)))
    plans, *_ = searched(wanted, surroundings, iterations=0)
    tried = len(manoeuvres._HARD)
    outermost = wanted.guesses + 1 + len(wanted.lanes) + ((manoeuvres._PLACES - 1) * tried if left else 0)
    for i in range(2):
        braking = -CAR.max_deceleration * manoeuvres._HARD[i]
        assert plans.inputs[outermost + i, 0, 0] == pytest.approx(braking)
        assert plans.departure[outermost + i] == 0
        aim = lat + 0.9 * (edge - lat)
        assert plans.states[outermost + i, CONSTANTS.tree.drive[-1], 1] == pytest.approx(aim, abs=0.02)
        assert evaluated(whole(steered(state, edge, braking)), surroundings).departure[0] > 0.05


@pytest.mark.parametrize("left", [False, True])
def test_evasions_that_are_steered_more_finely_reach_the_edge_and_keep_to_the_road(straight_paths, left: bool) -> None:
    """At 20 m/s. The negative control are the same ones in steps, which stop short of it."""
    room = CAR.width / 2 + CONSTANTS.shape.edge_margin
    lat, edge = (10.8 - 2.5, 10.8 - room) if left else (2.5, room)
    state, wanted = np.array([0.0, lat, 20.0, 0.0]), wanted_of([5.4, 1.8, 9.0])
    plans, *_ = searched(wanted, around(state, straight_paths((0.0, lat, 20.0))), iterations=0)
    ways, tried = wanted.guesses + 1 + len(wanted.lanes), len(manoeuvres._HARD)
    outermost = ways + ((manoeuvres._PLACES - 1) * tried if left else 0)
    for i in range(outermost, outermost + tried):
        short, reached = np.abs(plans.states[[i, i + manoeuvres.WAYS], CONSTANTS.tree.drive[-1], 1] - edge)
        assert reached < 0.03 < 0.1 < short
        assert plans.departure[i + manoeuvres.WAYS] <= search._MORE_DEPARTURE + 0.03


def test_where_nothing_is_clear_5_cm_beyond_the_least_departure_count_for_nothing() -> None:
    plans = empty_plans(4, NODES)
    plans.cost[:], plans.departure[:] = 1.0, [0.2, 0.249, 0.251, 0.9]
    plans.harm[:] = plans.expected[:] = [5.0, 3.0, 1.0, 0.0]
    allowed = search._allowed_departure(plans, 4)
    assert allowed == pytest.approx(0.25)
    ranks = [search._rank(plans, i, allowed) for i in range(4)]
    assert np.argsort(ranks).tolist() == [1, 0, 2, 3]  # the least harmful of those two; who leaves further is worse
    strict = [search._rank(plans, i, 0.2) for i in range(4)]
    assert np.argsort(strict).tolist() == [0, 1, 2, 3]  # the negative control: any departure counts


def test_whoever_is_clear_is_better_than_whoever_is_not_and_leaving_the_road_is_worst() -> None:
    plans = empty_plans(5, NODES)
    plans.cost[:], plans.departure[:] = [9e9, 1.0, 2.0, 1.0, 0.0], [0, 0, 0, 0, 0.1]
    plans.harm[:] = plans.expected[:] = [0, 5, 5, 9, 0]
    plans.clear[0] = True
    ranks = [search._rank(plans, i, 0.005) for i in range(5)]
    assert ranks == sorted(ranks)
    assert len(set(ranks)) == 5


def test_of_what_does_no_more_harm_than_full_braking_that_is_best_of_which_least_is_expected() -> None:
    plans = empty_plans(3, NODES)
    plans.cost[:], plans.departure[:] = 1.0, 0.0
    plans.harm[:], plans.expected[:] = [5.0, 4.9, 5.1], [5.0, 3.6, 3.5]
    assert sorted(range(3), key=lambda i: search._rank(plans, i, 0.005)) == [1, 0, 2]


def test_where_nothing_is_clear_nothing_that_does_more_harm_than_full_braking_is_chosen() -> None:
    rng, compared = np.random.default_rng(0), 0
    for _ in range(120):
        state, paths = scene(rng)
        plans, chosen, *_ = searched(wanted_of([5.4, 1.8, 9.0]), around(state, paths))
        if not plans.clear.any() and plans.departure[0] <= np.nanmin(plans.departure) + 0.005:
            compared += 1
            assert plans.harm[chosen] <= plans.harm[0] * (1 + 1e-4)
    assert compared > 25


def test_the_rest_of_the_last_plan_is_known(straight_paths) -> None:
    """As a plan whose branches are one."""
    rest = np.random.default_rng(0).normal(0, [1.0, 0.01], (STEPS, 2))
    wanted = wanted_of([5.4], rest=rest)
    plans, *_ = searched(wanted, around(STATE, straight_paths()), iterations=0)
    at = wanted.guesses - 1
    np.testing.assert_allclose(plans.inputs[at, CONSTANTS.tree.drive], rest)
    np.testing.assert_allclose(plans.inputs[at, CONSTANTS.tree.fail_safe], rest)


@pytest.mark.parametrize("speed", [3.0, 20.0, 40.0])
@pytest.mark.parametrize("target", [1.8, 5.4])
def test_lane_seeking_reaches_the_lane(speed: float, target: float) -> None:
    state, before, elapsed, lats = (0.0, 1.8, speed, 0.0), (0.0, 0.0), PERIOD, []
    for _ in range(40):
        turn = lane_seeking(state[1], state[2], state[3], target, 1.0)
        (before, state), elapsed = drive_step(state, (0.0, turn), before, elapsed, DT, STRAIGHT, CONSTANTS.vehicle), DT
        lats.append(state[1])
    assert lats[-1] == pytest.approx(target, abs=0.1)
    assert max(lats) < target + 0.3


def test_where_nothing_is_clear_the_descent_ends_soon(straight_paths) -> None:
    """However many iterations it may have; and nowhere else."""
    rng, hopeless = np.random.default_rng(1), 0
    for _ in range(40):
        state, paths = scene(rng)
        surroundings, wanted = around(state, paths), wanted_of([5.4, 1.8, 9.0])
        ends, unclear = [], []
        for iterations in (search._HOPELESS, 24):
            plans = room_for(wanted, CONSTANTS)
            search.search(BEGIN + GO_ON, plans, wanted, surroundings, CONSTANTS, iterations, 1e-9)
            for i in range(wanted.guesses, wanted.guesses + 4):
                search.search(EVALUATE, plans, wanted, surroundings, CONSTANTS, i)
            unclear.append(not plans.clear.any())
            ends.append(plans.inputs)
        if unclear[0]:
            hopeless += 1
            np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)
    assert 5 < hopeless < 35
