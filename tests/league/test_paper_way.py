"""The paper's way, a baseline: plans that obey its program, and no input if that fails."""

from types import ModuleType

import numpy as np
import pytest

from coverdrive.plan import Planner, Status
from coverdrive.planning.problem.cost import CostSettings
from coverdrive.planning.problem.obstacles import ObstacleSettings
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.road import Road

STATE = np.array([0.0, 1.8, 20.0, 0.0])


@pytest.fixture
def paper_way() -> ModuleType:
    pytest.importorskip("casadi", reason="needs the extra reference")
    from coverdrive.league import paper_way

    return paper_way


@pytest.fixture
def planner(paper_way: ModuleType) -> Planner:
    planner = paper_way.PaperPlanner(ProblemSettings(), lane_change=10.0)
    planner.reset(0.25)
    assert isinstance(planner, Planner)
    return planner


def test_a_plan_around_a_standing_car_obeys_the_program(planner, paper_way, straight_paths) -> None:
    plan = planner.plan(STATE, straight_paths((40, 1.8, 0)), Road.straight())
    assert plan.status is Status.SOLVED
    assert plan.slack.max() < paper_way.NEGLIGIBLE
    for k in range(12):
        lon, lat = plan.states[k + 1, :2]
        assert ((lon - 40) / 4.8) ** 2 + ((lat - 1.8) / 1.9) ** 2 + plan.slack[k] >= 1 - 1e-6
    assert np.abs(plan.states[:, 0] - 40).min() < 4.8  # it is beside the car, not behind it
    speed, heading = plan.states[:-1, 2], plan.states[:-1, 3]
    rates = np.stack([speed * np.cos(heading), speed * np.sin(heading), *plan.inputs.T], axis=-1)
    np.testing.assert_allclose(np.diff(plan.states, axis=0), 0.25 * rates, atol=1e-6)
    assert (plan.inputs >= np.array([-8, -0.5]) - 1e-6).all()
    assert (plan.inputs <= np.array([3, 0.5]) + 1e-6).all()
    assert (plan.states[1:, 1] >= 0.95 - 1e-6).all()
    assert (plan.states[1:, 1] <= 10.8 - 0.95 + 1e-6).all()
    weights, (_, lat, speed, heading) = CostSettings(), plan.states[1:].T
    factor = np.where(np.arange(12) == 11, weights.terminal, 1.0)
    changes = np.diff(plan.inputs, axis=0, prepend=0.0)
    applied = [weights.acceleration, weights.yaw_rate] @ (plan.inputs**2).sum(axis=0)
    changed = [weights.acceleration_change, weights.yaw_rate_change] @ (changes**2).sum(axis=0)
    errors = weights.speed * (speed - weights.reference_speed) ** 2 + weights.heading * heading**2
    costs = [
        factor @ (errors + weights.lane * (lat - centre) ** 2) + applied + changed for centre in Road.straight().centres
    ]
    assert np.abs(np.array(costs) + weights.slack_weights(12) @ plan.slack**2 - plan.cost).min() < 1e-3


def test_a_car_that_moves_in_euler_steps_overtakes_a_slower_one(planner, straight_paths) -> None:
    state, other = np.array([0.0, 1.8, 25.0, 0.0]), 20.0
    for _ in range(12):
        plan = planner.plan(state, straight_paths((other, 1.8, 12)), Road.straight())
        assert plan.status is Status.SOLVED
        state, other = plan.states[1], other + 3
    assert state[0] > other + 5


@pytest.mark.parametrize(("price", "changes"), [(0.0, True), (1e6, False)])
def test_a_dear_lane_change_is_not_made(paper_way, straight_paths, price, changes) -> None:
    slower = straight_paths((10, 1.8, 12), (30, 1.8, 12))
    plan = paper_way.PaperPlanner(ProblemSettings(), lane_change=price).plan(STATE, slower, Road.straight())
    assert (plan.states[-1, 1] > 5) == changes  # the next lane's centre is at 5.4 m


def test_no_input_where_the_solver_fails(planner, paper_way, straight_paths, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(paper_way, "solve_paper_program", lambda *_: None)
    plan = planner.plan(STATE, straight_paths((12, 1.8, 0)), Road.straight())
    assert plan.status is Status.UNSAFE
    np.testing.assert_array_equal(plan.inputs, 0.0)
    np.testing.assert_allclose(plan.states[:, 0], 5.0 * np.arange(13))
    inside = 1 - np.array([2 / 4.8, 3 / 4.8]) ** 2  # 10 m and 15 m ahead
    np.testing.assert_allclose(plan.slack, [0, *inside, *np.zeros(9)])
    free = planner.plan(STATE, straight_paths(), Road.straight())
    assert free.status is Status.UNSAFE


def test_no_input_where_there_is_no_way_to_stay_on_the_road(planner, straight_paths) -> None:
    plan = planner.plan(np.array([0.0, 9.7, 20.0, 0.2]), straight_paths(), Road.straight())
    assert plan.status is Status.UNSAFE
    np.testing.assert_array_equal(plan.inputs, 0.0)


def test_a_second_attempt_does_without_the_last_plan(
    planner, paper_way, straight_paths, monkeypatch: pytest.MonkeyPatch
) -> None:
    solve, starts = paper_way.solve_paper_program, []

    def only_from_nothing(situation, target_lat, start, problem):
        starts.append(start)
        return None if start.any() else solve(situation, target_lat, start, problem)

    monkeypatch.setattr(paper_way, "solve_paper_program", only_from_nothing)
    first = planner.plan(STATE, straight_paths(), Road.straight())
    second = planner.plan(first.states[1], straight_paths(), Road.straight())
    assert second.status is Status.SOLVED
    lanes = 2
    assert len(starts) == lanes + 2 * lanes
    np.testing.assert_allclose(starts[lanes][:-1], first.inputs[1:], atol=1e-9)


def test_the_vehicle_behind_counts_unless_it_is_ignored(paper_way, straight_paths) -> None:
    behind, found = straight_paths((-8, 1.8, 30), (12, 1.8, 20), (0, 5.4, 20)), []
    for ignored in (False, True):
        problem = ProblemSettings(obstacles=ObstacleSettings(ignore_rear=ignored))
        plan = paper_way.PaperPlanner(problem, lane_change=10.0).plan(STATE, behind, Road.straight())
        found.append(plan.status)
    assert found == [Status.UNSAFE, Status.SOLVED]
