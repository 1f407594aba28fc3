"""The descent against what it promises."""

import numpy as np
import pytest
from planning_scenes import CONSTANTS

from coverdrive.planning.check.merit import input_bounds, merit
from coverdrive.planning.solver.descent import descend


def test_the_merit_never_rises_and_mostly_falls(crowded) -> None:
    fallen, targets, extra = 0, np.array([[1.8, 1.8], [5.4, 1.8]]), np.zeros(2)
    for seed in range(10):
        inputs, around = crowded(seed)
        starts = np.stack([inputs, np.zeros_like(inputs)])
        first = before = descend(starts, targets, extra, around, CONSTANTS, 0, 1e-6).value
        for iterations in (1, 2, 4, 8, 16):
            found = descend(starts, targets, extra, around, CONSTANTS, iterations, 1e-6)
            assert (found.value <= before).all()
            before = found.value
        fallen += (before < 0.9 * first).any()
        for end, target, value in zip(found.inputs, targets, found.value, strict=True):
            assert merit(end, target, around, CONSTANTS).value == value
            low, high = input_bounds(end, around, CONSTANTS)
            assert (end >= low - 1e-9).all() and (end <= high + 1e-9).all()
    assert fallen >= 8


def test_a_plan_that_has_arrived_stays(crowded) -> None:
    inputs, around = crowded(0)
    targets, extra = np.array([[5.4, 5.4]]), np.zeros(1)
    end = descend(inputs[None], targets, extra, around, CONSTANTS, 500, 1e-9)
    assert end.done.all()
    again = descend(end.inputs, targets, extra, around, CONSTANTS, 20, 1e-9)
    np.testing.assert_allclose(again.inputs, end.inputs, atol=1e-3)
    assert again.value[0] == pytest.approx(end.value[0], rel=1e-6)
