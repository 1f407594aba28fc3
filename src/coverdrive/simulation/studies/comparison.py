"""Two studies on the same seeds, compared trial by trial.

Trial i of both begins alike, so that differences are paired: the exact sign test on the trials in which only one of
the two collided (McNemar), Newcombe's interval for the difference of the two rates (*Improved confidence intervals for
the difference between binomial proportions based on paired data*, 1998, method 10), and Student's t for all else. Pairs
have to be independent of each other: of replays there are differences alone, without intervals and tests.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import scipy
from jaxtyping import Bool, Float
from scipy import special

from coverdrive.arguments import path_of
from coverdrive.certificates.bounds import check_confidence
from coverdrive.errors import DataError
from coverdrive.simulation.measures.statistics import COUNTED
from coverdrive.simulation.measures.trial import STARTED
from coverdrive.simulation.studies.folder import StudyFolder, flat
from coverdrive.simulation.studies.study import Study

MEASURES = (
    "mean_speed", "distance", "lane_changes", "overtakes", "minimum_gap", "minimum_time_to_collision",
    "usual_headway", "minimum_left",
    "jerk_longitudinal", "jerk_lateral", "hardest_braking", "hardest_braking_behind",
    "share_slack", "prediction_misses", "planning_median",
)  # fmt: skip
"""columns that are compared by their mean paired difference"""

_ALIKE = 1e-9
"""share of a mean below which its standard error is rounding"""


@dataclass(frozen=True)
class Difference:
    """How one measure differs: second study minus first."""

    name: str
    """of the measure"""
    pairs: int
    """trials in which both have a finite value"""
    first: float
    """mean of the first study"""
    second: float
    """mean of the second study"""
    low: float
    """lower end of the interval of the difference; not a number if there is none"""
    high: float
    """upper end of the interval of the difference; not a number if there is none"""
    p: float
    """probability of a difference at least as large if the two were alike; not a number if unknown"""
    only: tuple[int, int] | None = None
    """of collisions: trials in which only the first, and only the second, collided"""

    @property
    def value(self) -> float:
        """Mean of the second study minus that of the first."""
        return self.second - self.first


@dataclass(frozen=True)
class Comparison:
    """Two studies side by side."""

    trials: int
    """number of trials that both have"""
    settings: dict[str, tuple[Any, Any]]
    """settings in which they differ, by dotted name"""
    collisions: tuple[Difference, ...]
    """of the two counted kinds"""
    measures: tuple[Difference, ...]
    """of everything else"""
    replayed: bool = False
    """whether one of them replays recorded scenes, so that there are no intervals and no probabilities"""


def compare(first: Study | Path | str, second: Study | Path | str, confidence: float = 0.95) -> Comparison:
    """Compare the trials that two studies both have.

    Each is a study, its folder, or the results folder around it; ``confidence``, in (0, 1), is of every interval alone.

    Raises:
        DataError: a folder holds no finished study, the two have other seeds or numbers of vehicles, or no trial
            started in both.
        CertificateError: the confidence is not between 0 and 1.
    """
    check_confidence(confidence)
    first, second = (each.folder if isinstance(each, Study) else path_of(name, each, "a study, or ")
                     for name, each in (("first", first), ("second", second)))  # fmt: skip
    (one, ours), (two, theirs) = _load(first), _load(second)
    trials = min(ours.height, theirs.height)
    ours, theirs = ours.head(trials), theirs.head(trials)
    for name, what in (("seed", "seeds"), ("vehicles", "numbers of vehicles")):
        if not ours[name].equals(theirs[name]):
            at = int((ours[name] != theirs[name]).arg_max() or 0)
            raise DataError(
                f"{first} and {second} cannot be compared trial by trial, because their {what} differ: trial {at} has "
                f"{ours[name][at]} and {theirs[name][at]}; drive both with the same seed, start and vehicles"
            )
    started = ours.select(STARTED).to_series() & theirs.select(STARTED).to_series()
    if not started.any():
        raise DataError(
            f"of {trials} trials that {first} and {second} have in common none started in both, so that there is "
            "nothing to compare; drive more trials, or fewer vehicles"
        )
    ours, theirs = ours.filter(started), theirs.filter(started)
    replayed = any(each.get("scenarios") for each in (one, two))

    def told(each: Difference) -> Difference:
        return replace(each, low=np.nan, high=np.nan, p=np.nan) if replayed else each

    return Comparison(
        trials=ours.height,
        settings={name: (one.get(name), two.get(name)) for name in sorted(one | two) if one.get(name) != two.get(name)},
        collisions=tuple(told(_of_rates(name, kinds, ours, theirs, confidence)) for name, kinds in COUNTED.items()),
        measures=tuple(told(_of_means(name, ours, theirs, confidence)) for name in MEASURES),
        replayed=replayed,
    )


def _load(folder: Path) -> tuple[dict[str, Any], pl.DataFrame]:
    """Settings and trials of a study."""
    found = next((each for each in map(StudyFolder, (folder, folder / "study")) if each.exists), None)
    if found is None:
        raise DataError(f"{folder} holds no study, and neither has it a folder `study` that does; check the path")
    return flat(found.description()), found.table()


def _of_rates(
    name: str, kinds: tuple[str, ...], ours: pl.DataFrame, theirs: pl.DataFrame, confidence: float
) -> Difference:
    a, b = (table["kind"].is_in(kinds).to_numpy() for table in (ours, theirs))
    only = int((a & ~b).sum()), int((b & ~a).sum())
    low, high = newcombe_interval(a, b, confidence)
    p = float(scipy.stats.binomtest(only[0], sum(only)).pvalue) if sum(only) else 1.0
    return Difference(name, len(a), float(a.mean()), float(b.mean()), low, high, p, only)


def newcombe_interval(
    first: Bool[np.ndarray, " n"], second: Bool[np.ndarray, " n"], confidence: float
) -> tuple[float, float]:
    """Interval of the rate of the second minus that of the first, of paired outcomes (Newcombe 1998, method 10)."""
    n = len(first)
    both, neither = int((first & second).sum()), int((~first & ~second).sum())
    only_first, only_second = int((first & ~second).sum()), int((second & ~first).sum())
    margins = (both + only_first) * (only_second + neither) * (both + only_second) * (only_first + neither)
    product = both * neither - only_first * only_second
    product = max(product - n / 2, 0.0) if product > 0 else float(product)
    correlation = product / math.sqrt(margins) if margins else 0.0

    def wilson(count: int) -> tuple[float, float, float]:
        rate, interval = count / n, scipy.stats.binomtest(count, n).proportion_ci(confidence, "wilson")
        return rate, rate - interval.low, interval.high - rate

    rate_1, below_1, above_1 = wilson(both + only_first)
    rate_2, below_2, above_2 = wilson(both + only_second)
    difference = rate_2 - rate_1
    below = np.sqrt(below_2**2 - 2 * correlation * below_2 * above_1 + above_1**2)
    above = np.sqrt(above_2**2 - 2 * correlation * above_2 * below_1 + below_1**2)
    return float(difference - below), float(difference + above)


def _of_means(name: str, ours: pl.DataFrame, theirs: pl.DataFrame, confidence: float) -> Difference:
    a, b = (table[name].to_numpy().astype(float) for table in (ours, theirs))
    finite = np.isfinite(a) & np.isfinite(b)
    a, b = a[finite], b[finite]
    one, two = (float(a.mean()), float(b.mean())) if len(a) else (np.nan, np.nan)
    return Difference(name, len(a), one, two, *paired_t(b - a, confidence))


def paired_t(difference: Float[np.ndarray, " n"], confidence: float) -> tuple[float, float, float]:
    """Student's interval of a mean difference, and the probability of a mean as far from zero if there were none.

    Fewer than two tell nothing. Differences that are all equal tell nothing of how they spread: they have no interval;
    the probability is 1 if all are zero, and unknown otherwise. Where few of few pairs differ, the probability is too
    large rather than too small, but if they all differ in one direction, the interval ends too near to zero: with 1 in
    10 pairs that differ, by exponential amounts, the mean is farther in 13 % of the cases with 100 pairs, and in 20 %
    with 20 or 40.
    """
    n = len(difference)
    if n < 2:
        return np.nan, np.nan, np.nan
    mean = float(difference.mean())
    error = float(difference.std(ddof=1) / np.sqrt(n))
    if error <= _ALIKE * abs(mean):
        return np.nan, np.nan, 1.0 if mean == 0 else np.nan
    half = float(special.stdtrit(n - 1, (1 + confidence) / 2)) * error
    return mean - half, mean + half, float(2 * special.stdtr(n - 1, -abs(mean) / error))


def mean_interval(values: Float[np.ndarray, " n"], confidence: float) -> tuple[float, float] | tuple[None, None]:
    """Student's interval of a mean; none of fewer than two values, and of those that are all equal."""
    low, high, _ = paired_t(values, confidence)
    return (None, None) if np.isnan(low) else (low, high)
