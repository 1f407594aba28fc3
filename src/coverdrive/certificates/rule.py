"""The rule that turns scores into a set of possible base trajectories, and how far it reaches around each."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float


@dataclass(frozen=True)
class Thresholds:
    """Base j is possible iff its score is at least c_j; a possible base stands for all paths within its tube."""

    values: Float[np.ndarray, " M"]
    """c_j in [0, 1]"""
    tube: Float[np.ndarray, " M"]
    """ρ_j: radius, in the norm of the basis, around each base"""

    def possible(self, scores: Float[np.ndarray, "*batch M"]) -> Bool[np.ndarray, "*batch M"]:
        """Which bases are possible, for scores of any batch shape."""
        return np.asarray(scores) >= self.values
