"""What every method calibrates on: windows with a known outcome, and the units that a bound counts.

A unit is a window, or a vehicle with all its windows; of a mean loss, a vehicle whose windows, or a scene group whose
vehicles, are its pieces. It asks of base j that c_j be at most the lowest score that j had in a window of the unit that
drove j. A window that leaves the cover's tube around its base is missed at every threshold: it asks with a score of −∞.
A unit is missed if anything it asks for is.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, get_args

import numpy as np
from jaxtyping import Bool, Float, Int

from coverdrive.certificates.bounds import check_confidence
from coverdrive.certificates.certificate import Certificate, Unit, fingerprint
from coverdrive.certificates.rule import Thresholds
from coverdrive.errors import CertificateError
from coverdrive.linked import parts_of_groups
from coverdrive.percentages import counted


@dataclass(frozen=True)
class ScoredSamples:
    """N samples, checked when made."""

    scores: Float[np.ndarray, "N M"]
    """in [0, 1], one for each base"""
    base: Int[np.ndarray, " N"]
    """the base nearest to what the vehicle did"""
    distance: Float[np.ndarray, " N"]
    """in the norm of the basis, from the vehicle's path to that base"""
    vehicle: Int[np.ndarray, " N"]
    """key of the vehicle"""
    hidden: Float[np.ndarray, "N H"] | None = None
    """values of the last hidden layer; only support vectors look at them"""
    group: Int[np.ndarray, " N"] | None = None
    """scene group; without it, every vehicle is one"""
    area: Float[np.ndarray, " N"] | None = None
    """[m²] in which the centre may be at a score of one half, where it grows as the square of (1 − score) / score"""

    def __post_init__(self) -> None:
        """Refuse what no guarantee could rest on."""
        samples, bases = self.scores.shape
        if samples == 0:
            raise CertificateError("there are no samples to calibrate on or to test; give more recordings")
        if len(wrong := self.scores[~((self.scores >= 0) & (self.scores <= 1))]):
            raise CertificateError(f"scores must be numbers in [0, 1], got {wrong[0]}; apply a sigmoid or a softmax")
        if not ((self.base >= 0) & (self.base < bases)).all():
            raise CertificateError(f"every sample needs one of the {bases} bases as its label")
        if not (np.isfinite(self.distance) & (self.distance >= 0)).all():
            raise CertificateError("distances to the nearest base must be finite and not negative")
        if self.hidden is not None and not (len(self.hidden) == samples and np.isfinite(self.hidden).all()):
            raise CertificateError(
                f"the last hidden layer must have finite values for each of the {samples} samples, got "
                f"{int(np.isfinite(self.hidden).all(1).sum())} such rows of {len(self.hidden)}; check the features"
            )

    def __len__(self) -> int:
        """Number of samples N."""
        return len(self.base)

    def of(self, rows: Int[np.ndarray, " n"]) -> "ScoredSamples":
        """The samples of some rows."""
        return replace(self, **{name: values[rows] for name, values in vars(self).items() if values is not None})

    @property
    def scene(self) -> Int[np.ndarray, " N"]:
        """Number of the scene group; those that share a vehicle, as successive minutes do, are one."""
        return self.vehicle if self.group is None else parts_of_groups(self.vehicle, self.group)

    @property
    def score_of_base(self) -> Float[np.ndarray, " N"]:
        """Score of the base that was driven."""
        return self.scores[np.arange(len(self)), self.base]


class Demands(NamedTuple):
    """What units ask for: D demands, at most one for each unit and base."""

    unit: Int[np.ndarray, " D"]
    """in 0 … N − 1: the unit that asks"""
    base: Int[np.ndarray, " D"]
    """the base that it drove"""
    score: Float[np.ndarray, " D"]
    """lowest score of that base in the unit's windows, −∞ if it left the cover's tube in one of them"""


