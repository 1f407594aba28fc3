"""What motions are worth, against plain NumPy code and by hand."""

import numpy as np
import pytest

from coverdrive.planning.constants import constants_of
from coverdrive.planning.cost import plan_cost
from coverdrive.planning.evaluate import evaluate, evaluated, surroundings_of
from coverdrive.planning.obstacles import FAR, Obstacles, clearances, smallest_slack
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.vehicle import feasible_inputs, rollout

PROBLEM = ProblemSettings()
CONSTANTS = constants_of(PROBLEM)
EDGES = (0.0, 10.8)


def standing(lon: float, lat: float, steps: int, speed: float = FAR) -> Obstacles:
    moments = steps + 1
    return Obstacles(
        np.tile([lon, lat], (moments, 1, 1)), np.tile([2.4, 0.95], (moments, 1, 1)), np.full((moments, 1), speed),
        np.zeros((moments, 1)), np.ones((moments, 1)),
    )  # fmt: skip


def situation_of(state: list[float], obstacles: Obstacles) -> Situation:
    return Situation(np.array(state), np.zeros(2), EDGES, obstacles)


def test_agrees_with_numpy() -> None:
    """Obstacles stand still, so that nothing is looked at between the steps."""
    rng = np.random.default_rng(3)
    centres, half_sizes = (
        np.repeat(rng.uniform(*ends, (1, 6, 2)), 13, axis=0) for ends in (([0, 0], [50, 11]), (3, 4))
    )
    obstacles = Obstacles(centres, half_sizes, np.full((13, 6), 15.0), np.zeros((13, 6)), np.ones((13, 6)))
    situation = Situation(np.array([0.0, 2.0, 12.0, 0.04]), np.array([-0.5, 0.02]), EDGES, obstacles)
    wishes = np.concatenate([rng.normal(0, 6, (5, 12)), rng.normal(0, 0.3, (5, 12))], axis=1)
    got = evaluate(wishes, np.full(5, 5.4), surroundings_of(situation), constants_of(PROBLEM))
    driven, states = np.swapaxes(got.inputs.reshape(5, 2, 12), 1, 2), got.states
    np.testing.assert_allclose(rollout(states[:, 0], driven, 0.25), states, atol=1e-9)
    wanted = np.swapaxes(wishes.reshape(5, 2, 12), 1, 2)
    np.testing.assert_allclose(feasible_inputs(states[:, :-1], wanted, 0.25, PROBLEM.vehicle), driven, atol=1e-12)
    values = clearances(states, obstacles, PROBLEM.vehicle, PROBLEM.obstacles)
    slack = smallest_slack(values, PROBLEM.obstacles.margin)
    np.testing.assert_allclose(got.slack, slack, rtol=1e-9, atol=1e-9)
    off_road = got.off_road
    cost = plan_cost(states, driven, slack, off_road, situation.previous_input, 5.4, PROBLEM.cost)
    np.testing.assert_allclose(got.cost, cost, rtol=1e-9)
    harm = 1 + np.abs(states[:, 1:, 2]) / 20  # all boxes stand
    lasting = np.maximum.accumulate(slack * harm, axis=1)
    cost = plan_cost(states, driven, lasting, off_road, situation.previous_input, 5.4, PROBLEM.cost)
    np.testing.assert_allclose(got.lasting_cost, cost, rtol=1e-9)
    assert slack.max() > 0
    assert off_road.max() > 0


def test_distance_off_the_road_by_hand() -> None:
    nothing = Obstacles(*(np.zeros(shape) for shape in ((3, 0, 2), (3, 0, 2), (3, 0), (3, 0), (3, 0))))
    two, target = ProblemSettings(steps=2), np.array([1.8])
    motion = evaluated(np.zeros((1, 2, 2)), target, situation_of([0, 0.5, 9, 0], nothing), constants_of(two))[0]
    np.testing.assert_allclose(motion.off_road, [0.95 + 0.05 - 0.5] * 2)
    assert motion.departure == pytest.approx(2 * 0.45)
    assert not motion.clear
    np.testing.assert_array_equal(motion.slack, 0.0)
    assert evaluated(np.zeros((1, 2, 2)), target, situation_of([0, 0.96, 9, 0], nothing), constants_of(two))[0].clear


