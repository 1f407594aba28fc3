"""Random paths whose probability to reach a level is known."""

import copy
from functools import cache

import numpy as np
from scipy.stats import norm

from coverdrive.dialling.tape import Tape
from coverdrive.errors import StartError


class Walk:
    """Normal steps of variance 1 in all, and a slope that is drawn at the start, which the steepest make impossible."""

    def __init__(self, tape: Tape, steps: int = 10, slope: float = 0.0, steepest: float = np.inf):
        self.tape, self.steps, self.moment, self.level = tape, steps, 0, 0.0
        drawn = float(tape.standard_normal(3).sum()) / np.sqrt(3)
        if drawn > steepest:
            raise StartError("too steep")
        self.slope = slope * drawn

    @property
    def over(self) -> bool:
        return self.moment >= self.steps

    def advance(self) -> None:
        self.moment += 1
        self.level += float(self.tape.standard_normal()) / np.sqrt(self.steps) + self.slope / self.steps

    def copied(self, tape: Tape) -> "Walk":
        other = copy.copy(self)
        other.tape = tape
        return other

    @staticmethod
    @cache
    def probability(
        barrier: float, steps: int = 10, slope: float = 0.0, points: int = 1001, steepest: float = np.inf
    ) -> float:
        """That its level reaches a barrier, by integration over the places below it, step by step."""
        slopes = np.linspace(-7, 7, 71) if slope else np.zeros(1)
        weight = norm.pdf(slopes) * (slopes <= steepest)
        weight /= weight.sum()
        return float(weight @ [_reached(barrier, steps, slope * each, points) for each in slopes])


def _reached(barrier: float, steps: int, slope: float, points: int) -> float:
    place, deviation = np.linspace(-8, barrier, points), 1 / np.sqrt(steps)
    width = np.full(points, place[1] - place[0])
    width[[0, -1]] /= 2
    density = _normal(place - slope / steps, deviation)
    step = _normal(place - place[:, None] - slope / steps, deviation)
    for _ in range(steps - 1):
        density = (density * width) @ step
    return 1 - float(density @ width)


def _normal(away: np.ndarray, deviation: float) -> np.ndarray:
    """The density of a normal number of that deviation at places away from its mean."""
    return np.exp(-0.5 * (away / deviation) ** 2) / (deviation * np.sqrt(2 * np.pi))


class Still:
    """Everything is drawn at the start: a sum of normal numbers, of variance 1, unless the first one is too large."""

    over = True

    def __init__(self, tape: Tape, numbers: int = 6, most: float = np.inf):
        drawn = tape.standard_normal(numbers)
        if drawn[0] > most:
            raise StartError("too much")
        self.level = float(drawn.sum()) / np.sqrt(numbers)

    def advance(self) -> None:
        raise AssertionError("it is over")

    def copied(self, tape: Tape) -> "Still":
        return self

    @staticmethod
    def probability(barrier: float, most: float) -> float:
        """That it reaches a barrier, of 6 numbers, by integration over the first one."""
        first = np.linspace(-9, most, 4001)
        reached = norm.pdf(first) * norm.sf((barrier * np.sqrt(6) - first) / np.sqrt(5))
        return float(np.trapezoid(reached, first)) / norm.cdf(most)


class Patient:
    """At moment 1 it draws until a number is above 0.95; its level is how often."""

    def __init__(self, tape: Tape):
        self.tape, self.level, self.over = tape, 0.0, False

    def advance(self) -> None:
        self.level, self.over = 1.0, True
        while self.tape.random() <= 0.95:
            self.level += 1

    def copied(self, tape: Tape) -> "Patient":
        other = copy.copy(self)
        other.tape = tape
        return other


class Sudden:
    """Its level is 1 from a moment on that is as probable as every other, if there has been none."""

    most, chance = 40, 0.03

    def __init__(self, tape: Tape):
        self.tape, self.level, self.moment = tape, 0.0, 0

    @property
    def over(self) -> bool:
        return self.moment >= self.most

    def advance(self) -> None:
        self.moment += 1
        self.level = max(self.level, float(self.tape.random() < self.chance))

    def copied(self, tape: Tape) -> "Sudden":
        other = copy.copy(self)
        other.tape = tape
        return other

    @staticmethod
    def mean() -> float:
        """Of that moment, of paths that have one."""
        moments = np.arange(1, Sudden.most + 1)
        return float(np.average(moments, weights=(1 - Sudden.chance) ** moments))
