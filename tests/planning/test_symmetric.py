"""Symmetric systems against NumPy."""

import numpy as np
import pytest

from coverdrive.planning.symmetric import inner, solved, times


@pytest.mark.parametrize("size", [1, 2, 7, 24])
def test_solution_and_product_read_the_lower_part_alone(size: int) -> None:
    random = np.random.default_rng(size)
    root, right = random.normal(size=(size, size)), random.normal(size=size)
    matrix = root @ root.T + np.eye(size)
    lower = np.where(np.tri(size, dtype=bool), matrix, np.nan)
    np.testing.assert_allclose(times(lower, right), matrix @ right, rtol=1e-12)
    np.testing.assert_allclose(solved(lower.copy(), right.copy()), np.linalg.solve(matrix, right), rtol=1e-9)
    assert inner(right, root[0]) == pytest.approx(right @ root[0])