def test_slack_lasts_in_the_comparison() -> None:
    """Through a standing car at 20 m/s: in contact for some steps, counted from the first one on, twofold."""
    problem = ProblemSettings(steps=6)
    situation = situation_of([0, 1.8, 20, 0], standing(10.0, 1.8, 6))
    motion = evaluated(np.zeros((1, 6, 2)), np.array([1.8]), situation, constants_of(problem))[0]
    np.testing.assert_array_equal(motion.slack > 0, [True, True, True, False, False, False])
    weights = problem.cost.slack_weights(6)
    worst_so_far = np.maximum.accumulate(motion.slack * (1 + 20 / 20))
    extra = (weights * (worst_so_far**2 - motion.slack**2)).sum()
    assert motion.lasting_cost == pytest.approx(float(motion.cost) + extra)
    assert extra > 0


@pytest.mark.parametrize("speed", [20.0, 40.0, 45.0])
@pytest.mark.parametrize("lon", np.arange(12.0, 40.0, 1.7))
def test_nothing_is_jumped_over(speed: float, lon: float) -> None:
    """A motorcycle stands in the lane: wherever the samples are, the slack sees it, and so does the contact."""
    obstacles = standing(lon, 1.8, 12)._replace(half_sizes=np.tile([1.1, 0.4], (13, 1, 1)))
    motion = evaluated(
        np.zeros((1, 12, 2)), np.array([1.8]), situation_of([0, 1.8, speed, 0], obstacles), constants_of(PROBLEM)
    )[0]
    assert motion.slack.max() > 0.3
    assert not motion.clear
    assert motion.severity == pytest.approx(speed)


def test_severity_is_the_speed_at_the_first_contact_of_an_exact_motion() -> None:
    """Full braking from 20 m/s towards a standing car, 10 m before contact and what is spared: v² = 20² − 2·8·10."""
    gap = 10.0 + 0.1
    obstacles, inputs = standing(gap + 4.8, 1.8, 12), np.tile([-8.0, 0.0], (1, 12, 1))
    motion = evaluated(inputs, np.array([1.8]), situation_of([0, 1.8, 20, 0], obstacles), CONSTANTS)[0]
    assert motion.severity == pytest.approx(np.sqrt(400 - 160), abs=0.15)


def test_severity_beyond_the_end_of_the_plan() -> None:
    """At 20 m/s and 10 m behind who goes at 5 m/s: braking from then on leaves v² = 15² − 2·8·10."""
    steps, end = 12, 60.0
    lon = end + 4.8 + 10.1 - 5.0 * 0.25 * np.arange(steps, -1, -1)
    centres = np.stack([lon, np.full(13, 1.8)], axis=-1)[:, None]
    speed = np.full((13, 1), FAR)
    speed[-1] = 5.0
    obstacles = standing(0, 0, steps)._replace(centres=centres, speed=speed)
    motion = evaluated(
        np.zeros((1, 12, 2)), np.array([1.8]), situation_of([0, 1.8, 20, 0], obstacles), constants_of(PROBLEM)
    )[0]
    assert not motion.clear
    assert motion.severity == pytest.approx(np.sqrt(225 - 160))


def test_whoever_begins_in_contact_is_not_clear() -> None:
    """It leaves the box within the first step."""
    centres = np.tile([-4.0, 1.8], (13, 1, 1)) - 40.0 * 0.25 * np.arange(13)[:, None, None] * [1.0, 0.0]
    obstacles = standing(0, 0, 12)._replace(centres=centres)
    motion = evaluated(
        np.zeros((1, 12, 2)), np.array([1.8]), situation_of([0, 1.8, 20, 0], obstacles), constants_of(PROBLEM)
    )[0]
    np.testing.assert_array_equal(motion.slack, 0.0)
    assert not motion.clear
    assert motion.severity == pytest.approx(60.0)
