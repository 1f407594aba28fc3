"""The random numbers of a path, kept: a path is a function of them, and whoever changes some of them changes the path.

Every number has its own place: the moment of the path, the call at this moment, the element of what the call asks for.
All are independent and uniform in [0, 1), so that to draw any of them anew leaves their law as it is; what was never
asked for is not drawn yet. This is the primary sample space of Kelemen et al., *A simple and robust mutation strategy
for the Metropolis light transport algorithm*, 2002.
"""

# pyright: reportIncompatibleMethodOverride=false

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr, ndtri

from coverdrive.errors import DataError

_LATE = 16
"""calls of moment 0, from its last one, whose numbers are changed one by one: a start that is drawn until the vehicles
fit ends with the draw that fits, and no change of the others is of use"""
_SEEDS = 2.0**53
"""as many seeds as a uniform number has values"""
_HIGHEST = np.nextafter(1.0, 0.0)
"""below 1"""

_BITS, _NAMED = 4, 24
"""of a uniform number, that name one of some whole numbers at the least, and in all"""

_UNUSED = np.random.PCG64(0)
"""that every tape has, and none draws from"""

Uniforms = Float[np.ndarray, "..."]


class Tape(np.random.Generator):
    """A generator whose numbers stay the same for the same place.

    Those of `random`, `uniform`, `normal`, `integers` and the like have a place for each element, so that one may
    change while the others stay; all that another method draws in a call comes from one number.
    """

    def __init__(
        self, values: Mapping[int, Sequence[Uniforms]] | None = None, random: np.random.Generator | None = None
    ):
        """Begin at moment 0.

        Args:
            values: numbers of every moment by call; none have been drawn if left out.
            random: draws those that are missing; without it, all must be there.
        """
        super().__init__(_UNUSED)
        self._values = {moment: list(calls) for moment, calls in (values or {}).items()}
        self._random, self._moment, self._call = random, 0, 0

    def turn(self, moment: int) -> None:
        """Go to the beginning of a moment; what the last one knew but did not ask for is forgotten."""
        if self._call:
            del self._values[self._moment][self._call :]
        self._moment, self._call = moment, 0

    def calls(self, moment: int) -> int:
        """Number of calls at a moment."""
        return len(self._values.get(moment, ()))

    def until(self, moment: int, random: np.random.Generator) -> "Tape":
        """The same before a moment; all else is not drawn yet."""
        return Tape({k: calls for k, calls in self._values.items() if k < moment}, random)

    def nudged(self, first: float, later: float, width: float, random: np.random.Generator, since: int = 0) -> "Tape":
        """The same with some of the numbers moved by about a width, up to 1: drawn anew.

        As normal numbers z they become √(1 − width²) z + width ξ (Neal, *Regression and classification using Gaussian
        process priors*, 1998), which leaves their law as it is, and moves those in a tail within it.

        In moment 0 only the last 16 calls may change; whether the same ones may change on the way back tells
        `reversible`.

        Args:
            first: share of the numbers of moment 0 that are moved.
            later: share of the others.
            width: of the moves.
            random: draws which, and how.
            since: moment before which none are moved.
        """

        def moved(value: Uniforms, share: float) -> Uniforms:
            picked = random.random(value.shape) < share
            by = math.sqrt(1 - width**2) * _quantile(value) + width * random.standard_normal(value.shape)
            return np.where(picked, np.minimum(ndtr(by), _HIGHEST), value)

        values = {
            k: calls
            if k < since
            else [moved(each, later) for each in calls]
            if k
            else [*calls[:-_LATE], *(moved(each, first) for each in calls[-_LATE:])]
            for k, calls in self._values.items()
        }
        return Tape(values, random)

    def reversible(self, other: "Tape") -> bool:
        """Whether at moment 0 the same numbers of two tapes may be nudged."""
        mine, theirs = self.calls(0), other.calls(0)
        return mine == theirs or max(mine, theirs) <= _LATE

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Everything on the tape by name."""
        places = [(moment, len(value)) for moment, calls in self._values.items() for value in calls]
        return {
            "places": np.reshape(np.array(places, dtype=int), (-1, 2)),
            "values": np.concatenate([np.zeros(0), *(each for calls in self._values.values() for each in calls)]),
        }

    @staticmethod
    def of(arrays: Mapping[str, np.ndarray]) -> "Tape":
        """The inverse of `arrays`; a drive that asks for other numbers is a DataError."""
        values = dict[int, list[Uniforms]]()
        places, ends = arrays["places"], np.cumsum(arrays["places"][:, 1])[:-1]
        parts = np.split(arrays["values"], ends) if len(places) else []
        for (moment, _), value in zip(places.tolist(), parts, strict=True):
            values.setdefault(moment, []).append(value)
        return Tape(values)

    def random(self, size: Any = None) -> Any:
        """Uniform in [0, 1)."""
        return self._uniforms(size)

    def uniform(self, low: Any = 0.0, high: Any = 1.0, size: Any = None) -> Any:
        """Uniform between two numbers."""
        return low + (np.asarray(high) - low) * self._uniforms(_shape(size, low, high))

    def standard_normal(self, size: Any = None) -> Any:
        """Normal, of mean 0 and deviation 1."""
        return _quantile(self._uniforms(size))

    def normal(self, loc: Any = 0.0, scale: Any = 1.0, size: Any = None) -> Any:
        """Normal."""
        return loc + np.asarray(scale) * self.standard_normal(_shape(size, loc, scale))

    def integers(
        self, low: Any, high: Any = None, size: Any = None, dtype: Any = np.int64, endpoint: bool = False
    ) -> Any:
        """Whole numbers, each as probable."""
        low, high = (0, low) if high is None else (low, high)
        shape = _shape(size, low, high)
        drawn = np.floor(low + (np.asarray(high) + endpoint - low) * self._uniforms(shape)).astype(dtype)
        return drawn if shape is not None else int(drawn)

    def choice(self, a: Any, size: Any = None, replace: bool = True, p: Any = None, axis: int = 0) -> Any:
        """Some of several; without replacement of one number."""
        if axis != 0 or not (replace or size is None):
            return self._seeded().choice(a, size, replace, p, axis)
        among = np.arange(a) if np.ndim(a) == 0 else np.asarray(a)
        if len(among) == 0:
            raise ValueError("nothing to choose from")
        whole = among.ndim == 1 and among.dtype.kind in "iu" and among.min() >= 0
        if p is None and size is None and whole and len(np.unique(among)) == len(among):
            return among[_settled(float(self._uniforms()), among)]
        ends = np.linspace(0.0, 1.0, len(among) + 1)[1:] if p is None else np.cumsum(p)
        return among[np.minimum(np.searchsorted(ends, self._uniforms(size), side="right"), len(among) - 1)]

    def permutation(self, x: Any, axis: int = 0) -> Any:
        """All of several in any order."""
        if axis != 0:
            return self._seeded().permutation(x, axis)
        among = np.arange(x) if np.ndim(x) == 0 else np.asarray(x)
        return among[np.argsort(self._uniforms(len(among)))]

    def _uniforms(self, shape: Any = None) -> Any:
        """The next call's numbers."""
        size = () if shape is None else (shape,) if isinstance(shape, int | np.integer) else tuple(shape)
        count, calls = math.prod(size), self._values.setdefault(self._moment, [])
        known = calls[self._call][:count] if self._call < len(calls) else np.zeros(0)
        if len(known) < count:
            if self._random is None:
                raise DataError(
                    f"the tape ends at moment {self._moment}: the drive is another one than when it was recorded; "
                    "drive it with the same version and settings"
                )
            known = np.concatenate([known, self._random.random(count - len(known))])
        calls[self._call : self._call + 1] = [known]
        self._call += 1
        return known.reshape(size) if size else float(known[0])

    def _seeded(self) -> np.random.Generator:
        """A generator for one call."""
        return np.random.default_rng(int(self._uniforms() * _SEEDS))


