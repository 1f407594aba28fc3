"""What is called clear touches nothing at any time, by whatever steps it is driven; and what the rest is worth."""

import numpy as np
import pytest
from planning_scenes import (
    CAR,
    CONSTANTS,
    DT,
    OPEN,
    PROBLEM,
    STEPS,
    WANTED,
    WAYS,
    around,
    between,
    drive,
    driven,
    evaluated,
    fail_safe,
    rollout,
    sampled,
    scene,
    smallest_slack,
    touches,
    whole,
    wishes,
)

from coverdrive.geometry import boxes_overlap, turned_half_extents
from coverdrive.paths import PredictedPaths
from coverdrive.planning.check.evaluate import write_slack
from coverdrive.planning.check.merit import merit
from coverdrive.planning.problem.obstacles import FAR, obstacles_of
from coverdrive.planning.problem.vehicle import step
from coverdrive.planning.surroundings import Surroundings
from coverdrive.reporting.drives.active_constraints import clearances

NOBODY = np.zeros((0, 13, 2)), np.zeros(0, int), np.zeros((0, 13, 2)), DT


def clear_and_touching(first: int, scenes: int, plans: int) -> tuple[int, int]:
    """Of plans in random scenes: how many are called clear, and how many of these touch a box nevertheless."""
    states, inputs, points, half_sizes, clear = [], [], [], [], []
    for seed in range(first, first + scenes):
        rng = np.random.default_rng(seed)
        state, paths = scene(rng)
        got = evaluated(wishes(rng, plans), around(state, paths, OPEN))
        states.append(np.tile(state, (plans, 1)))
        inputs.append(fail_safe(got))
        points.append(np.tile(paths.points, (plans, 1, 1, 1)))
        half_sizes.append(np.tile(paths.half_sizes, (plans, 1, 1, 1)))
        clear.append(got.clear)
    chosen = np.concatenate(clear)
    state, driving, centres, sizes = (np.concatenate(each)[chosen] for each in (states, inputs, points, half_sizes))
    touching = np.zeros(len(state), bool)
    for parts, samples in WAYS:
        touching |= touches(driven(state, driving, parts)[1], centres, sizes, samples)
    return len(touching), int(touching.sum())


def test_what_is_called_clear_touches_nothing() -> None:
    clear, touching = clear_and_touching(0, 400, 4)
    assert touching == 0
    assert 160 < clear < 1440


@pytest.mark.slow
@pytest.mark.parametrize("begin", [1000, 26_000])
def test_what_is_called_clear_touches_nothing_in_many_scenes(begin: int) -> None:
    clear, touching = np.sum([clear_and_touching(begin + first, 500, 4) for first in range(0, 25_000, 500)], axis=0)
    assert touching == 0
    assert clear > 12_500


def test_samples_alone_would_miss_contacts() -> None:
    """The negative control: of plans whose states touch nothing, some do in between, and none of these is clear."""
    missed = 0
    for seed in range(120):
        rng = np.random.default_rng(seed)
        state, paths = scene(rng)
        got = evaluated(wishes(rng, 10), around(state, paths, OPEN))
        states = driven(state, fail_safe(got), 1)[1]
        seen, ever = (touches(states, paths.points, paths.half_sizes, samples) for samples in (1, 20))
        missing = ~seen & ever
        assert not (missing & got.clear).any()
        missed += missing.sum()
    assert missed > 8


def test_whoever_begins_in_contact_is_never_clear() -> None:
    begun = 0
    for seed in range(120):
        rng = np.random.default_rng(seed)
        state, paths = scene(rng, vehicles=1)
        start = paths.points[:, 0].copy()
        moved = state[:2] + rng.uniform(-1, 1, 2) * (CAR.half_sizes + paths.half_sizes[0, 0])
        paths = PredictedPaths(paths.points - start[:, None] + moved, paths.vehicle, paths.half_sizes, DT)
        upright = np.zeros(1)
        if boxes_overlap(state[:2], state[3], CAR.half_sizes, paths.points[:, 0], upright, paths.half_sizes[:, 0])[0]:
            begun += 1
            got = evaluated(wishes(rng, 10), around(state, paths, OPEN))
            assert not got.clear.any()
            assert (got.severity >= 0).all() and (got.harm > 0).all()
    assert begun > 40


