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
    dimension: int
    """greatest number of calibration samples that can determine the rule"""
    paper_epsilon: float
    """the bound by the paper's Theorem 1, Φ(ε, n + 1, N₂) for n decision variables: valid and looser"""
    bases: int
    """number M of base trajectories"""
    unseen_bases: int
    """bases without a calibration sample; they are always possible"""
    discarded: int
    """calibration samples that the rule is allowed to miss"""
    tube: float
    """greatest radius around a base, in the norm of the basis, within which a vehicle has to stay"""
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
            f"({self.method}, {self.samples} calibration {self.unit}s, {self.dimension} supporting samples at most), "
            f"if new {self.unit}s are independent draws from the same traffic as the calibration {self.unit}s."
        )


def fingerprint(*arrays: np.ndarray) -> str:
    """A short hash of the contents of arrays."""
    digest = hashlib.blake2b(digest_size=8)
    for array in arrays:
        digest.update(repr((array.shape, array.dtype.str)).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
