"""What is worth keeping of a fit besides the predictor: what its pictures show, in one small file.

M base trajectories of T points, B bins of scores.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from scipy.special import expit, logit

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.prediction.fit import Fit
from coverdrive.prediction.storage import loaded, save_arrays

EDGES: Float[np.ndarray, " E"] = np.concatenate([[0.0], expit(np.linspace(logit(1e-6), logit(1 - 1e-3), 83)), [1.0]])
"""of the bins in which scores are counted: inner ones have equal log-odds, fine where thresholds lie, which give way by
the lowest for rounding"""


@dataclass(frozen=True)
class Learned:
    """Shares, examples, losses and distributions; where sets are boxes, there are M = 0 bases."""

    base_share: Float[np.ndarray, " M"]
    """share of the training windows that each base stands for"""
    examples: Float[np.ndarray, "M T 2"]
    """[m] the training segment farthest from each base among those that it covers; the base itself if it covers none"""
    losses: Float[np.ndarray, " epochs"]
    """mean training loss of every epoch"""
    edges: Float[np.ndarray, " E"]
    """of the B = E − 1 bins of scores, from 0 to 1"""
    driven: Int[np.ndarray, "M B"]
    """calibration windows by the score of the base that they drove"""
    others: Int[np.ndarray, "M B"]
    """calibration windows that drove another base, by the score of this one"""
    set_sizes: Int[np.ndarray, " S"]
    """test windows by the size of their predicted set, 0 … M = S − 1"""

    @staticmethod
    def of(fit: Fit) -> "Learned":
        """Take it from a fit."""
        driven = others = np.zeros((0, len(EDGES) - 1), dtype=np.int64)
        sizes = np.zeros(0, dtype=np.int64)
        if fit.predictor.basis is not None:
            driven, others = score_histograms(fit.scored.calibration, EDGES)
            sizes = fit.predictor.rule.possible(fit.scored.test.scores).sum(1)
        return Learned(
            base_share=fit.base_share,
            examples=_examples(fit),
            losses=fit.losses,
            edges=EDGES,
            driven=driven,
            others=others,
            set_sizes=np.bincount(sizes, minlength=len(fit.base_share) + 1),
        )

    def save(self, path: Path) -> None:
        """Write it to a file; an interrupted write leaves no file behind."""
        save_arrays(path, "learned", {}, vars(self))

    @staticmethod
    def load(path: Path) -> "Learned":
        """Read what `save` wrote; else raise `DataError`."""
        with loaded(path, "learned", "coverdrive fit") as (_, arrays):
            return Learned(**arrays)


def score_histograms(
    samples: ScoredSamples, edges: Float[np.ndarray, " E"]
) -> tuple[Int[np.ndarray, "M B"], Int[np.ndarray, "M B"]]:
    """For every base, the scores of samples that drove it and of those that drove another one, counted in bins."""
    bases = range(samples.scores.shape[1])
    mine = [samples.base == base for base in bases]
    driven = [np.histogram(samples.scores[mine[base], base], edges)[0] for base in bases]
    others = [np.histogram(samples.scores[~mine[base], base], edges)[0] for base in bases]
    return np.stack(driven), np.stack(others)


def _examples(fit: Fit) -> Float[np.ndarray, "M T 2"]:
    """The farthest training segment that each base covers."""
    basis, segments = fit.predictor.basis, fit.segments.points[fit.split.train]
    if basis is None:
        return segments[:0]
    distance = basis.distance(segments)
    farthest = np.where(distance <= basis.radius, distance, -1.0)
    found = farthest.max(0) >= 0
    return np.where(found[:, None, None], segments[farthest.argmax(0)], basis.points)
