"""Checking a rule on samples that neither trained nor calibrated it."""

from dataclasses import dataclass

import numpy as np

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.rule import Rule
from coverdrive.numbers import interval, percent


@dataclass(frozen=True)
class Rate:
    """An observed rate, ``count`` of ``total``, with the ends of its 95 % Clopper–Pearson interval."""

    count: int
    total: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """Observed rate."""
        return self.count / self.total

    @staticmethod
    def of(hits: np.ndarray) -> "Rate":
        """Rate of the true entries."""
        count, total = int(hits.sum()), len(hits)
        return Rate(count, total, *clopper_pearson(count, total))

    def __str__(self) -> str:
        """The rate, its counts and its interval."""
        return f"{percent(self.value)} ({self.count} of {self.total}; 95 % {interval(self.low, self.high)})"


@dataclass(frozen=True)
class Evaluation:
    """How often a rule misses, and what it costs."""

    windows: Rate
    """missed windows; their interval ignores that windows of one vehicle depend on each other"""
    vehicles: Rate
    """vehicles of which any window is missed"""
    not_predicted: int
    """windows whose base is not in the set"""
    outside_tube: int
    """windows that leave the tube around their base"""
    mean_set_size: float
    median_set_size: float
    """possible bases of a window"""
    mean_tube: float
    """mean radius of the tubes of all bases in all sets, in the norm of the basis"""
    bases: int
    """number M of bases: the size of the set that never misses a base"""


def evaluate(rule: Rule, samples: ScoredSamples) -> Evaluation:
    """Apply a rule to samples with a known outcome."""
    possible = rule.possible(samples.scores, samples.hidden)
    sizes = possible.sum(1)
    not_predicted = ~possible[np.arange(len(samples)), samples.base]
    outside = samples.distance > rule.tube[samples.base]
    missed = not_predicted | outside
    _, vehicle = np.unique(samples.vehicle, return_inverse=True)
    return Evaluation(
        windows=Rate.of(missed),
        vehicles=Rate.of(np.bincount(vehicle, weights=missed) > 0),
        not_predicted=int(not_predicted.sum()),
        outside_tube=int(outside.sum()),
        mean_set_size=float(sizes.mean()),
        median_set_size=float(np.median(sizes)),
        mean_tube=float((possible @ rule.tube).sum() / max(sizes.sum(), 1)),
        bases=samples.scores.shape[1],
    )
