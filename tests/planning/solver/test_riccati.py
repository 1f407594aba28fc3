"""Dynamic programming over trees against NumPy's solution of the same problem in all inputs at once."""

import numpy as np
import pytest
from planning_scenes import DT

from coverdrive.planning.problem.cost import CostSettings
from coverdrive.planning.problem.rollout import changes_of, rolled
from coverdrive.planning.problem.tree import BranchSettings, Tree, tree_of
from coverdrive.planning.solver.riccati import Stages, minimiser


def random_tree(rng: np.random.Generator, nodes: int) -> Tree:
    """A tree with any number of branches."""
    parent = np.array([-1, *(rng.integers(-1, n) for n in range(1, nodes))])
    single = tree_of(CostSettings(), BranchSettings(), nodes, nodes, DT)
    return single._replace(parent=parent, changes=rng.uniform(0.1, 50.0, (nodes, 2)))


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("nodes", [1, 2, 12, 23])
@pytest.mark.parametrize("share_held", [0.0, 0.3])
def test_minimiser_solves_the_dense_system(seed: int, nodes: int, share_held: float) -> None:
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, nodes)
    motion = rolled(np.array([0.0, 2.0, 22.0, 0.04]), rng.normal(0, 0.2, (nodes, 2)), tree, DT)
    roots, own = rng.normal(size=(nodes, 4, 4)), rng.uniform(0.1, 1.0, (nodes, 2))
    stages = Stages(
        by_state=rng.normal(size=(nodes, 4)),
        by_states=roots @ roots.swapaxes(1, 2),
        by_input=rng.normal(size=(nodes, 2)),
        by_inputs=own + tree.changes,
    )
    held = rng.uniform(size=(nodes, 2)) < share_held
    units = np.eye(2 * nodes).reshape(-1, nodes, 2)
    by = np.stack([changes_of(motion, unit, tree, DT) for unit in units], axis=-1)
    change = np.kron(np.eye(nodes) - (tree.parent[:, None] == np.arange(nodes)), np.eye(2))
    hessian = np.diag(own.ravel()) + change.T @ (tree.changes.ravel()[:, None] * change)
    hessian += np.einsum("nfu,nfg,ngv->uv", by, stages.by_states, by)
    gradient = stages.by_input.ravel() + np.einsum("nf,nfu->u", stages.by_state, by)
    expected, free = np.zeros(2 * nodes), ~held.ravel()
    expected[free] = np.linalg.solve(hessian[np.ix_(free, free)], -gradient[free])
    got = minimiser(stages, held, motion, tree, DT)
    np.testing.assert_allclose(got, expected.reshape(nodes, 2), rtol=1e-8, atol=1e-11)