def _settled(uniform: float, among: np.ndarray) -> int:
    """Index of one of some different whole numbers, each as probable, that stays the same for most others of them.

    Parts of the uniform number name one after the other; the first one that is there is taken.
    """
    bits = max(_BITS, int(among.max()).bit_length())
    for _ in range(_NAMED // bits):
        name, uniform = divmod(uniform * (1 << bits), 1.0)
        if len(named := np.flatnonzero(among == name)):
            return int(named[0])
    return int(uniform * len(among))


def _shape(size: Any, *parameters: Any) -> Any:
    """Of what is drawn: the size that is asked for, or else that of the parameters; None: one number."""
    return np.broadcast(*parameters).shape or None if size is None else size


def _quantile(uniform: Any) -> Any:
    """Of the standard normal distribution; finite."""
    return ndtri(np.maximum(uniform, 0.5 / _SEEDS))


def _seeded_method(name: str) -> Callable[..., Any]:
    """A method of generators that draws from one number of a tape."""

    def draw(self: Any, *args: Any, **options: Any) -> Any:
        return getattr(self._seeded(), name)(*args, **options)

    return draw


for _name, _method in vars(np.random.Generator).items():
    if callable(_method) and not _name.startswith("_") and _name not in vars(Tape):
        setattr(Tape, _name, _seeded_method(_name))
