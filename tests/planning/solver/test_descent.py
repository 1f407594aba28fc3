"""The descent against what it promises."""

import numpy as np
import pytest
from planning_scenes import CONSTANTS, STEPS

from coverdrive.planning.check.evaluate import empty_plans
from coverdrive.planning.check.merit import input_bounds, merit
from coverdrive.planning.solver.search import GO_ON, Wanted, search
from coverdrive.planning.surroundings import Surroundings


def descended(
    starts: np.ndarray, targets: np.ndarray, around: Surroundings, iterations: int, tolerance: float = 1e-6
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Inputs of starts after so many steps, their merits, and whether the cheapest has arrived.

    As a search lets them descend, which is compiled anyway: beside a plan that is clear.
    """
    lanes, plans = np.zeros(len(starts) - 1), empty_plans(len(starts) + 1, starts.shape[1])
    wanted = Wanted(lanes, 0, np.zeros(max(1, len(lanes))), np.zeros((len(lanes), *starts.shape[1:])),
                    np.zeros((STEPS, 2)), np.zeros(0))  # fmt: skip
    plans.inputs[1:], plans.targets[1:], plans.clear[0] = starts, targets, True
    arrived = search(GO_ON, plans, wanted, around, CONSTANTS, iterations, tolerance)[1]
    ends = plans.inputs[1:]
    pairs = zip(ends, targets, strict=True)
    return ends, np.array([merit(end, target, around, CONSTANTS).value for end, target in pairs]), arrived


def test_the_merit_never_rises_and_mostly_falls(crowded) -> None:
    fallen, targets = 0, np.array([[1.8, 1.8], [5.4, 1.8]])
    for seed in range(10):
        inputs, around = crowded(seed)
        starts = np.stack([inputs, np.zeros_like(inputs)])
        first = before = descended(starts, targets, around, 0)[1]
        for iterations in (1, 2, 4, 8, 16):
            ends, values, _ = descended(starts, targets, around, iterations)
            assert (values <= before).all()
            before = values
        fallen += (before < 0.9 * first).any()
        for end in ends:
            low, high = input_bounds(end, around, CONSTANTS)
            assert (end >= low - 1e-9).all() and (end <= high + 1e-9).all()
    assert fallen >= 8


def test_a_plan_that_has_arrived_stays(crowded) -> None:
    inputs, around = crowded(0)
    end, value, arrived = descended(inputs[None], targets := np.array([[5.4, 5.4]]), around, 500, 1e-9)
    assert arrived
    again, same, _ = descended(end, targets, around, 20, 1e-9)
    np.testing.assert_allclose(again, end, atol=1e-3)
    assert same[0] == pytest.approx(value[0], rel=1e-6)
