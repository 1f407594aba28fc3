"""Dynamic programming against NumPy's solution of the same problem in all inputs at once."""

import numpy as np
import pytest

from coverdrive.planning.course import changes_of, course_of
from coverdrive.planning.riccati import Stages, minimiser

DT = 0.25


@pytest.mark.parametrize("steps", [1, 2, 12])
@pytest.mark.parametrize("share_held", [0.0, 0.3])
def test_minimiser_solves_the_dense_system(steps: int, share_held: float) -> None:
    random = np.random.default_rng(steps)
    course = course_of(np.array([0.0, 2.0, 22.0, 0.04]), random.normal(0, 0.2, 2 * steps), DT)
    roots, of_change = random.normal(size=(steps, 4, 4)), (0.2, 50.0)
    own = random.uniform(0.1, 1.0, 2 * steps)
    stages = Stages(
        by_state=random.normal(size=(steps, 4)),
        by_states=roots @ roots.swapaxes(1, 2),
        by_input=random.normal(size=2 * steps),
        by_inputs=own + np.repeat(of_change, steps),
        of_change=of_change,
    )
    held = random.uniform(size=2 * steps) < share_held
    by = np.stack([changes_of(course, change, DT) for change in np.eye(2 * steps)], axis=-1)
    change = np.kron(np.eye(2), np.eye(steps) - np.eye(steps, k=-1))
    hessian = np.diag(own) + change.T @ (np.repeat(of_change, steps)[:, None] * change)
    hessian += np.einsum("kfu,kfg,kgv->uv", by, stages.by_states, by)
    gradient = stages.by_input + np.einsum("kf,kfu->u", stages.by_state, by)
    expected, free = np.zeros(2 * steps), ~held
    expected[free] = np.linalg.solve(hessian[np.ix_(free, free)], -gradient[free])
    np.testing.assert_allclose(minimiser(stages, held, course, DT), expected, rtol=1e-9, atol=1e-12)
