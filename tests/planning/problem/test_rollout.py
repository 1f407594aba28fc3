"""Where inputs lead to, and derivatives against finite differences."""

import numpy as np
import pytest
from planning_scenes import DT, rollout

from coverdrive.planning.problem.cost import CostSettings
from coverdrive.planning.problem.rollout import add_pulled_back, changes_of, curvature_of, rolled
from coverdrive.planning.problem.tree import BranchSettings, Tree, tree_of

STATE = np.array([0.0, 2.0, 22.0, 0.04])
TREES = [tree_of(CostSettings(), BranchSettings(), shared, 12, DT) for shared in (1, 5, 12)]


def inputs_of(tree: Tree) -> np.ndarray:
    return np.random.default_rng(1).normal(0, [3.0, 0.1], (len(tree.parent), 2))


def derivatives(tree: Tree) -> np.ndarray:
    """Of the states with respect to the inputs (N, 4, N, 2), by differences."""
    small, inputs = 1e-5, inputs_of(tree)
    result = np.empty((len(inputs), 4, len(inputs), 2))
    for at in np.ndindex(inputs.shape):
        nudge = np.zeros_like(inputs)
        nudge[at] = small
        ends = [rolled(STATE, inputs + sign * nudge, tree, DT).states for sign in (1, -1)]
        result[:, :, at[0], at[1]] = (ends[0] - ends[1]) / (2 * small)
    return result


@pytest.mark.parametrize("tree", TREES)
def test_each_branch_is_the_rollout_of_its_inputs(tree: Tree) -> None:
    inputs = inputs_of(tree)
    states = rolled(STATE, inputs, tree, DT).states
    for branch in (tree.drive, tree.fail_safe):
        np.testing.assert_allclose(states[branch], rollout(STATE, inputs[branch], DT)[1:], atol=1e-12)


@pytest.mark.parametrize("tree", TREES)
def test_changes_of_the_states(tree: Tree) -> None:
    inputs = inputs_of(tree)
    change = np.random.default_rng(2).normal(size=inputs.shape)
    got = changes_of(rolled(STATE, inputs, tree, DT), change, tree, DT)
    np.testing.assert_allclose(got, np.einsum("nfui,ui->nf", derivatives(tree), change), atol=1e-6)


@pytest.mark.parametrize("tree", TREES)
def test_pulling_back_is_the_transpose_of_changing(tree: Tree) -> None:
    rng, inputs = np.random.default_rng(3), inputs_of(tree)
    motion, by_state = rolled(STATE, inputs, tree, DT), rng.normal(size=(len(inputs), 4))
    before, change = rng.normal(size=inputs.shape), rng.normal(size=inputs.shape)
    got = before.copy()
    add_pulled_back(motion, by_state, tree, DT, got)
    along = (by_state * changes_of(motion, change, tree, DT)).sum()
    assert ((got - before) * change).sum() == pytest.approx(along, rel=1e-12)
    np.testing.assert_allclose(got - before, np.einsum("nf,nfui->ui", by_state, derivatives(tree)), atol=1e-6)


@pytest.mark.parametrize("tree", TREES)
def test_curvature_of_lat_is_nearly_that_of_its_derivatives(tree: Tree) -> None:
    """It leaves out half a step's way, which matters little but for the last nodes."""
    inputs = inputs_of(tree) * [1.0, 0.1]
    got = curvature_of(rolled(STATE, inputs, tree, DT), tree, DT) - tree.curvature
    exact = np.einsum("n,nui->ui", tree.errors[:, 0], derivatives(tree)[:, 1] ** 2)
    np.testing.assert_array_equal(got[:, 0], 0.0)
    assert (got[:, 1] <= 1.1 * exact[:, 1] + 1e-9).all()
    early = tree.moment <= 6
    assert (got[early, 1] > 0.7 * exact[early, 1]).all()
