"""The smallest ball around segments, wherever its centre is.

In coordinates in which the norm is the maximum over t of the Euclidean length, it has the smallest enclosing disc of
the points at every t, each decided by at most three points (Welzl 1991). They are found together: the point farthest
outside enters in place of one that no longer matters, so that the radius grows until nothing is outside.
"""

from itertools import combinations

import numpy as np
from jaxtyping import Float, Int

_STEPS = 200
_ROUNDING = 1e-9
_TWO = np.array(list(combinations(range(4), 2)))
_THREE = np.array(list(combinations(range(4), 3)))
_MEMBERS = np.concatenate([_TWO[:, [0, 1, 1]], _THREE])
"""(10, 3): which of four points lie on the boundary of a disc through two or three of them"""


def enclosing_ball(
    points: Float[np.ndarray, "n T 2"], enough: float = np.inf
) -> tuple[Float[np.ndarray, "T 2"], float]:
    """Centre of the smallest ball around at least one scaled segment, and the distance of the farthest from there.

    The search may end as soon as the smallest ball is known to have a radius above ``enough``.
    """
    times = np.arange(points.shape[1])
    support = np.zeros((len(times), 3), dtype=np.int64)
    farthest = np.zeros(len(times), dtype=np.int64)
    centre, outside = points[0], np.zeros(len(times))
    for _ in range(_STEPS):
        corners = np.column_stack([support, farthest])
        centre, squared, disc = _disc_around_four(points[corners, times[:, None]])
        support = np.take_along_axis(corners, _MEMBERS[disc], axis=1)
        away = squared_length(points - centre)
        farthest = away.argmax(0)
        outside = away[farthest, times]
        if squared.max() > enough**2 or (outside <= squared * (1 + _ROUNDING)).all():
            break
    return centre, float(np.sqrt(outside.max()))


def squared_length(vectors: Float[np.ndarray, "*batch 2"]) -> Float[np.ndarray, "*batch"]:
    """Of vectors in the plane."""
    return vectors[..., 0] ** 2 + vectors[..., 1] ** 2


def _disc_around_four(
    corners: Float[np.ndarray, "T 4 2"],
) -> tuple[Float[np.ndarray, "T 2"], Float[np.ndarray, " T"], Int[np.ndarray, " T"]]:
    """Centre and squared radius of the smallest discs around four points, and which of the ten possible ones it is."""
    middle = (corners[:, _TWO[:, 0]] + corners[:, _TWO[:, 1]]) / 2
    centres = np.concatenate([middle, _equally_far(*(corners[:, column] for column in _THREE.T))], axis=1)
    squared = squared_length(centres[:, :, None] - corners[:, None]).max(-1)
    best = squared.argmin(1)
    every = np.arange(len(corners))
    return centres[every, best], squared[every, best], best


def _equally_far(
    first: Float[np.ndarray, "T 4 2"], second: Float[np.ndarray, "T 4 2"], third: Float[np.ndarray, "T 4 2"]
) -> Float[np.ndarray, "T 4 2"]:
    """Centres of the circles through three points; the first point where there is none."""
    u, v = second - first, third - first
    cross = 2 * (u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])
    along, across = squared_length(u), squared_length(v)
    offset = np.stack([v[..., 1] * along - u[..., 1] * across, u[..., 0] * across - v[..., 0] * along], axis=-1)
    return first + np.divide(offset, cross[..., None], out=np.zeros_like(offset), where=cross[..., None] != 0)
