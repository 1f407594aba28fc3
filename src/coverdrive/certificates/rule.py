"""Rules that turn scores into a set of possible base trajectories, and how far they reach around each.

N samples, M base trajectories, H neurons in the last hidden layer.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.errors import CertificateError

ROUNDING = 1e-6
"""Rules give way by this much, so that scores computed in batches of another shape are never missed."""

LEAST = 1e-3
"""Scores of boxes below it are outside every set: none is more than a thousand times as large as it was learned."""


@dataclass(frozen=True)
class Thresholds:
    """Base j is possible iff its score is at least c_j."""

    values: Float[np.ndarray, " M"]
    """c_j in [0, 1]"""
    tube: Float[np.ndarray, " M"]
    """ρ_j: radius, in the norm of the basis, around each base"""
    kind: ClassVar[str] = "thresholds"
    """name in files"""

    @staticmethod
    def at(lowest: Float[np.ndarray, " M"], tube: float | Float[np.ndarray, " M"]) -> "Thresholds":
        """Thresholds at the lowest scores that are not to be missed; infinite ones make a base always possible."""
        values = np.where(np.isfinite(lowest), np.maximum(lowest - ROUNDING, 0), 0)
        return Thresholds(values, np.broadcast_to(np.asarray(tube, dtype=float), lowest.shape).copy())

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """All that the rule consists of, by name; `rule_of` makes the same rule from it."""
        return {"thresholds": self.values, "tube": self.tube}

    def possible(
        self, scores: Float[np.ndarray, "*batch M"], hidden: Float[np.ndarray, "*batch H"] | None = None
    ) -> Bool[np.ndarray, "*batch M"]:
        """Which bases are possible; this rule does not look at the last hidden layer."""
        return np.asarray(scores) >= self.values


@dataclass(frozen=True)
class Hyperplanes:
    """Base j is possible iff the last hidden layer h is on the positive side, w_j·h + b_j ≥ 0, of its hyperplane."""

    weights: Float[np.ndarray, "M H"]
    """w_j; zero for a base that is always possible"""
    offsets: Float[np.ndarray, " M"]
    """b_j, the margin for rounding included"""
    tube: Float[np.ndarray, " M"]
    kind: ClassVar[str] = "hyperplanes"

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """All that the rule consists of, by name; `rule_of` makes the same rule from it."""
        return {"hyperplane_weights": self.weights, "hyperplane_offsets": self.offsets, "tube": self.tube}

    def possible(
        self, scores: Float[np.ndarray, "*batch M"], hidden: Float[np.ndarray, "*batch H"] | None = None
    ) -> Bool[np.ndarray, "*batch M"]:
        """Which bases are possible; `CertificateError` if the last hidden layer is missing or another network's."""
        neurons = self.weights.shape[1]
        if hidden is None or hidden.shape[-1] != neurons:
            got = "none" if hidden is None else f"{hidden.shape[-1]}"
            raise CertificateError(
                f"hyperplanes need the {neurons} values of the last hidden layer, got {got}; "
                "score the samples with the network that the rule was made for"
            )
        return np.asarray(hidden, dtype=float) @ self.weights.T + self.offsets >= 0


Rule = Thresholds | Hyperplanes
"""Says which bases are possible; a possible base stands for all paths within its tube"""


def rule_of(kind: str, arrays: Mapping[str, np.ndarray]) -> Rule:
    """The rule of a kind that the arrays came from; other names are ignored, another kind is a `CertificateError`."""
    if kind == Thresholds.kind:
        return Thresholds(arrays["thresholds"], arrays["tube"])
    if kind == Hyperplanes.kind:
        return Hyperplanes(arrays["hyperplane_weights"], arrays["hyperplane_offsets"], arrays["tube"])
    raise CertificateError(f"no rule is called {kind!r}; expected {Thresholds.kind!r} or {Hyperplanes.kind!r}")


def scale_of(rule: Rule) -> float:
    """How many times as large as they were learned boxes are (`coverdrive.prediction.boxes`), by the one threshold."""
    return 1 / max(float(rule.arrays["thresholds"][0]), LEAST) - 1
