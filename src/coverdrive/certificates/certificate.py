"""What a calibration proves, in numbers and in one sentence."""

import hashlib
from dataclasses import dataclass
from typing import Literal

import numpy as np

Unit = Literal["window", "vehicle"]
"""What is counted: single windows, or vehicles (a vehicle misses if any of its windows does)"""


@dataclass(frozen=True)
class Certificate:
    """With probability ``confidence`` over the calibration samples, a new one misses with probability at most ε."""

    method: str
    epsilon: float
    """bound on the probability of a miss"""
    confidence: float
    """probability, over the draw of the calibration samples, with which the bound holds"""
    samples: int
    """number N₂ of calibration samples, counted in ``unit``"""
    unit: Unit
    bases: int
    """number M of base trajectories: the greatest number of samples that can determine the rule"""
    uncovered: int
    """calibration samples that no base covers; they count as misses"""
    prediction_epsilon: float
    """bound on missing a covered sample alone, Φ(ε, M − 1, N₂)"""
    paper_epsilon: float
    """the same by the paper's Theorem 1, Φ(ε, M + 1, N₂): valid and looser"""
    unseen_bases: int
    """bases without a covered calibration sample; they are always possible"""
    discarded: int
    """covered calibration samples that the rule is allowed to miss"""
    tube: float
    """radius around a base, in the norm of the basis, within which a vehicle has to stay"""
    fingerprint: str
    """of the calibration samples"""

    @property
    def sentence(self) -> str:
        """The statement that is proved, with its assumption."""
        what = {
            "window": "a vehicle leaves its predicted set within the horizon of one window",
            "vehicle": "a vehicle leaves its predicted set in any window in which it is seen",
        }[self.unit]
        return (
            f"With confidence {self.confidence:.4g}, the probability that {what} is at most {self.epsilon:.3%} "
            f"({self.method}, {self.samples} calibration {self.unit}s, {self.uncovered} of them uncovered, "
            f"{self.bases} bases), if new {self.unit}s are independent draws from the same traffic as the calibration "
            f"{self.unit}s."
        )


def fingerprint(*arrays: np.ndarray) -> str:
    """A short hash of the contents of arrays."""
    digest = hashlib.blake2b(digest_size=8)
    for array in arrays:
        digest.update(repr((array.shape, array.dtype.str)).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
