"""A smaller cover by base trajectories that need not be segments (beyond paper §2.1).

A base is taken away, and the segments that now no base covers are given, one after the other, to other bases. Those may
move: a base has to cover what it alone covers, so that it can take another segment if the smallest ball around both
still has a radius of at most ε. If something is left over, the base comes back around it, and has less to cover the
next time. The search works on few segments, at first those that the fewest bases cover; segments that its result leaves
uncovered join them until there are none, which is decided on all segments, in double precision.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from coverdrive.prediction.cover.enclosing import enclosing_ball, squared_length
from coverdrive.prediction.cover.greedy import CAUTION, MIRROR, greedy_order, with_mirror_images, within

_FIRST = 20_000
"""Segments that the search begins with"""
_HOSTS = 12
"""Bases that are asked to take a segment, the nearest first"""
_LEFT_OVER = 5
"""A base stays as soon as more segments than this find no other one"""
_PATIENCE = 3
"""Rounds without progress before the search ends"""


def free_centres(
    scaled: Float[np.ndarray, "N T 2"],
    centres: Float[np.ndarray, "M T 2"],
    radius: float,
    seed: int = 0,
    symmetric: bool = False,
) -> Float[np.ndarray, "L T 2"]:
    """As many base trajectories as ``centres`` or fewer that cover all segments, in the order of greedy choice.

    The rest is as in `greedy_cover`; the seed is of the order in which bases are tried.
    """
    reach = radius * (1 - 2 * CAUTION)
    random = np.random.default_rng(seed)
    known = np.argsort(_times_covered(scaled, centres, reach, symmetric) + random.random(len(scaled)))[:_FIRST]
    best = centres
    while True:
        search = _Search(scaled[known], best, reach, symmetric)
        search.improve(random)
        while len(missing := _uncovered(scaled, search.centres, reach, symmetric)):
            known = np.concatenate([known, missing])
            search = _Search(scaled[known], search.centres, reach, symmetric)
            search.cover_all()
        if _size(search.centres, symmetric) >= _size(best, symmetric):
            return best if best is centres else best[greedy_order(best, scaled, radius, symmetric)]
        best = search.centres


class _Search:
    """A cover of n segments by balls that move."""

    def __init__(
        self, points: Float[np.ndarray, "n T 2"], centres: Float[np.ndarray, "M T 2"], radius: float, symmetric: bool
    ):
        self._points = points
        self._radius = radius
        self._symmetric = symmetric
        self._balls = {base: (centre, self._inside(centre)) for base, centre in enumerate(centres)}
        self._times = np.sum([inside for _, inside in self._balls.values()], axis=0)

    @property
    def centres(self) -> Float[np.ndarray, "L T 2"]:
        """Of the balls."""
        return np.stack([centre for centre, _ in self._balls.values()])

    def improve(self, random: np.random.Generator) -> None:
        """Try to do without every ball in turn, until several rounds bring nothing."""
        idle = 0
        while idle < _PATIENCE:
            before = len(self._balls)
            for base in random.permutation(list(self._balls)).tolist():
                if len(self._balls) > 1:
                    self._do_without(base)
            idle = 0 if len(self._balls) < before else idle + 1
        if self._symmetric:
            self._straighten()

    def cover_all(self) -> None:
        """Let balls take the segments that none covers, and add balls for the others."""
        left = self._give_away(len(self._points))
        while len(left):
            self._put(max(self._balls) + 1, self._points[left[0]])
            left = self._give_away(len(self._points))

    def _do_without(self, base: int) -> None:
        """Take a ball away, or leave it what no other one takes."""
        centre, inside = self._balls.pop(base)
        self._times -= inside
        left = self._give_away(_LEFT_OVER)
        if len(left):
            self._put(base, enclosing_ball(self._images(left, centre))[0])

    def _straighten(self) -> None:
        """Let balls that can be their own mirror image be that: one base trajectory then takes the place of two."""
        for base, (_, inside) in list(self._balls.items()):
            own = self._points[inside & (self._times == 1)]
            if len(own):
                middle, radius = enclosing_ball(np.concatenate([own, own * MIRROR]), self._radius)
                if radius <= self._radius:
                    self._times -= inside
                    self._put(base, middle * [1.0, 0.0])

    def _give_away(self, most: int) -> Int[np.ndarray, " left"]:
        """Let balls take the uncovered segments; those left over, at once if more than ``most`` are."""
        bases = list(self._balls)
        free = np.flatnonzero(self._times == 0)
        apart = np.stack([self._distance(free, base) for base in bases], axis=1)
        left: list[int] = []
        while len(free) and len(left) <= most:
            hardest = apart.min(1).argmax()
            for host in np.argsort(apart[hardest])[:_HOSTS].tolist():
                if apart[hardest, host] <= 2 * self._radius and self._take(int(free[hardest]), bases[host]):
                    apart[:, host] = self._distance(free, bases[host])
                    break
            else:
                left.append(int(free[hardest]))
                apart, free = np.delete(apart, hardest, axis=0), np.delete(free, hardest)
            waiting = self._times[free] == 0
            apart, free = apart[waiting], free[waiting]
        remaining = np.array([*left, *free], dtype=np.int64)
        return remaining[self._times[remaining] == 0]

    def _take(self, segment: int, base: int) -> bool:
        """Move a ball so that it covers a segment as well, if it can."""
        centre, inside = self._balls[base]
        own = np.flatnonzero(inside & (self._times == 1))
        moved, radius = enclosing_ball(self._images(np.append(segment, own), centre), self._radius)
        if radius > self._radius:
            return False
        self._times -= inside
        self._put(base, moved)
        return True

    def _put(self, base: int, centre: Float[np.ndarray, "T 2"]) -> None:
        inside = self._inside(centre)
        self._times += inside
        self._balls[base] = (centre, inside)

    def _inside(self, centre: Float[np.ndarray, "T 2"]) -> Bool[np.ndarray, " n"]:
        return _distance(self._points, centre, self._symmetric) <= self._radius

    def _distance(self, segments: Int[np.ndarray, " k"], base: int) -> Float[np.ndarray, " k"]:
        return _distance(self._points[segments], self._balls[base][0], self._symmetric)

    def _images(self, segments: Int[np.ndarray, " k"], centre: Float[np.ndarray, "T 2"]) -> Float[np.ndarray, "k T 2"]:
        """Segments, or those mirror images of them that are nearer to the centre."""
        points = self._points[segments]
        if not self._symmetric:
            return points
        mirrored = _distance(points * MIRROR, centre) < _distance(points, centre)
        return np.where(mirrored[:, None, None], points * MIRROR, points)


def _size(centres: Float[np.ndarray, "M T 2"], symmetric: bool) -> int:
    """Number of base trajectories, with mirror images if symmetric."""
    return len(with_mirror_images(centres)) if symmetric else len(centres)


def _times_covered(
    scaled: Float[np.ndarray, "N T 2"], centres: Float[np.ndarray, "M T 2"], radius: float, symmetric: bool
) -> Int[np.ndarray, " N"]:
    """In how many balls every segment is, but for single precision."""
    points = jnp.asarray(scaled, dtype=jnp.float32)
    around = np.concatenate([centres, centres * MIRROR]) if symmetric else centres
    return np.sum([np.asarray(within(centre[None], points, radius))[0] for centre in around], axis=0)


def _uncovered(
    scaled: Float[np.ndarray, "N T 2"], centres: Float[np.ndarray, "M T 2"], radius: float, symmetric: bool
) -> Int[np.ndarray, " k"]:
    """Which segments are in no ball."""
    left = np.arange(len(scaled))
    for centre in centres:
        left = left[_distance(scaled[left], centre, symmetric) > radius]
    return left


def _distance(
    points: Float[np.ndarray, "n T 2"], centre: Float[np.ndarray, "T 2"], symmetric: bool = False
) -> Float[np.ndarray, " n"]:
    """From segments, or from the nearer of their mirror images, to a centre."""
    apart = np.sqrt(squared_length(points - centre).max(-1))
    return np.minimum(apart, _distance(points, centre * MIRROR)) if symmetric else apart
