"""How fast the ego comes up to who is far slower: worked out by hand, and driven."""

import math

import numpy as np
import pytest

from coverdrive.planning.planner import MpcPlanner
from coverdrive.planning.problem.vehicle import step
from coverdrive.planning.rules.approach import approach
from coverdrive.planning.rules.leaders import leaders_of
from coverdrive.road import Road
from merging import drawn, driven

SPEED, ROAD = 30.0, Road.straight(2)


def wanted(paths, lanes: tuple[int, ...] = (0, 1)) -> float:
    """By an ego at 30 m/s in the right lane at 0 m."""
    state = np.array([0.0, 1.8, SPEED, 0.0])
    return approach(state, paths, ROAD, list(lanes), leaders_of(state, 2.4, paths, ROAD))


@pytest.mark.parametrize("slower", [0.0, 10.0])
@pytest.mark.parametrize("lanes", [(0,), (0, 1)])
def test_it_could_come_to_the_others_speed_calmly(straight_paths, slower: float, lanes: tuple[int, ...]) -> None:
    """After 1.5 s at 2 m/s², 8 m behind, however many lanes are as slow."""
    closing = wanted(straight_paths((100, 1.8, slower), (90, 5.4, slower)), lanes) - slower
    assert 1.5 * closing + closing**2 / (2 * 2.0) == pytest.approx(100 - 2.4 - 2.4 - 8)


def test_it_is_no_more_than_a_little_faster_than_those_beside(straight_paths) -> None:
    standing = 60, 1.8, 0
    assert wanted(straight_paths(standing, (-20, 5.4, 18), (100, 5.4, 20), (130, 5.4, 25))) == pytest.approx(22)
    assert wanted(straight_paths(standing, (-35, 5.4, 18))) == math.inf  # they are behind
    assert wanted(straight_paths(standing, (0, 5.4, 20)), (0,)) < 15  # cannot go there


def test_of_a_queue_in_all_lanes_the_farther_end_counts(straight_paths) -> None:
    closing = wanted(straight_paths((90, 1.8, 0), (150, 5.4, 0)))
    assert 1.5 * closing + closing**2 / (2 * 2.0) == pytest.approx(150 - 2.4 - 2.4 - 8)


@pytest.mark.parametrize("beside", [-10.0, 100.0])
def test_from_rest_it_gets_out_beside_somebody_who_stands(straight_paths, beside: float) -> None:
    planner, state = MpcPlanner(), np.array([0.0, 1.8, 0.0, 0.0])
    planner.reset(0.1)
    for _ in range(90):
        paths = straight_paths((20, 1.8, 0), (beside, 5.4, 0))
        state = step(state, planner.plan(state, paths, ROAD).applied(0.1), 0.1)
    assert state[0] > 40


def test_nobody_far_slower_is_ahead(straight_paths) -> None:
    beside = 10, 5.4, 20
    assert wanted(straight_paths((60, 1.8, 16), beside)) == math.inf
    assert wanted(straight_paths((60, 1.8, 14), beside)) < SPEED
    assert wanted(straight_paths((-60, 1.8, 0), (60, 5.4, 0))) == math.inf


def test_it_brakes_less_hard_for_who_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    scenes = [drawn(seed, standing=True) for seed in range(8)]
    calm = [driven(scene, MpcPlanner()).hardest for scene in scenes]
    monkeypatch.setattr("coverdrive.planning.planner.approach", lambda *_: math.inf)
    assert np.mean(calm) < np.mean([driven(scene, MpcPlanner()).hardest for scene in scenes]) - 1
