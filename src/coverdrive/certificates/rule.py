"""The rule that turns scores into a set of possible base trajectories, and how far it reaches around each."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

ROUNDING = 1e-6
"""Thresholds are lowered by this much, so that scores computed in batches of another shape are never missed."""


@dataclass(frozen=True)
class Thresholds:
    """Base j is possible iff its score is at least c_j; a possible base stands for all paths within its tube."""

    values: Float[np.ndarray, " M"]
    """c_j in [0, 1]"""
    tube: Float[np.ndarray, " M"]
    """ρ_j: radius, in the norm of the basis, around each base"""

    @staticmethod
    def at(lowest: Float[np.ndarray, " M"], tube: float) -> "Thresholds":
        """Thresholds at the lowest scores that are not to be missed; infinite ones make a base always possible.

        Args:
            lowest: in [0, 1], or infinite where a base has no score to go by.
            tube: radius ρ, in the norm of the basis, around every base.
        """
        values = np.where(np.isfinite(lowest), np.maximum(lowest - ROUNDING, 0), 0)
        return Thresholds(values, np.full(len(lowest), tube))

    def possible(self, scores: Float[np.ndarray, "*batch M"]) -> Bool[np.ndarray, "*batch M"]:
        """Which bases are possible, for scores of any batch shape."""
        return np.asarray(scores) >= self.values
