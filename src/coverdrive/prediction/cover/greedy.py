"""Greedy set cover: few base trajectories such that every segment is ε-close to one of them (paper §2.1).

Coverage is submodular, so that greedy choice needs at most ln N + 1 times as many bases as the optimum. It is lazy
(Minoux 1978): counts can only fall, so that a candidate whose recounted gain still leads is the best. Candidates are a
seeded random sample of the segments, then of those still uncovered. At the end, choices that later ones have made
superfluous are left out.
"""

from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int, UInt64

from coverdrive.progress import done

_CHUNK = 256
_WORD = 64

CAUTION = 1e-5
"""Share of ε that is given away, so that single precision never claims a cover that double precision denies"""


def greedy_cover(
    scaled: Float[np.ndarray, "N T 2"], radius: float, candidates: int = 4096, seed: int = 0
) -> Int[np.ndarray, " M"]:
    """Indices of few segments such that every one is within ε of a chosen one, in order; none can be left out.

    The norm of ``scaled`` segments is the maximum over t of the Euclidean length. Greedy choice picks from so many
    candidates at a time, drawn by the seed.
    """
    points = np.asarray(scaled, dtype=np.float32)
    reach = radius * (1 - CAUTION)
    random = np.random.default_rng(seed)
    remaining = np.arange(len(scaled))
    chosen: list[int] = []
    while len(remaining):
        pool = np.sort(random.permutation(remaining)[:candidates])
        covers = _coverage(points[pool], points[remaining], reach)
        uncovered = _pack(np.ones((1, len(remaining)), dtype=bool))[0]
        for index in _lazy_greedy(covers, uncovered):
            chosen.append(int(pool[index]))
            done(len(scaled) - int(np.bitwise_count(uncovered).sum()), len(scaled))
        remaining = remaining[np.unpackbits(uncovered.view(np.uint8), count=len(remaining)).astype(bool)]
    picked = np.array(chosen, dtype=np.int64)
    covers = _coverage(points[picked], points, reach)
    return picked[_needed(np.unpackbits(covers.view(np.uint8), axis=1, count=len(scaled)).astype(bool))]


def _needed(covers: Bool[np.ndarray, "M N"]) -> Bool[np.ndarray, " M"]:
    """Which bases stay if, from the last to the first, those are left out whose segments others cover as well."""
    times = covers.sum(0)
    kept = np.ones(len(covers), dtype=bool)
    for base in reversed(range(len(covers))):
        if (times[covers[base]] > 1).all():
            kept[base] = False
            times -= covers[base]
    return kept


def _lazy_greedy(covers: UInt64[np.ndarray, "C words"], uncovered: UInt64[np.ndarray, " words"]) -> Iterator[int]:
    """Yield candidates by marginal gain until none has any; clears what they cover from ``uncovered`` in place."""
    gains = np.array([np.bitwise_count(row & uncovered).sum() for row in covers], dtype=np.int64)
    while True:
        best = int(gains.argmax())
        if gains[best] == 0:
            return
        gain = np.bitwise_count(covers[best] & uncovered).sum()
        if gain == gains[best]:
            uncovered &= ~covers[best]
            gain = 0
            yield best
        gains[best] = gain


def _coverage(
    pool: Float[np.ndarray, "C T 2"], segments: Float[np.ndarray, "R T 2"], radius: float
) -> UInt64[np.ndarray, "C words"]:
    """Which members cover which segments; their number is rounded up, so that few shapes have to be compiled."""
    nowhere = np.full((-len(segments) % _WORD, *segments.shape[1:]), np.inf, dtype=np.float32)
    padded = np.concatenate([segments, nowhere])
    rows = [_pack(np.asarray(within(pool[i : i + _CHUNK], padded, radius))) for i in range(0, len(pool), _CHUNK)]
    return np.concatenate(rows)


@jax.jit
def within(
    pool: Float[Array, "C T 2"], segments: Float[Array, "R T 2"], radius: Float[Array, ""]
) -> Bool[Array, "C R"]:
    """Which segments are within ``radius`` of which members of a pool."""
    inside = jnp.ones((pool.shape[0], segments.shape[0]), dtype=bool)
    for t in range(pool.shape[1]):
        apart = pool[:, None, t] - segments[None, :, t]
        inside &= apart[..., 0] ** 2 + apart[..., 1] ** 2 <= radius**2
    return inside


def _pack(flags: Bool[np.ndarray, "C R"]) -> UInt64[np.ndarray, "C words"]:
    padding = -flags.shape[1] % _WORD
    return np.packbits(np.pad(flags, ((0, 0), (0, padding))), axis=1).view(np.uint64)