@dataclass(frozen=True)
class Claim:
    """What is to be claimed, checked when made."""

    epsilon: float | None = None
    """bound on the probability of a miss; all methods need one, except those that compute it"""
    confidence: float | None = 0.99
    """of the bound; None: on average over calibrations, which is all that conformal methods claim that are not PAC"""

    def __post_init__(self) -> None:
        """Refuse what is no probability."""
        if self.epsilon is not None and not 0 < self.epsilon < 1:
            raise CertificateError(
                f"a bound ε on the probability of a miss must lie between 0 and 1, got {self.epsilon}"
            )
        if self.confidence is not None:
            check_confidence(self.confidence)

    @property
    def bound(self) -> float:
        """The bound ε, where there has to be one."""
        if self.epsilon is None:
            raise CertificateError(
                "this method needs a bound ε on the probability of a miss; only post-bloating and svm compute it"
            )
        return self.epsilon

    @property
    def sure(self) -> float:
        """The confidence, where there has to be one."""
        if self.confidence is None:
            raise CertificateError("this method needs a confidence; only conformal regression does without")
        return self.confidence


@dataclass(frozen=True)
class Calibration:
    """Calibration windows in N units, and all that is fixed before they are seen. Made by `of`."""

    samples: ScoredSamples
    """the windows of all units, from the calibration split Ω₂"""
    tube: float
    """radius ρ of the cover: around every base, within it, a path is covered"""
    kind: Unit
    """what is counted"""
    seed: int
    """of the negatives of hyperplanes"""
    training: ScoredSamples | None
    """scores of the training split Ω₁, which shape nested sets and hyperplanes"""

    def __post_init__(self) -> None:
        """Refuse another unit."""
        if self.kind not in get_args(Unit):
            raise CertificateError(f"unit: expected {' or '.join(map(repr, get_args(Unit)))}, got {self.kind!r}")

    @staticmethod
    def of(
        samples: ScoredSamples,
        tube: float,
        trained_on: Int[np.ndarray, " V"],
        unit: Unit = "window",
        seed: int = 0,
        training: ScoredSamples | None = None,
    ) -> "Calibration":
        """Count samples of Ω₂ in units; `CertificateError` if their vehicles trained the network or shape the rules."""
        known = trained_on if training is None else np.union1d(trained_on, training.vehicle)
        if shared := len(np.intersect1d(samples.vehicle, known)):
            raise CertificateError(
                f"{shared} of {len(np.unique(samples.vehicle))} calibration vehicles also trained the network, and "
                "thresholds taken from them would certify nothing; calibrate on vehicles that training never saw"
            )
        return Calibration(samples, tube, unit, seed, training)

    def __len__(self) -> int:
        """Number N of units."""
        return int(self.unit.max()) + 1

    @property
    def bases(self) -> int:
        """Number M of bases."""
        return self.samples.scores.shape[1]

    @cached_property
    def unit(self) -> Int[np.ndarray, " W"]:
        """In 0 … N − 1: the unit of every window."""
        return unit_of(self.samples.vehicle, self.samples.scene, self.kind)

    @cached_property
    def pieces(self) -> "tuple[Calibration, Int[np.ndarray, ' P']]":
        """Of a mean loss: what a unit loses parts of, windows or vehicles, and the unit of each."""
        parts = replace(self, kind="window" if self.kind == "share" else "vehicle")
        owner = np.zeros(len(parts), dtype=np.int64)
        owner[parts.unit] = self.unit
        return parts, owner

    def _design_effect(self, rule: Thresholds | None) -> float | None:
        by, group = replace(self, kind="group").pieces
        missed = ~by.covered if rule is None else by.missed(rule)
        count, rate = np.bincount(group), missed.mean()
        if len(count) < 2 or rate in (0, 1):
            return None
        apart = np.bincount(group, missed) / count - rate
        return float((count * apart**2).sum() / (rate * (1 - rate)) / (len(count) - 1))

    @cached_property
    def in_tube(self) -> Bool[np.ndarray, " W"]:
        """Windows that stay in the cover's tube around their base."""
        return self.samples.distance <= self.tube

    @cached_property
    def demands(self) -> Demands:
        """What the units ask for."""
        score = np.where(self.in_tube, self.samples.score_of_base.astype(float), -np.inf)
        asked, demand = np.unique(self.unit * self.bases + self.samples.base, return_inverse=True)
        lowest = np.full(len(asked), np.inf)
        np.minimum.at(lowest, demand, score)
        return Demands(asked // self.bases, asked % self.bases, lowest)

    @cached_property
    def covered(self) -> Bool[np.ndarray, " N"]:
        """Units that never leave the cover's tube."""
        return np.isfinite(self.level(self.demands.score))

    @property
    def uncovered(self) -> int:
        """How many units leave the cover's tube."""
        return int((~self.covered).sum())

    @cached_property
    def lowest(self) -> Float[np.ndarray, " M"]:
        """Lowest score of every base among the windows in its tube that drove it; infinite if there are none."""
        lowest = np.full(self.bases, np.inf)
        np.minimum.at(lowest, self.samples.base[self.in_tube], self.samples.score_of_base[self.in_tube])
        return lowest

    def level(self, demanded: Float[np.ndarray, " D"]) -> Float[np.ndarray, " N"]:
        """Least of one number for each demand, unit by unit."""
        least = np.full(len(self), np.inf)
        np.minimum.at(least, self.demands.unit, demanded)
        return least

    def missed(self, rule: Thresholds) -> Bool[np.ndarray, " N"]:
        """Units that a rule misses whose tube is that of the cover."""
        return self.level(self.demands.score - rule.values[self.demands.base]) < 0

    @property
    def shaping(self) -> ScoredSamples:
        """The training samples, where a method cannot do without."""
        if self.training is None:
            raise CertificateError("this method needs the scores of the training split, which shape its thresholds")
        return self.training

    def certificate(
        self, method: str, epsilon: float, claim: Claim, rule: Thresholds | None = None, **more: Any
    ) -> Certificate:
        """The certificate of a rule that was calibrated on these units, the rest of which is ``more``.

        Which covered units the rule misses is counted; without one, it misses none.
        """
        return Certificate(
            method=method,
            epsilon=epsilon,
            confidence=claim.confidence,
            samples=len(self),
            unit=self.kind,
            bases=self.bases,
            uncovered=self.uncovered,
            discarded=0 if rule is None else int((self.missed(rule) & self.covered).sum()),
            tube=self.tube,
            fingerprint=fingerprint(self.samples.scores, self.samples.base, self.samples.distance),
            vehicles=len(np.unique(self.samples.vehicle)),
            scenes=len(np.unique(self.samples.scene)),
            design_effect=self._design_effect(rule),
            **more,
        )


def unit_of(vehicle: Int[np.ndarray, " W"], group: Int[np.ndarray, " W"], kind: Unit) -> Int[np.ndarray, " W"]:
    """In 0 … N − 1: the unit of every window of a vehicle and a scene group."""
    if kind == "window":
        return np.arange(len(vehicle))
    return np.unique(group if kind == "group" else vehicle, return_inverse=True)[1]


def refusal(kind: Unit, count: int, outside: int, epsilon: float, allowed: int, least: float) -> CertificateError:
    """Why ``count`` units do not prove ε: only so many misses are allowed (−1: not even none), or more are outside.

    ``least`` is the smallest bound that so many units can prove.
    """
    units = counted(count, f"calibration {kind}")
    if allowed < 0:
        return CertificateError(
            f"{units} cannot prove ε = {epsilon:g}; the smallest ε possible with them is {least:.3g}, so allow that "
            "much or calibrate on more data"
        )
    return CertificateError(
        f"{outside} of {units} leave the tube around their base, but only {allowed} may be missed for ε = "
        f"{epsilon:g}; allow a larger ε, or widen the tube or refine the basis"
    )
