"""Steps of the descent against a quadratic program solver, and the descent against what it promises."""

import numpy as np
import piqp
import pytest

from coverdrive.planning.constants import constants_of
from coverdrive.planning.descent import _step, descend
from coverdrive.planning.merit import Model, Surroundings, input_bounds, merit
from coverdrive.planning.problem import ProblemSettings

CONSTANTS = constants_of(ProblemSettings())


def crowded(seed: int) -> tuple[np.ndarray, Surroundings]:
    """Inputs and surroundings of a car among eight moving boxes."""
    rng = np.random.default_rng(seed)
    state = np.array([0.0, rng.uniform(1.5, 9.3), rng.uniform(10, 30), rng.uniform(-0.05, 0.05)])
    boxes = np.empty((5, 12, 8))
    boxes[0] = rng.uniform(-20, 60, 8) + rng.uniform(5, 8, 8) * np.arange(12)[:, None]
    boxes[1], boxes[2], boxes[3] = rng.choice([1.8, 5.4, 9.0], 8), 2.6, 1.1
    boxes[4] = 1e5
    boxes[4, -1] = 20.0
    inputs = rng.normal(0, np.repeat([1.0, 0.02], 12))
    return inputs, Surroundings(state, np.zeros(2), np.array([0.0, 10.8]), boxes)


def optimum(inputs: np.ndarray, model: Model, damping: float, around: Surroundings) -> np.ndarray:
    """The step by PIQP, with one variable for every violation."""
    low, high = input_bounds(inputs, around.state, CONSTANTS)
    constraints = len(model.excess)
    whole = np.tril(model.smooth) + np.tril(model.smooth, -1).T + damping * np.diag(np.diag(model.smooth))
    cost = 2 * np.block([[whole, np.zeros((24, constraints))], [np.zeros((constraints, 24)), np.diag(model.weight)]])
    slope = 2 * np.concatenate([model.slope, np.zeros(constraints)])
    rows = np.hstack([model.normal, -np.eye(constraints)])
    bounds = (
        np.concatenate([low - inputs, np.zeros(constraints)]),
        np.concatenate([high - inputs, np.full(constraints, np.inf)]),
    )
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-9
    solver.setup(cost, slope, None, None, rows, None, -model.excess, *bounds)
    assert solver.solve() == piqp.PIQP_SOLVED
    return solver.result.x[:24]


def quadratic(step: np.ndarray, model: Model, damping: float) -> float:
    whole = np.tril(model.smooth) + np.tril(model.smooth, -1).T + damping * np.diag(np.diag(model.smooth))
    violated = np.maximum(0, model.excess + model.normal @ step)
    return float(step @ whole @ step + 2 * model.slope @ step + (model.weight * violated**2).sum())


@pytest.mark.parametrize("seed", range(25))
@pytest.mark.parametrize("damping", [1e-3, 1.0])
def test_a_step_solves_its_quadratic_problem(seed: int, damping: float) -> None:
    inputs, around = crowded(seed)
    low, high = input_bounds(inputs, around.state, CONSTANTS)
    inputs = np.clip(inputs, low, high)
    model = merit(inputs, 5.4, around, CONSTANTS)
    step, promised = _step(inputs, model, damping, around, CONSTANTS)
    best = optimum(inputs, model, damping, around)
    start, got, least = (quadratic(each, model, damping) for each in (np.zeros(24), step, best))
    assert got <= least + 0.1 * (start - least) + 2e-3 * model.value
    assert promised == pytest.approx(start - quadratic(step, model, 0.0), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("seed", range(10))
def test_the_merit_never_rises(seed: int) -> None:
    inputs, around = crowded(seed)
    starts, target = np.stack([inputs, np.zeros(24)]), np.array([1.8, 5.4])
    before = np.inf
    for iterations in (0, 1, 2, 4, 8, 16):
        value = descend(starts, target, np.zeros(2), around, CONSTANTS, iterations, 1e-6).value
        assert (value <= before).all()
        before = value
    assert (before < descend(starts, target, np.zeros(2), around, CONSTANTS, 0, 1e-6).value).any()
