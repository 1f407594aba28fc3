"""How probable is what hardly ever happens: adaptive multilevel splitting of random paths.

A path has a level at every moment; it ends well or reaches a target level. Many paths are begun. Again and again those
of the lowest levels are given up, and replaced by copies of the others that are made different without falling back
below the level that was reached. The probability is the product of the shares that were not given up (Au & Beck,
*Estimation of small failure probabilities in high dimensions by subset simulation*, 2001; Cérou & Guyader, *Adaptive
multilevel splitting for rare event analysis*, 2007). Paths of equal level are given up together (Bréhier et al.,
*Unbiasedness of some generalized adaptive multilevel splitting algorithms*, 2016).

A copy is made different in two ways, of which each leaves the law of a path that reaches the level as it is:

- A random part of its random numbers (`coverdrive.dialling.tape`) is drawn anew, or moved a little, some times in a
  row, and what comes out is taken if it reaches the level as well, not much later: of all numbers, of the beginning,
  too, or of those from a moment on, mostly one shortly before the level was reached. So paths whose randomness is
  all drawn at the beginning are split as well, and most changes cost little.
- All numbers after the moment at which it first reached the level are drawn anew, and the path goes on from there.

Where a start may be impossible, all this is about paths that can start: a first one is drawn anew until it can, and a
change to one that cannot is refused.

Of what others offer, pytams 1.0 splits trajectories in time, but keeps what was drawn at the beginning, and
openturns 1.27 has subset simulation of a known number of normal variables, but knows no paths that can be gone on with;
a drive needs both, and draws as many numbers as it needs.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from coverdrive.dialling.tape import Tape
from coverdrive.errors import SettingError, StartError

IN_VAIN = 100
"""starts in a row that are impossible, after which no other is tried"""

_EVERY = 5
"""moments between two that a path can be gone on with from"""
_FROM_START = 0.3
"""share of the changes that change the start, where numbers of later moments could be changed instead"""
_ANEW = 0.25
"""share of the changes that draw all numbers from a place on anew; the others move some of them"""
_FIRST, _LATER, _WITHIN, _WIDTH = -0.3, -2.0, -1.3, -0.5
"""decimal logarithms of the least share of the numbers that are moved, of moment 0, of the others, and of those after a
stop, and of the least width by which"""
_LATEST = 10
"""moments by which a changed path may surpass a level later or earlier: nobody waits for it any longer"""


@runtime_checkable
class Process(Protocol):
    """A path on its way; one that is over is left as it is."""

    @property
    def level(self) -> float:
        """At the present moment."""
        ...

    @property
    def over(self) -> bool:
        """Whether this is the last moment."""
        ...

    def advance(self) -> object:
        """Go on to the next moment; nobody asks what it returns."""
        ...

    def copied(self, tape: Tape) -> "Process":
        """The same, to go on with numbers from another tape."""
        ...


Start = Callable[[Tape], Process]
"""begins a path at moment 0, with all its random numbers from a tape; a StartError if that is impossible"""


@dataclass(eq=False)
class Path:
    """A path, to its end or as far as it was gone."""

    tape: Tape
    process: Process
    """at the last moment"""
    ancestor: int
    """number of the first path that it descends from"""
    levels: list[float]
    """at every moment"""
    stops: dict[int, Process] = field(default_factory=dict[int, Process], repr=False)
    """copies of the process at earlier moments"""

    @property
    def level(self) -> float:
        """The highest one."""
        return max(self.levels)

    def above(self, level: float) -> int:
        """The first moment above a level, which there is."""
        return next(moment for moment, each in enumerate(self.levels) if each > level)


class Stage(NamedTuple):
    """What happened at a level."""

    level: float
    """that was to be surpassed"""
    share: float
    """of the paths that did"""
    accepted: float
    """share of the changes, of those that could be refused, that were taken"""
    ancestors: int
    """first paths that all paths descend from then"""


class Split(NamedTuple):
    """What came out."""

    probability: float
    """that a path reaches the target; 0 if none was found; if that is rarer than was looked for, that it gets above the
    last level, which is more"""
    stages: list[Stage]
    curve: list[tuple[float, float]]
    """levels in ascending order, and how probable it is to get above each"""
    found: list[Path]
    """that reached the target"""
    moments: int
    """that all paths went together"""
    rarer: bool
    """whether reaching the target is rarer than was looked for"""


def split(
    start: Start, random: np.random.Generator, target: float = 0.0, particles: int = 200, kept: float = 0.5,
    changes: int = 4, rarest: float = 1e-15,
) -> Split:  # fmt: skip
    """Estimate the probability that the level of a path that can start reaches the target.

    Args:
        start: begins a path.
        random: draws everything.
        target: level, which counts as reached.
        particles: number of paths.
        kept: share of the paths that are not given up at a time.
        changes: number of times that a copy is changed.
        rarest: probability below which nothing is looked for.

    Raises:
        SettingError: a number makes no sense, or hardly any path can start.
    """
    top = particles - math.ceil(kept * particles)
    if not 0 < top < particles or changes < 1:
        raise SettingError(
            f"splitting needs at least 2 paths, some of them kept and some given up, and at least one change; got "
            f"{particles} paths, {kept} of them kept, {changes} changes; try 200 and 0.5"
        )
    walk, probability, stages, curve = _Walk(start, random, changes), 1.0, list[Stage](), list[tuple[float, float]]()
    paths = [walk.first(number) for number in range(particles)]
    while (level := sorted(path.level for path in paths)[top - 1]) < target:
        curve += _curve(paths, level, probability)
        above = [path for path in paths if path.level > level]
        probability *= len(above) / particles
        if not above:
            return Split(0.0, stages, curve, [], walk.moments, rarer=False)
        if probability < rarest and max(path.level for path in above) < target:
            last = Stage(level, len(above) / particles, 1.0, len({path.ancestor for path in above}))
            return Split(probability, [*stages, last], curve, [], walk.moments, rarer=True)
        copies = [above[i] for i in random.integers(len(above), size=particles - len(above))]
        taken = 0
        for number, copy in enumerate(copies):
            copies[number], changed = walk.changed(copy, level)
            taken += changed
        paths = above + copies
        ancestors = len({path.ancestor for path in paths})
        stages.append(Stage(level, len(above) / particles, taken / (changes * len(copies)), ancestors))
    curve += _curve(paths, np.nextafter(target, -math.inf), probability)
    found = [path for path in paths if path.level >= target]
    return Split(probability * len(found) / particles, stages, curve, found, walk.moments, rarer=False)


def _curve(paths: list[Path], most: float, probability: float) -> list[tuple[float, float]]:
    """Levels of paths up to one, and how probable it is to get above each where paths like these are so probable."""
    levels = np.array([path.level for path in paths])
    return [(float(each), probability * float(np.mean(levels > each))) for each in np.unique(levels[levels <= most])]


def _places(above: int) -> Float[np.ndarray, " n"]:
    """How probable it is that numbers change from the start on, or from each stop before a moment: near it most."""
    stops = math.ceil(above / _EVERY)
    near = 1 / np.arange(stops, 0, -1)
    return np.append(_FROM_START, (1 - _FROM_START) * near / near.sum()) if stops else np.ones(1)


def _odds(place: int, before: int, after: int) -> float:
    """That a place is picked where a path surpasses the level after a change, over that where it did before."""
    return float(_places(after)[place] / _places(before)[place])


class _Walk:
    """Goes paths, and counts the moments."""

    def __init__(self, start: Start, random: np.random.Generator, changes: int = 4):
        self._start, self._random, self._changes, self.moments = start, random, changes, 0

    def first(self, number: int) -> Path:
        """A new path, drawn anew until it can start."""
        path, vain = None, 0
        while path is None:
            try:
                path = self._begun(Tape(random=self._random), number)
            except StartError as error:
                if (vain := vain + 1) == IN_VAIN:
                    raise SettingError(
                        f"none of {IN_VAIN} starts in a row was possible; take fewer vehicles, or other traffic (the "
                        f"last one: {error})"
                    ) from error
        self._go(path)
        return path

    def changed(self, path: Path, level: float) -> tuple[Path, int]:
        """Another path above a level instead of one that is, and how many changes until it gets there were taken."""
        taken = 0
        for _ in range(self._changes):
            with suppress(StartError):  # a change to a path that cannot start is refused
                if (tried := self._tried(path, level)) is not None:
                    path, taken = tried, taken + 1
        path = self._on(path, path.above(level))
        self._go(path)
        return path, taken

    def _tried(self, path: Path, level: float) -> Path | None:
        """The path with a part of its numbers changed, until it surpasses a level, or None.

        Acceptance is that of Metropolis and Hastings: the place from which on numbers change is picked among those
        before the path is above the level. One that surpasses it much later, or earlier, is refused.
        """
        random, above = self._random, path.above(level)
        places = _places(above)
        place = int(random.choice(len(places), p=places))
        since = 0 if place == 0 else (place - 1) * _EVERY + 1
        anew = random.random() < _ANEW
        if anew:
            tape = path.tape.until(since, random)
        else:
            first, later, width = 10 ** random.uniform((_FIRST, _LATER if place == 0 else _WITHIN, _WIDTH), 0.0)
            which = random.integers(3)  # only the beginning, only what comes later, both
            tape = path.tape.nudged(first * (which != 1), later * (place > 0 or which != 0), width, random, since)
        tried = self._resumed(path, since - 1, tape) if place else self._begun(tape, path.ancestor)
        if place == 0:
            tape.turn(0)  # what the new start does not ask for is no part of it
            if not (anew or tried.tape.reversible(path.tape)):
                return None
        self._go(tried, level, above + _LATEST)
        if tried.levels[-1] <= level or above > len(tried.levels) - 1 + _LATEST:
            return None
        return tried if random.random() < _odds(place, above, len(tried.levels) - 1) else None

    def _on(self, path: Path, moment: int) -> Path:
        """The same path up to a moment, after which its numbers are not drawn yet."""
        tape = path.tape.until(moment + 1, self._random)
        other = self._resumed(path, max(each for each in (*path.stops, len(path.levels) - 1) if each <= moment), tape)
        while len(other.levels) <= moment:
            self._advance(other)
        return other

    def _resumed(self, path: Path, stop: int, tape: Tape) -> Path:
        """A path from a stop of another on, with a tape of its own."""
        process = path.stops.get(stop, path.process)
        earlier = {each: process for each, process in path.stops.items() if each <= stop}
        return Path(tape, process.copied(tape), path.ancestor, path.levels[: stop + 1], earlier)

    def _begun(self, tape: Tape, ancestor: int) -> Path:
        process = self._start(tape)
        return Path(tape, process, ancestor, [process.level])

    def _go(self, path: Path, level: float = math.inf, moment: float = math.inf) -> None:
        """Go on with a path to its end, or until it is above a level, or to a moment."""
        while not (path.process.over or path.levels[-1] > level or len(path.levels) > moment):
            self._advance(path)

    def _advance(self, path: Path) -> None:
        moment = len(path.levels)
        if (moment - 1) % _EVERY == 0 and moment - 1 not in path.stops:
            path.stops[moment - 1] = path.process.copied(path.tape)
        path.tape.turn(moment)
        path.process.advance()
        path.levels.append(path.process.level)
        self.moments += 1