def off_road(states: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """By how much [m] bodies (…, 4) are beyond the edges of the road."""
    extent = turned_half_extents(CAR.half_sizes, states[..., 3])[..., 1]
    return np.maximum(states[..., 1] + extent - edges[1], edges[0] - states[..., 1] + extent)


def test_clear_plans_do_not_leave_the_road() -> None:
    """The road is as wide as a lane, so that nearly all are near its edges."""
    nobody = PredictedPaths(*NOBODY)
    clear, nearest = 0, np.inf
    for seed in range(80):
        rng, edges = np.random.default_rng(seed), np.array([0.0, 3.6])
        state = np.array([0.0, rng.uniform(1.0, 2.6), rng.uniform(0, 45), rng.uniform(-0.02, 0.02)])
        inputs = wishes(rng, 10) * [1.0, rng.choice([0.02, 0.2, 1.0])]
        got = evaluated(inputs, around(state, nobody, edges))
        clear += got.clear.sum()
        np.testing.assert_array_equal(got.clear, got.departure == 0)
        for parts, samples in WAYS:
            beyond = off_road(sampled(driven(state, fail_safe(got), parts)[1], samples), edges)
            nearest = min(nearest, np.abs(beyond[got.clear]).min(initial=np.inf))
            assert beyond[got.clear].max(initial=-1.0) <= 0.01
            assert (beyond[got.departure > 2.0].max(-1) > 0).all()
    assert 80 < clear < 720
    assert nearest < 0.01


@pytest.mark.parametrize("speed", [15.0, 25.0, 40.0])
def test_whoever_turns_back_at_the_edge_of_the_road_does_not_leave_it_in_between(speed: float) -> None:
    """It is near the left edge after the first step, and turns to the right from then on as hard as it can."""
    nobody, edges, clear, turn = PredictedPaths(*NOBODY), np.array([-50.0, 3.6]), 0, min(0.5, 4 / speed)
    for heading in np.linspace(0.0, 0.03, 5):
        for gap in np.linspace(0, 0.05, 7):
            inputs = np.zeros((STEPS, 2))
            inputs[:3, 1] = -0.3 * turn, -turn, -turn
            state = np.array([0.0, 0.0, speed, heading])
            state[1] -= off_road(step(state, inputs[0], DT), edges) + gap
            got = evaluated(whole(inputs), around(state, nobody, edges))
            if got.clear[0]:
                clear += 1
                assert off_road(driven(state, fail_safe(got), 25)[1][0, 25:], edges).max() <= 1e-9
    assert clear > 4


def test_plans_are_driven_within_the_limits_and_cost_their_merit() -> None:
    rng, tree = np.random.default_rng(3), CONSTANTS.tree
    state, paths = scene(rng)
    surroundings, wanted = around(state, paths), wishes(rng, 6)
    got, start = evaluated(wanted, surroundings), np.array([0.0, *state[1:]])
    for i in range(6):
        for branch in (tree.drive, tree.fail_safe):
            states = rollout(start, got.inputs[i, branch], DT)
            np.testing.assert_allclose(got.states[i, branch], states[1:], atol=1e-9)
            np.testing.assert_allclose(got.inputs[i, branch], drive(start, wanted[i, branch][None])[1][0], atol=1e-12)
        assert got.cost[i] == merit(got.inputs[i], got.targets[i], surroundings, CONSTANTS).value


def test_only_the_fail_safe_branch_has_to_be_clear(straight_paths) -> None:
    """Behind a standing car, one branch goes on and the other brakes."""
    tree, paths = CONSTANTS.tree, straight_paths((50, 5.4, 0))
    inputs = np.zeros((2, len(tree.parent), 2))
    inputs[0, tree.fail_safe, 0] = inputs[1, tree.drive, 0] = -8.0
    got = evaluated(inputs, around(np.array([0.0, 5.4, 20.0, 0.0]), paths))
    np.testing.assert_array_equal(got.clear, [True, False])
    assert got.severity[1] == pytest.approx(18.0, abs=0.01)  # braked for the shared step only
    assert got.severity[0] == got.harm[0] == 0


@pytest.mark.parametrize("speed", [20.0, 40.0, 45.0])
@pytest.mark.parametrize("lon", np.arange(12.0, 40.0, 3.1))
def test_nothing_is_jumped_over(straight_paths, speed: float, lon: float) -> None:
    """A motorcycle stands in the lane: wherever the samples are, the slack sees it, and so does the contact."""
    paths = straight_paths((lon, 1.8, 0))
    paths.half_sizes[:] = [1.1, 0.4]
    surroundings = around(np.array([0, 1.8, speed, 0]), paths)
    got, slack = evaluated(np.zeros((1, len(CONSTANTS.tree.parent), 2)), surroundings), np.empty(STEPS)
    write_slack(rollout(np.array([0, 1.8, speed, 0]), np.zeros((STEPS, 2)), DT), surroundings, CONSTANTS, slack)
    assert slack.max() > 0.3
    assert not got.clear[0]
    assert got.severity[0] == pytest.approx(speed)


def test_severity_is_the_speed_at_the_first_contact(straight_paths) -> None:
    """Full braking from 20 m/s towards a standing car, 10 m before contact and what is spared: v² = 20² − 2·8·10."""
    paths = straight_paths((10.0 + 0.1 + 4.8, 1.8, 0))
    got = evaluated(whole(np.tile([-8.0, 0.0], (STEPS, 1))), around(np.array([0, 1.8, 20.0, 0]), paths))
    assert got.severity[0] == pytest.approx(np.sqrt(400 - 160), abs=0.15)


def test_severity_beyond_the_end_of_the_plan(straight_paths) -> None:
    """At 20 m/s and 10 m behind who goes at 5 m/s: braking from then on leaves v² = 15² − 2·8·10."""
    paths = straight_paths((60 + 4.8 + 10 - 15, 1.8, 5))
    got = evaluated(whole(np.zeros((STEPS, 2))), around(np.array([0, 1.8, 20.0, 0]), paths))
    assert not got.clear[0]
    assert got.severity[0] == pytest.approx(np.sqrt(225 - 160))


@pytest.mark.parametrize("heading", [0.0, 0.1])
def test_no_contact_is_lost_where_the_plan_ends(straight_paths, heading: float) -> None:
    """Wherever a standing car is, braking towards it from 45 m/s meets it during the plan or after it."""
    for lon in np.arange(95.0, 110.0, 0.05):
        inputs = whole(np.tile([-8.0, 0.0], (STEPS, 1)))
        state = np.array([0, 1.8 - np.sin(heading) * lon, 45.0, heading])
        got = evaluated(inputs, around(state, straight_paths((lon, 1.8, 0)), OPEN))
        assert got.severity[0] > 15.0


def test_a_contact_from_behind_does_little_harm_but_more_than_a_graze_ahead(straight_paths) -> None:
    """Nobody behind may brake, as in replay: at 15 m/s it is worse than to graze what is ahead."""
    state, straight = np.array([0, 1.8, 15.0, 0]), whole(np.zeros((STEPS, 2)))

    def harm(lon: float, speed: float) -> float:
        return float(evaluated(straight, around(state, straight_paths((lon, 1.8, speed)))).harm[0])

    ahead, behind, graze = harm(25.0, 0.0), harm(-25.0, 30.0), harm(7.0, 14.0)
    assert behind == pytest.approx(0.1 * ahead)
    assert graze < behind


@pytest.mark.parametrize(
    ("gap", "share"), [(1.05, 0.0), (0.95, 0.03), (0.7, 0.07), (0.45, 0.15), (0.2, 0.35), (-0.1, 1.0)]
)
@pytest.mark.parametrize("faster", [-3.0, 0.0, 3.0])
def test_harm_counts_how_deep_a_box_is_entered(straight_paths, gap: float, share: float, faster: float) -> None:
    """A car beside the ego: its box grows by 1 m to each side at once, towards the ego and away from it. Also where it
    is faster, it does not come from behind.
    """
    paths = straight_paths((0, 1.8 + 1.9 + gap, 20.0 + faster))
    paths.half_sizes[:, 1:, 1] += 1.0
    got = evaluated(whole(np.zeros((STEPS, 2))), around(np.array([0, 1.8, 20.0, 0]), paths))
    assert bool(got.clear[0]) is (share == 0)
    harm = share * (5.0 + abs(faster)) ** 4 / 20.0**3
    assert got.harm[0] == pytest.approx(harm, rel=0.04)  # a contact later counts less


@pytest.mark.parametrize(("depth", "share"), [(0.05, 0.7), (0.14, 0.7), (0.16, 1.0)])
def test_less_harm_is_expected_of_what_is_hardly_touched(straight_paths, depth: float, share: float) -> None:
    """A body beside the ego, 3 m/s faster."""
    paths = straight_paths((0, 1.8 + 1.9 - depth, 23.0))
    got = evaluated(whole(np.zeros((STEPS, 2))), around(np.array([0, 1.8, 20.0, 0]), paths))
    assert got.harm[0] > 0
    assert got.expected[0] == pytest.approx(share * got.harm[0], rel=1e-3)


@pytest.mark.parametrize(("depth", "deep"), [(0.1, False), (0.3, True)])
def test_less_harm_is_expected_of_what_is_hardly_touched_beyond_the_end(straight_paths, depth: float, deep: bool):
    """A car at 5 m/s, 10 m ahead at the end of the plan, beside the ego but for a little: 15 cm deep it is slower."""
    paths = straight_paths((60 + 4.8 + 10 - 15, 1.8 + 1.9 - depth, 5))
    got = evaluated(whole(np.zeros((STEPS, 2))), around(np.array([0, 1.8, 20.0, 0]), paths))
    assert got.harm[0] > 0
    slower = (5 + np.sqrt(225 - 16 * 10.15)) / (5 + np.sqrt(225 - 16 * 10))
    assert got.expected[0] == pytest.approx((0.7 + 0.3 * deep * slower**4) * got.harm[0])


@pytest.mark.parametrize("speed", [5.0, 15.0])
def test_the_nearer_who_is_met_beyond_the_end_the_more_harm(straight_paths, speed: float) -> None:
    """The ego ends a plan at 20 m/s, from 10 m to a centimetre behind somebody who is slower."""
    harms = []
    for gap in (10.0, 1.0, 0.06, 0.04, 0.01):
        paths = straight_paths((60 + 4.8 + gap - 3 * speed, 1.8, speed))
        got = evaluated(whole(np.zeros((STEPS, 2))), around(np.array([0, 1.8, 20.0, 0]), paths))
        assert not got.clear[0] or gap == 10.0
        harms.append(float(got.harm[0]))
    assert harms == sorted(harms) and harms[-1] > harms[0] and harms[1] > 0


@pytest.mark.parametrize(("gap", "counts"), [(0.06, False), (0.04, True)])
def test_a_little_harm_is_done_by_who_comes_near(straight_paths, gap: float, counts: bool) -> None:
    """A post stands to the left of the ego, which is turned: in an upright box around it, but not in its body."""
    heading, post = 0.2, 0.2
    away = CAR.width / 2 + post * (np.sin(heading) + np.cos(heading)) + gap
    paths = straight_paths((-away * np.sin(heading), 5.0 + away * np.cos(heading), 0.0))
    paths.half_sizes[:] = post
    got = evaluated(whole(np.zeros((STEPS, 2))), around(np.array([0.0, 5.0, 0.0, heading]), paths))
    assert not got.clear[0] and got.severity[0] == 0
    assert bool(got.harm[0] > 0) is counts


def test_what_is_touched_now_is_whatever_the_ego_does(straight_paths) -> None:
    """Somebody at 25 m/s is in the ego's rear: who brakes at 8 m/s² is hit no harder than who goes on from 20 m/s."""
    state, paths = np.array([0, 1.8, 20.0, 0]), straight_paths((-4.0, 1.8, 25.0))
    for acceleration in (0.0, -8.0):
        got = evaluated(whole(np.tile([acceleration, 0.0], (STEPS, 1))), around(state, paths))
        assert got.severity[0] == pytest.approx(5.0)
        assert got.harm[0] == pytest.approx(0.1 * (5.0 + 5.0) ** 4 / 20.0**3, rel=0.02)


def test_who_is_hit_from_behind_brakes_on_before_who_stands(straight_paths) -> None:
    """Somebody at 25 m/s is in the ego's rear. From 20 m/s it stops after 25 m, or after 28.7 m if it brakes late."""
    state, paths, harm = np.array([0, 1.8, 20.0, 0]), straight_paths((-4.0, 1.8, 25.0), (28.69 + 4.65, 1.8, 0.0)), []
    for first in (-8.0, -2.0):
        inputs = np.tile([-8.0, 0.0], (STEPS, 1))
        inputs[0, 0] = first
        harm.append(float(evaluated(whole(inputs), around(state, paths)).harm[0]))
    assert harm[1] > 1.5 * harm[0]


def test_who_is_near_now_is_judged_by_how_the_ego_passes_a_step_later(straight_paths) -> None:
    """A post stands 4 cm to the left of the ego, which is turned: who brakes passes it more slowly."""
    heading, post = 0.2, 0.2
    away = CAR.width / 2 + post * (np.sin(heading) + np.cos(heading)) + 0.04
    paths = straight_paths((-away * np.sin(heading), 5.0 + away * np.cos(heading), 0.0))
    paths.half_sizes[:] = post
    for acceleration in (0.0, -8.0):
        inputs = whole(np.tile([acceleration, 0.0], (STEPS, 1)))
        got = evaluated(inputs, around(np.array([0.0, 5.0, 10.0, heading]), paths))
        speed = 10.0 + acceleration * DT
        assert got.severity[0] == 0
        assert got.harm[0] == pytest.approx(0.01 * (1 - 0.4 / STEPS) * (5.0 + speed) ** 4 / 20.0**3)


def test_harm_counts_what_is_likely_and_soon(straight_paths) -> None:
    """Two paths of a vehicle that stands in the lane, one of them with more weight."""
    state, straight, harm = np.array([0, 1.8, 20.0, 0]), whole(np.zeros((STEPS, 2))), []
    for rows, weight in (
        ([(20, 1.8, 0), (20, 9.0, 0)], [0.1, 0.9]),
        ([(20, 1.8, 0), (20, 9.0, 0)], [0.9, 0.1]),
        ([(50, 1.8, 0), (50, 9.0, 0)], [0.9, 0.1]),
        ([(12, 1.8, 15), (50, 9.0, 0)], [0.9, 0.1]),
    ):
        paths = straight_paths(*rows)
        paths = PredictedPaths(paths.points, np.zeros(2, int), paths.half_sizes, DT, weight=np.array(weight))
        got = evaluated(straight, around(state, paths))
        assert not got.clear[0]
        harm.append(float(got.harm[0]))
    rare, soon, late, slow = harm
    assert soon == pytest.approx(9 * rare)
    assert 0 < slow < late < soon


def test_slack_is_that_of_the_definition_where_nothing_is_passed() -> None:
    """Boxes stand wherever they are, so wide that none is passed within a step."""
    rng = np.random.default_rng(3)
    points = np.repeat(rng.uniform([0, 0], [50, 11], (6, 1, 2)), 13, axis=1)
    paths = PredictedPaths(points, np.arange(6), np.repeat(rng.uniform(3, 4, (6, 1, 2)), 13, axis=1), DT)
    state = np.array([0.0, 2.0, 12.0, 0.04])
    surroundings = around(state, paths)
    for inputs in fail_safe(evaluated(wishes(rng, 10), surroundings)):
        states, slack = rollout(state, inputs, DT), np.empty(STEPS)
        write_slack(states, surroundings, CONSTANTS, slack)
        values = clearances(states, obstacles_of(paths, PROBLEM.obstacles)[0], CAR, PROBLEM.obstacles)
        asked = smallest_slack(values, PROBLEM.obstacles.margin) - PROBLEM.obstacles.margin
        np.testing.assert_allclose(slack, np.maximum(0, asked), rtol=1e-9, atol=1e-9)
        assert slack.max() > 0


def test_a_car_beside_another_of_its_speed_needs_no_more_room_than_its_body() -> None:
    """Neither moves against the other: a gap of a millimetre is clear, none is not."""
    for gap, clear in ((0.001, True), (-0.001, False)):
        box = np.zeros((7, 13, 1))
        box[0, :, 0], box[1] = 5.0 * np.arange(13), 5.4 - 1.9 - gap
        box[2], box[3], box[4], box[6] = 2.4, 0.95, FAR, 1.0
        surroundings = Surroundings(np.array([0.0, 5.4, 20.0, 0.0]), np.zeros(2), between(0.0, 10.8), WANTED, box, box)
        assert bool(evaluated(whole(np.zeros((STEPS, 2))), surroundings).clear[0]) is clear


def test_the_body_has_to_be_on_the_road_by_the_end_of_the_first_step() -> None:
    nobody = PredictedPaths(*NOBODY)
    for lat, departure in ((0.5, 12 * 0.45), (0.94, 12 * 0.01), (0.96, 0.0)):
        got = evaluated(whole(np.zeros((STEPS, 2))), around(np.array([0, lat, 9.0, 0.0]), nobody))
        assert got.departure[0] == pytest.approx(departure)
        assert bool(got.clear[0]) is (departure == 0)
