"""The search judges like the plain NumPy code, and finds what IPOPT finds."""

import numpy as np
import pytest

from coverdrive.planning.constants import constants_of
from coverdrive.planning.judge import judge
from coverdrive.planning.merit import Surroundings
from coverdrive.planning.motion import judged
from coverdrive.planning.obstacles import Obstacles
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.reference import ReferencePlanner
from coverdrive.planning.search import SearchSettings
from coverdrive.planning.vehicle import feasible_inputs, rollout
from coverdrive.road import Road

PROBLEM = ProblemSettings()


def test_judge_agrees_with_numpy() -> None:
    rng = np.random.default_rng(3)
    centres, half_sizes = rng.uniform([0, 0], [70, 11], (12, 6, 2)), rng.uniform(1, 3, (12, 6, 2))
    obstacles = Obstacles(centres, half_sizes, np.full((12, 6), 15.0))
    state, edges = np.array([0.0, 2.0, 22.0, 0.04]), (0.0, 10.8)
    boxes = np.concatenate([centres, half_sizes, obstacles.speed[..., None]], axis=-1).transpose(2, 0, 1)
    around = Surroundings(state, np.array([-0.5, 0.02]), np.array(edges), boxes)
    wishes = np.concatenate([rng.normal(0, 6, (5, 12)), rng.normal(0, 0.3, (5, 12))], axis=1)
    got = judge(wishes, np.full(5, 5.4), around, constants_of(PROBLEM))
    situation = Situation(state, around.previous_input, edges, obstacles)
    driven, states = np.swapaxes(got.inputs.reshape(5, 2, 12), 1, 2), got.states
    np.testing.assert_allclose(rollout(states[:, 0], driven, 0.25), states, atol=1e-9)
    wanted = np.swapaxes(wishes.reshape(5, 2, 12), 1, 2)
    np.testing.assert_allclose(feasible_inputs(states[:, :-1], wanted, 0.25, PROBLEM.vehicle), driven, atol=1e-12)
    expected = judged(states, driven, 5.4, situation, PROBLEM)
    for name in ("slack", "off_road", "cost", "lasting_cost"):
        np.testing.assert_allclose(getattr(got, name), getattr(expected, name), rtol=1e-9, atol=1e-9)
    assert expected.slack.max() > 0
    assert expected.off_road.max() > 0


@pytest.mark.parametrize(
    "rows",
    [
        [],
        [(30, 1.8, 15)],
        [(25, 1.8, 15), (10, 5.4, 18)],
        [(22, 1.8, 14), (25, 5.4, 14), (28, 9.0, 14)],
        [(40, 1.8, 15), (35, 5.4, 19), (80, 9, 18)],
    ],
)
def test_costs_no_more_than_the_reference(straight_paths, rows) -> None:
    state, paths = np.array([0.0, 1.8, 20.0, 0.0]), straight_paths(*rows)
    reference = ReferencePlanner().plan(state, paths, Road.straight())
    patient = PlannerSettings(search=SearchSettings(tolerance=1e-6), iterations=400, budget=10)
    plan = MpcPlanner(patient).plan(state, paths, Road.straight())
    assert plan.cost <= 1.01 * reference.cost
