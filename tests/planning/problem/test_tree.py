"""Trees of two branches by hand, what their steps cost, and how inputs are shifted in time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from planning_scenes import DT

from coverdrive.planning.problem.cost import CostSettings
from coverdrive.planning.problem.tree import BranchSettings, Tree, held_on, shift_of, tree_of

COST = CostSettings(
    lane=2,
    speed=3,
    heading=5,
    acceleration=7,
    yaw_rate=11,
    acceleration_change=13,
    yaw_rate_change=17,
    terminal=19,
    slack=23,
    slack_schedule=(4, 2, 1),
)
TREE = tree_of(COST, BranchSettings(comfort=0.5), 1, 3, DT)


def test_two_branches_by_hand() -> None:
    np.testing.assert_array_equal(TREE.parent, [-1, 0, 1, 0, 3])
    np.testing.assert_array_equal(TREE.moment, [1, 2, 3, 2, 3])
    np.testing.assert_array_equal(TREE.careful, [True, False, False, True, True])
    np.testing.assert_array_equal(TREE.safe, [False, False, False, True, True])
    np.testing.assert_array_equal(TREE.drive, [0, 1, 2])
    np.testing.assert_array_equal(TREE.fail_safe, [0, 3, 4])


def test_factors_by_hand() -> None:
    usual, last = np.array([2.0, 3.0, 5.0]), np.array([38.0, 57.0, 95.0])
    np.testing.assert_allclose(TREE.errors, [usual, usual, last, usual * [0.5, 0, 0.5], last * [0.5, 0, 0.5]])
    np.testing.assert_allclose(TREE.inputs, 3 * [[7, 11]] + 2 * [[3.5, 5.5]])
    np.testing.assert_allclose(TREE.changes, 3 * [[13, 17]] + 2 * [[6.5, 8.5]])
    np.testing.assert_allclose(TREE.slack, [92, 46, 23, 92, 92])


@pytest.mark.parametrize("shared", [1, 3, 6])
def test_curvatures_are_those_of_the_cost(shared: int) -> None:
    """The cost of inputs, speed and heading, summed node by node."""
    tree = tree_of(COST, BranchSettings(), shared, 6, DT)
    nodes = len(tree.parent)

    def cost(inputs: np.ndarray, i: int) -> float:
        value, error = 0.0, np.zeros(nodes)
        for n, p in enumerate(tree.parent):
            error[n] = DT * inputs[n] + (error[p] if p >= 0 else 0.0)
            change = inputs[n] - (inputs[p] if p >= 0 else 0.0)
            value += tree.inputs[n, i] * inputs[n] ** 2 + tree.changes[n, i] * change**2
            value += tree.errors[n, 1 + i] * error[n] ** 2
        return value

    least = []
    for i in range(2):
        alone = np.array([cost(unit, i) for unit in np.eye(nodes)])
        np.testing.assert_allclose(tree.curvature[:, i], alone)
        both = np.array([[cost(first + second, i) for first in np.eye(nodes)] for second in np.eye(nodes)])
        least.append(np.linalg.eigvalsh((both - alone - alone[:, None]) / 2).min())
    assert tree.least_curvature == pytest.approx(min(least))


def test_a_single_plan_keeps_clear_of_everything() -> None:
    tree = tree_of(COST, BranchSettings(fail_safe=False), 3, 3, DT)
    np.testing.assert_array_equal(tree.parent, [-1, 0, 1])
    assert tree.careful.all() and not tree.safe.any()
    np.testing.assert_array_equal(tree.drive, tree.fail_safe)


@pytest.mark.parametrize(
    ("period", "latency", "shared"), [(0.1, 0, 1), (0.25, 0, 1), (0.3, 0, 2), (0.1, 0.2, 2), (0.5, 1.0, 6), (5, 0, 12)]
)
def test_branches_share_the_steps_until_the_next_plan_is_driven(period: float, latency: float, shared: int) -> None:
    assert BranchSettings(latency=latency).shared(period, 12, 0.25) == shared
    assert BranchSettings(latency=latency, fail_safe=False).shared(period, 12, 0.25) == 12


def test_shift_by_part_of_a_step_by_hand() -> None:
    inputs = np.array([[1.0, 0.0], [2.0, 10.0], [5.0, 20.0]])
    np.testing.assert_allclose(held_on(3, 0.1, 0.25) @ inputs, [[1.4, 4], [3.2, 14], [5, 20]])
    np.testing.assert_allclose(held_on(3, 0.5, 0.25) @ inputs, [[5, 20]] * 3)


@given(st.floats(0, 4))
def test_a_shift_keeps_constant_inputs_and_what_they_sum_up_to(elapsed: float) -> None:
    shift = held_on(12, elapsed, 0.25)
    np.testing.assert_allclose(shift.sum(1), 1.0)
    assert shift.min() >= -1e-12
    kept = np.arange(12) >= np.ceil(elapsed / 0.25)  # all but the last go on for as long as before
    np.testing.assert_allclose(shift[:, kept].sum(0)[:-1], 1.0)


@pytest.mark.parametrize("elapsed", [0.1, 0.25, 0.6])
@pytest.mark.parametrize("shared", [1, 4, 12])
def test_both_branches_go_on_and_share_what_the_drive_branch_begins_with(elapsed: float, shared: int) -> None:
    tree: Tree = tree_of(COST, BranchSettings(), shared, 12, DT)
    inputs = np.random.default_rng(0).normal(size=(len(tree.parent), 2))
    later, single = shift_of(tree, elapsed, DT) @ inputs, held_on(12, elapsed, DT)
    np.testing.assert_allclose(later[tree.drive], single @ inputs[tree.drive])
    np.testing.assert_allclose(later[tree.safe], (single @ inputs[tree.fail_safe])[shared:])
