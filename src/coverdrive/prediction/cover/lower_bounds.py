"""Lower bounds on the size of any ε-cover, which say how far a greedy one can be from the best (paper §2.1).

Packing: of points that are pairwise farther apart than 2ε, one ball of radius ε holds at most one, wherever its centre
is. Fractional packing: weights y ≥ 0 on the points such that no ball around one of them holds more than 1 in all; by
weak duality of linear programming, their sum bounds the number of such balls that a cover needs. That is tighter, and
holds for centres among the points only. N points of T samples each, in coordinates in which the norm is the maximum
over t of the Euclidean length.
"""

from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int
from scipy.optimize import linprog
from scipy.sparse import csr_array

from coverdrive.prediction.cover.greedy import within

_CHUNK = 256
_FIRST_ROWS = 256
_AT_A_TIME = 64
_TIGHT = 1.02
_ROUNDING = 1e-4


@dataclass(frozen=True)
class FractionalBound:
    """A proof that a cover by balls around points needs many: weights of the points ``rows``, at most 1 in a ball."""

    rows: Int[np.ndarray, " R"]
    weights: Float[np.ndarray, " R"]

    @property
    def value(self) -> float:
        """Sum of the weights: the number of balls at least."""
        return float(self.weights.sum())


def packing(points: Float[np.ndarray, "N T 2"], radius: float, seed: int = 0) -> Int[np.ndarray, " P"]:
    """Indices of points that are pairwise farther apart than 2ε, those with few neighbours in a seeded sample first.

    No cover by balls of radius ε has fewer than P of them, even if their centres may be anywhere.
    """
    single = jnp.asarray(points, dtype=jnp.float32)
    reach = 2 * radius + _slack(points, radius)
    sample = np.random.default_rng(seed).permutation(len(points))[:_CHUNK]
    neighbours = _held(sample, np.ones(len(sample)), single, reach)
    free = np.ones(len(points), dtype=bool)
    chosen: list[int] = []
    for index in np.argsort(neighbours, kind="stable"):
        if free[index]:
            chosen.append(int(index))
            free &= ~np.asarray(_ball(single, index, reach))
    return np.array(chosen, dtype=np.int64)


def fractional_bound(
    points: Float[np.ndarray, "N T 2"], radius: float, rounds: int = 100, seed: int = 0
) -> FractionalBound:
    """The best lower bound of all rounds on the size of a cover whose centres are among the points.

    A linear program finds the weights, on few points and against few centres; both are added where they are missing.
    Whatever it returns, the weights are then divided by the most that a ball around *any* point holds, so that the
    bound is proved after every round and does not depend on the accuracy of the solver. Balls are taken a little larger
    than ε, by more than single precision can err. The seed is of the points to begin with.
    """
    centres = jnp.asarray(points, dtype=jnp.float32)
    reach = radius + _slack(points, radius)
    rows = np.sort(np.random.default_rng(seed).permutation(len(points))[:_FIRST_ROWS])
    columns = rows
    best = FractionalBound(rows[:0], np.zeros(0))
    for _ in range(rounds):
        weights, shares = _solve(points, rows, columns, reach)
        held = _held(rows, weights, centres, reach)
        most = max(float(held.max()), 1.0) * (1 + _ROUNDING)
        if weights.sum() / most > best.value:
            best = FractionalBound(rows, weights / most)
        heavy = _spread(held, lambda centre: np.asarray(_ball(centres, centre, radius / 2)), above=_TIGHT)
        if len(np.setdiff1d(heavy, columns)):
            columns = np.union1d(columns, heavy)
            continue
        missing = 1 - _held(columns, shares, centres, reach)
        bare = _spread(missing, lambda point: np.asarray(_ball(centres, point, radius / 2)), above=_ROUNDING)
        if len(bare) == 0:
            break
        rows, columns = np.union1d(rows, bare), np.union1d(columns, bare)
    return best


def _solve(
    points: Float[np.ndarray, "N T 2"], rows: Int[np.ndarray, " R"], columns: Int[np.ndarray, " K"], radius: float
) -> tuple[Float[np.ndarray, " R"], Float[np.ndarray, " K"]]:
    """Weights of the points ``rows`` against the centres ``columns``, and the shares of a fractional cover."""
    held, centres = points[rows].astype(np.float32), points[columns].astype(np.float32)
    holds = np.array([(((held - centre) ** 2).sum(-1) <= radius**2).all(-1) for centre in centres], dtype=float)
    result = linprog(-np.ones(len(rows)), A_ub=csr_array(holds), b_ub=np.ones(len(columns)), method="highs")
    return np.maximum(result.x, 0), np.maximum(-result.ineqlin.marginals, 0)


def _held(
    rows: Int[np.ndarray, " R"], weights: Float[np.ndarray, " R"], points: Float[Array, "N T 2"], radius: float
) -> Float[np.ndarray, " N"]:
    """Weight of the points ``rows`` in the ball around every point."""
    total = np.zeros(len(points))
    used = np.flatnonzero(weights > 0)
    for start in range(0, len(used), _CHUNK):
        chunk = used[start : start + _CHUNK]
        padding = _CHUNK - len(chunk)
        padded = np.pad(weights[chunk], (0, padding)).astype(np.float32)
        total += np.asarray(_weigh(rows[np.pad(chunk, (0, padding))], padded, points, radius))
    return total


@jax.jit
def _weigh(
    rows: Int[Array, " R"], weights: Float[Array, " R"], points: Float[Array, "N T 2"], radius: Float[Array, ""]
) -> Float[Array, " N"]:
    return weights @ within(points[rows], points, radius)


@jax.jit
def _ball(points: Float[Array, "N T 2"], centre: Int[Array, ""], radius: Float[Array, ""]) -> Bool[Array, " N"]:
    return within(points[centre][None], points, radius)[0]


def _spread(
    values: Float[np.ndarray, " N"], near: Callable[[int], Bool[np.ndarray, " N"]], above: float
) -> Int[np.ndarray, " n"]:
    """Indices of the greatest values above a bound, none near another one."""
    left = values.copy()
    chosen: list[int] = []
    while len(chosen) < _AT_A_TIME and left.max() > above:
        chosen.append(int(left.argmax()))
        left[near(chosen[-1])] = above
        left[chosen[-1]] = above
    return np.array(chosen, dtype=np.int64)


def _slack(points: Float[np.ndarray, "N T 2"], radius: float) -> float:
    """More than single precision can err in a distance of about ε between the points."""
    return float(8 * np.finfo(np.float32).eps * np.abs(points).max() + 1e-5 * radius)
