"""The axis of scores: log-odds, log(y / (1 − y)), because networks score near 0 and near 1, and thresholds lie near 0.

Scores of the first bin, 0 among them, share a cell at the left end of the axis, and those of the last, 1 among them, at
the right end; an end is shown only if something is there. E edges of B = E − 1 bins.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Shaped
from scipy.special import logit

_END = 0.7
"""log-odds that the cell at an end takes"""

_TICKS = {1e-6: "10⁻⁶", 1e-5: "10⁻⁵", 1e-4: "10⁻⁴", 1e-3: "0.001", 0.01: "0.01", 0.1: "0.1", 0.5: "0.5", 0.9: "0.9",
          0.99: "0.99"}  # fmt: skip

_APART = 1.4
"""log-odds between the tick of an end and the next at least"""


class ScoreAxis(NamedTuple):
    """Where scores are drawn on an axis that is as long as it needs to be."""

    edges: Float[np.ndarray, " E"]
    """[log-odds] of the bins, those of the scores 0 and 1 at the ends of the axis"""
    first: int
    """bin that is shown"""
    last: int
    """bin that is shown"""

    @staticmethod
    def around(
        edges: Float[np.ndarray, " E"], counts: Shaped[np.ndarray, "*rows B"], marks: Float[np.ndarray, " _"]
    ) -> "ScoreAxis":
        """The axis that shows every bin of scores, from 0 to 1, with a count in any row, and every mark in [0, 1]."""
        filled = counts.reshape(-1, len(edges) - 1).sum(0) > 0
        filled[np.searchsorted(edges[1:-1], marks, side="right")] = True
        shown = np.flatnonzero(filled) if filled.any() else np.arange(len(filled))
        inner = logit(edges[1:-1])
        return ScoreAxis(np.concatenate([[inner[0] - _END], inner, [inner[-1] + _END]]), int(shown[0]), int(shown[-1]))

    def place(self, scores: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        """Where scores in [0, 1] are drawn [log-odds]; what is beyond an end is drawn at it."""
        return np.clip(logit(scores), self.edges[0], self.edges[-1])

    @property
    def limits(self) -> tuple[float, float]:
        """Ends of what is shown [log-odds]."""
        return float(self.edges[self.first]), float(self.edges[self.last + 1])

    @property
    def ticks(self) -> dict[float, str]:
        """What stands where [log-odds], from left to right."""
        low, high = self.limits
        ends = {low: "0"} if self.first == 0 else {}
        ends |= {high: "1"} if self.last == len(self.edges) - 2 else {}
        inner = {float(logit(score)): text for score, text in _TICKS.items() if low <= logit(score) <= high}
        apart = {place: text for place, text in inner.items() if all(abs(place - end) > _APART for end in ends)}
        return dict(sorted((ends | apart).items()))
