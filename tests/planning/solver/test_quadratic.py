"""Steps of the descent against a quadratic program solver."""

import numpy as np
import piqp
import pytest
from planning_scenes import CONSTANTS

from coverdrive.planning.check.merit import Model, input_bounds, merit
from coverdrive.planning.problem.rollout import changes_of, curvature_of
from coverdrive.planning.solver.quadratic import best_step
from coverdrive.planning.surroundings import Surroundings

TREE = CONSTANTS.tree
NODES = len(TREE.parent)
TARGETS = np.array([5.4, 1.8])


def dense(model: Model, damping: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Half the second and half the first derivatives of the cost, and those of the constraints, by all inputs."""
    units = np.eye(2 * NODES).reshape(-1, NODES, 2)
    by = np.stack([changes_of(model.rollout, unit, TREE, CONSTANTS.dt) for unit in units], axis=-1)
    change = np.kron(np.eye(NODES) - (TREE.parent[:, None] == np.arange(NODES)), np.eye(2))
    matrix = np.diag(TREE.inputs.ravel()) + change.T @ (TREE.changes.ravel()[:, None] * change)
    matrix += np.einsum("nfu,nf,nfv->uv", by[:, 1:], TREE.errors, by[:, 1:])
    matrix += damping * np.diag(curvature_of(model.rollout, TREE, CONSTANTS.dt).ravel())
    slope = model.by_input.ravel() + np.einsum("nf,nfu->u", model.by_state, by)
    return matrix, slope, np.einsum("cf,cfu->cu", model.constraints.normal, by[model.constraints.node])


def optimum(inputs: np.ndarray, model: Model, damping: float, around: Surroundings) -> np.ndarray:
    """The step by PIQP, with one variable for every violation."""
    low, high = (bound.ravel() for bound in input_bounds(inputs, around, CONSTANTS))
    constraints, variables = len(model.constraints.excess), 2 * NODES
    matrix, slope, normal = dense(model, damping)
    nothing = np.zeros((variables, constraints))
    cost = 2 * np.block([[matrix, nothing], [nothing.T, np.diag(model.constraints.weight)]])
    rows = np.hstack([normal, -np.eye(constraints)])
    bounds = (
        np.concatenate([low - inputs.ravel(), np.zeros(constraints)]),
        np.concatenate([high - inputs.ravel(), np.full(constraints, np.inf)]),
    )
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-9
    solver.setup(
        cost,
        2 * np.concatenate([slope, np.zeros(constraints)]),
        None,
        None,
        rows,
        None,
        -model.constraints.excess,
        *bounds,
    )
    assert solver.solve() == piqp.PIQP_SOLVED
    return solver.result.x[:variables].reshape(NODES, 2)


def quadratic(step: np.ndarray, model: Model, damping: float) -> float:
    matrix, slope, normal = dense(model, damping)
    violated, flat = np.maximum(0, model.constraints.excess + normal @ step.ravel()), step.ravel()
    return float(flat @ matrix @ flat + 2 * slope @ flat + (model.constraints.weight * violated**2).sum())


@pytest.mark.parametrize("damping", [1e-3, 1.0])
def test_steps_solve_their_quadratic_problems(crowded, damping: float) -> None:
    """All but a few, for which the Newton steps do not suffice; every step gains, as much as it promises."""
    solved = 0
    for seed in range(25):
        inputs, around = crowded(seed)
        inputs = np.clip(inputs, *input_bounds(inputs, around, CONSTANTS))
        low, high = input_bounds(inputs, around, CONSTANTS)  # of the yaw rate, at the speed that follows
        inputs = np.clip(inputs, low, high)
        model = merit(inputs, TARGETS, around, CONSTANTS)
        step, promised = best_step(model, damping, low - inputs, high - inputs, CONSTANTS)
        assert (inputs + step >= low - 1e-9).all() and (inputs + step <= high + 1e-9).all()
        best = optimum(inputs, model, damping, around)
        start, got, least = (quadratic(each, model, damping) for each in (np.zeros_like(step), step, best))
        assert least - 1e-6 * model.value <= got <= least + 0.5 * (start - least) + 2e-3 * model.value
        assert promised == pytest.approx(start - quadratic(step, model, 0.0), rel=1e-6, abs=1e-6)
        solved += got <= least + 0.1 * (start - least) + 2e-3 * model.value
    assert solved >= 24
