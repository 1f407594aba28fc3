"""Candidates solve the problem with all boxes, whatever the solver saw first."""

import numpy as np
import pytest

import coverdrive.planning.candidates as candidates
from coverdrive.planning.candidates import CandidateSettings, cheapest_starts, solve_lane
from coverdrive.planning.obstacles import clearances, reachable_obstacles, smallest_slack
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.solvers import SolverSettings
from coverdrive.planning.vehicle import rollout

PROBLEM = ProblemSettings()
EXACT = SolverSettings(tolerance=1e-6)


@pytest.fixture
def crowded(straight_paths) -> Situation:
    rng = np.random.default_rng(2)
    rows = [(float(d), lat, 18 + rng.normal()) for d in (15, 30, 45) for lat in (1.8, 5.4, 9.0) for _ in range(7)]
    state = np.array([0.0, 5.4, 22.0, 0.0])
    obstacles = reachable_obstacles(state, straight_paths(*rows), PROBLEM.vehicle, PROBLEM.obstacles)
    assert obstacles.slots > 20
    return Situation(state, np.zeros(2), (0.0, 10.8), obstacles)


def test_seeing_few_boxes_first_gives_the_same_plan(crowded: Situation) -> None:
    start = cheapest_starts(crowded, [5.4], [], PROBLEM)[0]
    few = solve_lane(crowded, 5.4, start, "fatrop", PROBLEM, CandidateSettings(boxes=1, solver=EXACT))
    everything = solve_lane(crowded, 5.4, start, "fatrop", PROBLEM, CandidateSettings(boxes=64, solver=EXACT))
    assert few is not None
    assert everything is not None
    np.testing.assert_allclose(few.states, everything.states, atol=1e-2)
    assert few.cost == pytest.approx(float(everything.cost), rel=1e-4)


def test_candidate_is_consistent(crowded: Situation) -> None:
    start = cheapest_starts(crowded, [1.8], [], PROBLEM)[0]
    found = solve_lane(crowded, 1.8, start, "fatrop", PROBLEM, CandidateSettings())
    assert found is not None
    motion = found
    np.testing.assert_array_equal(motion.states, rollout(crowded.state, motion.inputs, PROBLEM.dt))
    values = clearances(motion.states, crowded.obstacles, PROBLEM.vehicle, PROBLEM.obstacles)
    np.testing.assert_array_equal(motion.slack, smallest_slack(values))
    assert motion.cost <= start.cost


def test_both_solvers_find_the_same_plan(crowded: Situation) -> None:
    start = cheapest_starts(crowded, [5.4], [], PROBLEM)[0]
    fast = solve_lane(crowded, 5.4, start, "fatrop", PROBLEM, CandidateSettings(solver=EXACT))
    robust = solve_lane(crowded, 5.4, start, "ipopt", PROBLEM, CandidateSettings(solver=EXACT))
    assert fast is not None
    assert robust is not None
    np.testing.assert_allclose(fast.states, robust.states, atol=1e-2)


@pytest.mark.parametrize("damage", ["nan", "teleport", "speeding"])
def test_a_lying_solver_is_not_believed(crowded: Situation, monkeypatch: pytest.MonkeyPatch, damage: str) -> None:
    solve = candidates.solve

    def lying(*args):
        solution = solve(*args)
        if solution is not None:
            if damage == "nan":
                solution[5] = np.nan
            elif damage == "teleport":
                solution[6:, 0] += 5.0
            else:
                solution[:, 4] = 10.0
        return solution

    monkeypatch.setattr(candidates, "solve", lying)
    start = cheapest_starts(crowded, [5.4], [], PROBLEM)[0]
    assert solve_lane(crowded, 5.4, start, "fatrop", PROBLEM, CandidateSettings()) is None


def test_former_plans_are_starts(crowded: Situation) -> None:
    start = cheapest_starts(crowded, [5.4], [], PROBLEM)[0]
    found = solve_lane(crowded, 5.4, start, "fatrop", PROBLEM, CandidateSettings())
    assert found is not None
    again = cheapest_starts(crowded, [5.4], [found.inputs], PROBLEM)[0]
    assert again.cost == pytest.approx(float(found.cost))
    assert again.cost < start.cost


def test_starts_of_several_lanes_are_those_of_each(crowded: Situation) -> None:
    former = [np.tile([1.0, 0.0], (12, 1)), np.tile([-3.0, 0.01], (12, 1))]
    together = cheapest_starts(crowded, [1.8, 5.4, 9.0], former, PROBLEM)
    for lat, start in zip([1.8, 5.4, 9.0], together, strict=True):
        alone = cheapest_starts(crowded, [lat], former, PROBLEM)[0]
        np.testing.assert_array_equal(start.states, alone.states)
        assert start.lasting_cost == pytest.approx(float(alone.lasting_cost))
