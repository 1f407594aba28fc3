"""Steps of the descent against a quadratic program solver."""

import numpy as np
import piqp
import pytest

from coverdrive.planning.constants import constants_of
from coverdrive.planning.course import changes_of
from coverdrive.planning.merit import Model, Surroundings, input_bounds, merit
from coverdrive.planning.problem import ProblemSettings
from coverdrive.planning.quadratic import best_step

CONSTANTS = constants_of(ProblemSettings())


def dense(model: Model, damping: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Half the second and half the first derivatives of the cost, and those of the constraints, by all inputs."""
    by = np.stack([changes_of(model.course, change, CONSTANTS.dt) for change in np.eye(24)], axis=-1)
    cost = CONSTANTS.cost
    weight = CONSTANTS.weight[:, None] * np.array([0.0, cost.lane, cost.speed, cost.heading])
    change = np.kron(np.eye(2), np.eye(12) - np.eye(12, k=-1))
    of_change = np.repeat([cost.acceleration_change, cost.yaw_rate_change], 12)
    whole = np.diag(np.repeat([cost.acceleration, cost.yaw_rate], 12)) + change.T @ (of_change[:, None] * change)
    whole += np.einsum("kfu,kf,kfv->uv", by, weight, by) + damping * np.diag(model.curvature)
    slope = model.by_input + np.einsum("kf,kfu->u", model.by_state, by)
    return whole, slope, np.einsum("cf,cfu->cu", model.normal, by[model.step])


def optimum(inputs: np.ndarray, model: Model, damping: float, around: Surroundings) -> np.ndarray:
    """The step by PIQP, with one variable for every violation."""
    low, high = input_bounds(inputs, around.state, CONSTANTS)
    constraints = len(model.excess)
    whole, slope, normal = dense(model, damping)
    cost = 2 * np.block([[whole, np.zeros((24, constraints))], [np.zeros((constraints, 24)), np.diag(model.weight)]])
    rows = np.hstack([normal, -np.eye(constraints)])
    bounds = (
        np.concatenate([low - inputs, np.zeros(constraints)]),
        np.concatenate([high - inputs, np.full(constraints, np.inf)]),
    )
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-9
    solver.setup(
        cost, 2 * np.concatenate([slope, np.zeros(constraints)]), None, None, rows, None, -model.excess, *bounds
    )
    assert solver.solve() == piqp.PIQP_SOLVED
    return solver.result.x[:24]


def quadratic(step: np.ndarray, model: Model, damping: float) -> float:
    whole, slope, normal = dense(model, damping)
    violated = np.maximum(0, model.excess + normal @ step)
    return float(step @ whole @ step + 2 * slope @ step + (model.weight * violated**2).sum())


@pytest.mark.parametrize("seed", range(25))
@pytest.mark.parametrize("damping", [1e-3, 1.0])
def test_a_step_solves_its_quadratic_problem(crowded, seed: int, damping: float) -> None:
    inputs, around = crowded(seed)
    low, high = input_bounds(inputs, around.state, CONSTANTS)
    inputs = np.clip(inputs, low, high)
    model = merit(inputs, 5.4, around, CONSTANTS)
    step, promised = best_step(inputs, model, damping, around, CONSTANTS)
    best = optimum(inputs, model, damping, around)
    start, got, least = (quadratic(each, model, damping) for each in (np.zeros(24), step, best))
    assert got <= least + 0.1 * (start - least) + 2e-3 * model.value
    assert promised == pytest.approx(start - quadratic(step, model, 0.0), rel=1e-6, abs=1e-6)
