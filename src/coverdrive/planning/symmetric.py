"""Symmetric systems of a few dozen unknowns in plain loops; of a matrix, the part on and below the diagonal counts."""

import numpy as np
from jaxtyping import Float

from coverdrive.planning.compiled import compiled


@compiled
def solved(system: Float[np.ndarray, "U U"], right: Float[np.ndarray, " U"]) -> Float[np.ndarray, " U"]:
    """Solution of a symmetric positive definite system by Cholesky's decomposition; both arguments are overwritten.

    The system is made LᵀL, from the last row to the first, so that all inner loops run along rows.

    Args:
        system: on and below the diagonal.
        right: right-hand side.
    """
    size = len(right)
    for j in range(size - 1, -1, -1):
        inverse = 1 / np.sqrt(system[j, j])
        for i in range(j):
            system[j, i] *= inverse
        for i in range(j):
            factor = system[j, i]
            for k in range(i + 1):
                system[i, k] -= factor * system[j, k]
        right[j] *= inverse
        for i in range(j):
            right[i] -= right[j] * system[j, i]
        system[j, j] = inverse
    for i in range(size):
        right[i] = (right[i] - inner(system[i, :i], right[:i])) * system[i, i]
    return right


@compiled
def times(lower: Float[np.ndarray, "U U"], values: Float[np.ndarray, " U"]) -> Float[np.ndarray, " U"]:
    """A symmetric matrix, of which only the part on and below the diagonal counts, times a vector."""
    result = np.empty(len(values))
    for i in range(len(values)):
        result[i] = inner(lower[i, : i + 1], values[: i + 1])
        for j in range(i):
            result[j] += lower[i, j] * values[i]
    return result


@compiled
def inner(first: Float[np.ndarray, " n"], second: Float[np.ndarray, " n"]) -> float:
    """The inner product of two vectors."""
    result = 0.0
    for i in range(len(first)):
        result += first[i] * second[i]
    return result
