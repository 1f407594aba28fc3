"""Scores of samples with a known outcome: what every method calibrates on and is tested on."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from coverdrive.errors import CertificateError


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

    def __post_init__(self) -> None:
        """Refuse what no guarantee could rest on."""
        samples, bases = self.scores.shape
        if samples == 0:
            raise CertificateError("there are no samples to calibrate on or to test; give more recordings")
        if not ((self.scores >= 0) & (self.scores <= 1)).all():
            worst = self.scores[~((self.scores >= 0) & (self.scores <= 1))][0]
            raise CertificateError(f"scores must be numbers in [0, 1], got {worst}; apply a sigmoid or a softmax")
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
        hidden = None if self.hidden is None else self.hidden[rows]
        return ScoredSamples(self.scores[rows], self.base[rows], self.distance[rows], self.vehicle[rows], hidden)

    @property
    def score_of_base(self) -> Float[np.ndarray, " N"]:
        """Score of the base that was driven."""
        return self.scores[np.arange(len(self)), self.base]


def refuse_trained(samples: ScoredSamples, trained_on: Int[np.ndarray, " V"]) -> None:
    """Raise `CertificateError` if a vehicle of the samples also trained the network."""
    shared = np.intersect1d(samples.vehicle, trained_on)
    if len(shared):
        raise CertificateError(
            f"{len(shared)} of {len(np.unique(samples.vehicle))} calibration vehicles also trained the network, and "
            "thresholds taken from them would certify nothing; calibrate on vehicles that training never saw"
        )
