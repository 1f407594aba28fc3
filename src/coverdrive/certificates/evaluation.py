"""Checking a rule on samples that neither trained nor calibrated it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float, Int, Num

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.certificates.certificate import Unit
from coverdrive.certificates.clustered import clustered_interval
from coverdrive.certificates.rule import Rule, Thresholds, scale_of
from coverdrive.percentages import interval, percent


@dataclass(frozen=True)
class Rate:
    """An observed rate with the ends of its 95 % interval, by what is independent: units, or clusters of them.

    Every interval of a rate or share in the package is one of two: of units that are independent, such as drives,
    Clopper and Pearson's; of all else that of `coverdrive.certificates.clustered.clustered_interval`. Where nobody
    knows which units are independent, as in replays, there is none: its ends are not numbers.
    """

    count: int | float
    """of ``total``; the sum of losses where they are no counts"""
    total: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """Observed rate; 0 of none."""
        return self.count / max(self.total, 1)

    @staticmethod
    def of(hits: np.ndarray) -> "Rate":
        """Rate of the true entries, which are independent (Clopper and Pearson)."""
        count, total = int(hits.sum()), len(hits)
        return Rate(count, total, *clopper_pearson(count, total))

    @staticmethod
    def by_cluster(hits: Bool[np.ndarray, " N"], cluster: Int[np.ndarray, " N"]) -> "Rate":
        """Rate of the true entries, of which those of one cluster, such as a vehicle, may be alike."""
        member = np.unique(cluster, return_inverse=True)[1]
        return Rate.of_totals(np.bincount(member, hits).astype(int), np.bincount(member))

    @staticmethod
    def of_losses(losses: Float[np.ndarray, " C"]) -> "Rate":
        """Mean of the losses in [0, 1] of independent units."""
        return Rate.of_totals(losses, np.ones(len(losses), dtype=int))

    @staticmethod
    def of_totals(hits: Num[np.ndarray, " C"], totals: Int[np.ndarray, " C"]) -> "Rate":
        """Σ hits / Σ totals of independent clusters; where hits are no whole numbers, they are sums of losses."""
        count = float(hits.sum()) if hits.dtype.kind == "f" else int(hits.sum())
        low, high = clustered_interval(hits.astype(float), totals.astype(float))
        return Rate(count, int(totals.sum()), low, high)

    @property
    def alone(self) -> "Rate":
        """The same without an interval."""
        return replace(self, low=math.nan, high=math.nan)

    def __str__(self) -> str:
        """The rate, its counts and its interval, if it has one."""
        ends = "" if math.isnan(self.low) else f"; 95 % {interval(self.low, self.high)}"
        return f"{percent(self.value)} ({self.counts}{ends})"

    @property
    def brief(self) -> str:
        """The rate and its interval alone."""
        return percent(self.value) + ("" if math.isnan(self.low) else f" ({interval(self.low, self.high)})")

    @property
    def counts(self) -> str:
        """What was counted."""
        return f"{self.count:,} of {self.total:,}" if isinstance(self.count, int) else f"mean of {self.total:,}"


@dataclass(frozen=True)
class Evaluation:
    """How often a rule misses, and what it costs."""

    windows: Rate
    """missed windows, with an interval by vehicle"""
    vehicles: Rate
    """vehicles of which any window is missed; their interval ignores that vehicles of one scene group may be alike"""
    shares: Rate
    """share of a vehicle's windows that are missed, on average over vehicles"""
    groups: Rate
    """share of a scene group's vehicles of which any window is missed, on average over groups"""
    not_predicted: int
    """windows whose base is not in the set"""
    outside_tube: int
    """windows that leave the tube around their base"""
    mean_set_size: float
    median_set_size: float
    """possible bases of a window"""
    bases: int
    """number M of bases: the size of the set that never misses a base"""
    mean_area: float | None = None
    """[m²] in which the centre of a vehicle may be, where sets are boxes of any size instead of bases"""
    kinds: Mapping[str, Rate] = field(default_factory=dict[str, Rate])
    """missed windows of each kind that there is, with an interval by vehicle"""

    @property
    def size(self) -> float:
        """Mean area [m²] where sets are boxes, else the mean number of possible bases."""
        return self.mean_set_size if self.mean_area is None else self.mean_area

    @property
    def sized(self) -> str:
        """How large sets are on average."""
        return f"{self.mean_set_size:.2f} of {self.bases}" if self.mean_area is None else f"{self.mean_area:.1f} m²"

    def missed(self, unit: Unit) -> Rate:
        """The rate that a certificate for this unit bounds."""
        return {"vehicle": self.vehicles, "share": self.shares, "group": self.groups}.get(unit, self.windows)


def evaluate(
    rule: Rule,
    samples: ScoredSamples,
    scale: float = 1.0,
    kinds: Mapping[str, Bool[np.ndarray, " N"]] | None = None,
) -> Evaluation:
    """Apply a rule, or what is left of it in sets of another scale, to samples with a known outcome, of some kinds."""
    if scale != 1 and samples.area is not None:
        rule = Thresholds(np.array([1 / (1 + scale * scale_of(rule))]), rule.tube)
    elif scale != 1 and isinstance(rule, Thresholds):
        rule = Thresholds(1 - scale * (1 - rule.values), scale * rule.tube)
    possible = rule.possible(samples.scores, samples.hidden)
    sizes = possible.sum(1)
    not_predicted = ~possible[np.arange(len(samples)), samples.base]
    outside = samples.distance > rule.tube[samples.base]
    missed = not_predicted | outside
    _, vehicle = np.unique(samples.vehicle, return_inverse=True)
    any_missed = np.bincount(vehicle, weights=missed) > 0
    scene = np.zeros(len(any_missed), dtype=np.int64)
    scene[vehicle] = np.unique(samples.scene, return_inverse=True)[1]
    return Evaluation(
        windows=Rate.by_cluster(missed, vehicle),
        vehicles=Rate.of(any_missed),
        shares=Rate.of_losses(np.bincount(vehicle, missed) / np.bincount(vehicle)),
        groups=Rate.of_losses(np.bincount(scene, any_missed) / np.bincount(scene)),
        not_predicted=int(not_predicted.sum()),
        outside_tube=int(outside.sum()),
        mean_set_size=float(sizes.mean()),
        median_set_size=float(np.median(sizes)),
        bases=samples.scores.shape[1],
        mean_area=None if samples.area is None else float(samples.area.mean()) * scale_of(rule) ** 2,
        kinds={name: Rate.by_cluster(missed[own], vehicle[own]) for name, own in (kinds or {}).items() if own.any()},
    )
