"""What post-bloating and support vectors share: the calibration windows that a base covers, and their certificate.

A new sample is missed if no base covers it, or if it is covered and the rule misses it. The first is bounded by the
one-sided Clopper–Pearson limit of the uncovered calibration units, the second by a scenario bound for the covered ones;
each takes half of the allowed error probability, and ε is their sum.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from coverdrive.certificates.bounds import check_confidence, rate_limit
from coverdrive.certificates.calibration import ScoredSamples, refuse_trained
from coverdrive.certificates.certificate import Certificate, Counted, Tubes, fingerprint
from coverdrive.certificates.rule import ROUNDING
from coverdrive.certificates.units import one_window_each


@dataclass(frozen=True)
class CoveredSamples:
    """N windows in units, and which of them the cover covers."""

    samples: ScoredSamples
    tube: float
    """radius ρ of the cover"""
    kind: Counted
    """what is counted"""
    unit: Int[np.ndarray, " N"]
    """in 0 … count − 1: the unit of every window"""
    covered: Bool[np.ndarray, " N"]
    """windows that stay in the tube around their base"""

    @staticmethod
    def of(
        samples: ScoredSamples, tube: float, trained_on: Int[np.ndarray, " V"], unit: Counted, seed: int
    ) -> "CoveredSamples":
        """Arguments as in `units.calibration_units`."""
        refuse_trained(samples, trained_on)
        if unit == "drawn window":
            samples = one_window_each(samples, seed)
        windows = np.arange(len(samples))
        number = np.unique(samples.vehicle, return_inverse=True)[1] if unit == "vehicle" else windows
        return CoveredSamples(samples, tube, unit, number, samples.distance <= tube)

    @property
    def count(self) -> int:
        """Number of units."""
        return int(self.unit.max()) + 1

    @property
    def bases(self) -> int:
        """Number M of bases."""
        return self.samples.scores.shape[1]

    @property
    def lowest(self) -> Float[np.ndarray, " M"]:
        """Lowest score of every base among the covered windows that drove it; infinite if there are none."""
        lowest = np.full(self.bases, np.inf)
        np.minimum.at(lowest, self.samples.base[self.covered], self.samples.score_of_base[self.covered])
        return lowest

    @property
    def farthest(self) -> Float[np.ndarray, " M"]:
        """Largest distance of the covered windows of every base; 0 if there are none."""
        farthest = np.zeros(self.bases)
        np.maximum.at(farthest, self.samples.base[self.covered], self.samples.distance[self.covered])
        return farthest

    def radii(self, tubes: Tubes) -> Float[np.ndarray, " M"]:
        """Radius around every base: that of the cover, or just enough for its covered windows."""
        cover = np.full(self.bases, self.tube)
        if tubes == "cover":
            return cover
        driven = np.bincount(self.samples.base[self.covered], minlength=self.bases) > 0
        return np.where(driven, np.minimum(self.farthest + ROUNDING, cover), cover)

    def certificate(
        self,
        method: str,
        tubes: Tubes,
        confidence: float,
        bound: Callable[[float], float],
        paper_epsilon: float | None,
        support: int | None = None,
    ) -> Certificate:
        """The certificate of a rule that misses no covered window.

        Args:
            method: its name.
            tubes: which the rule has.
            confidence: of the certificate.
            bound: on the probability that a new unit is covered and missed, by its confidence.
            paper_epsilon: the same by the paper's dimension, at the confidence of the certificate.
            support: number of units that support the rule, if it was counted.
        """
        check_confidence(confidence)
        shared = (1 + confidence) / 2
        uncovered = len(np.unique(self.unit[~self.covered]))
        return Certificate(
            method=method,
            epsilon=rate_limit(shared, uncovered, self.count) + bound(shared),
            confidence=confidence,
            samples=self.count,
            unit=self.kind,
            bases=self.bases,
            uncovered=uncovered,
            prediction_epsilon=bound(confidence),
            paper_epsilon=paper_epsilon,
            unseen_bases=int(np.isinf(self.lowest).sum()),
            discarded=0,
            tube=self.tube,
            tubes=tubes,
            support=support,
            fingerprint=fingerprint(self.samples.scores, self.samples.base, self.samples.distance),
        )
