"""The braking manoeuvre brakes, stays in its lane and does not hide what it hits."""

import numpy as np
import pytest

from coverdrive.planning.fallback import blind_motion, braking_motion
from coverdrive.planning.obstacles import reachable_obstacles
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.vehicle import rollout

PROBLEM = ProblemSettings()


def situation(state: np.ndarray, paths) -> Situation:
    obstacles = reachable_obstacles(state, paths, PROBLEM.vehicle, PROBLEM.obstacles)
    return Situation(state, np.zeros(2), (0.0, 10.8), obstacles)


def test_stops_and_stays_stopped(straight_paths) -> None:
    state = np.array([0.0, 5.0, 10.0, 0.1])
    motion = braking_motion(situation(state, straight_paths()), 5.4, PROBLEM)
    np.testing.assert_allclose(motion.states[:6, 2], [10, 8, 6, 4, 2, 0], atol=1e-12)
    np.testing.assert_allclose(motion.states[6:, 2], 0.0, atol=1e-12)
    np.testing.assert_array_equal(motion.states, rollout(state, motion.inputs, PROBLEM.dt))
    np.testing.assert_array_equal(motion.slack, 0.0)


def test_returns_to_the_road_and_its_direction(straight_paths) -> None:
    state = np.array([0.0, 5.0, 40.0, -0.1])
    motion = braking_motion(situation(state, straight_paths()), 5.4, PROBLEM)
    assert abs(motion.states[-1, 3]) < 0.05
    assert abs(motion.states[-1, 1] - 5.4) < abs(motion.states[:, 1].min() - 5.4)


def test_slack_is_that_of_the_boxes_it_meets(straight_paths) -> None:
    state = np.array([0.0, 5.4, 20.0, 0.0])
    motion = braking_motion(situation(state, straight_paths((12.0, 5.4, 0.0))), 5.4, PROBLEM)
    distance = 12 - motion.states[1:, 0]
    alpha = PROBLEM.obstacles.longitudinal_inflation
    reach = alpha * (2.4 + 2.4 + 0.95 * 0.01)  # 0.01 rad smooth the heading, which stays 0
    np.testing.assert_allclose(motion.slack, np.maximum(0, 1 - (distance / reach) ** 4), atol=1e-9)
    assert motion.slack.max() > 0.9


def test_blind_motion_promises_nothing() -> None:
    motion = blind_motion(np.array([0.0, np.nan, 20.0, 0.0]), PROBLEM)
    np.testing.assert_array_equal(motion.slack, 1.0)
    np.testing.assert_array_equal(motion.inputs, np.tile([-8.0, 0.0], (12, 1)))
    assert motion.cost == pytest.approx(np.inf)
