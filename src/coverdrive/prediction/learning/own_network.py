"""A network of the user's own: any function of features that gives scores, be it NumPy, PyTorch or ONNX.

`coverdrive.prediction.fit.fit` asks a `Learner` for it, and whatever it scores is calibrated, certified, planned
against and driven like the scores of the network of this package.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from coverdrive.errors import DataError
from coverdrive.prediction.learning.affordance import FEATURES
from coverdrive.prediction.learning.inputs import Inputs
from coverdrive.prediction.learning.samples import Samples

Scorer = Callable[[Float[np.ndarray, "N F"]], Any]
"""Gives N × M scores in [0, 1] for the features of N vehicles; a PyTorch or JAX array will do"""

Learner = Callable[[Samples], Scorer]
"""Makes one from the training samples: their ``features``, ``labels``, and the ``base`` that each vehicle drove"""


@dataclass(frozen=True)
class OwnNetwork:
    """Scores by a function of the user."""

    function: Scorer
    inputs: Inputs
    """what it sees: the 21 features of `FEATURES`, or with "motion", the lateral speed after them"""
    bases: int
    """number M of base trajectories that it scores"""

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """None: what the function consists of is not known."""
        return {}

    @property
    def kind(self) -> dict[str, str]:
        """What it sees and what it is, by name."""
        return {"inputs": self.inputs, "output": "own"}

    def scores(self, features: Float[np.ndarray, "N F"]) -> Float[np.ndarray, "N M"]:
        """Score of every base trajectory, in [0, 1]; `DataError` where the function gives something else."""
        scores = np.asarray(self.function(seen_by(features, self.inputs)))
        if scores.shape != (len(features), self.bases) or not ((scores >= 0) & (scores <= 1)).all():
            raise DataError(
                f"the network was given {len(features)} × {features.shape[1]} features and must give {len(features)} × "
                f"{self.bases} scores in [0, 1], got an array of shape {scores.shape}"
                + (f" with values from {np.min(scores)} to {np.max(scores)}" if scores.size else "")
                + "; one column for each base trajectory, after a sigmoid or a softmax"
            )
        return scores


def seen_by(features: Float[np.ndarray, "N F"], inputs: Inputs) -> Float[np.ndarray, "N _"]:
    """The features without the lateral speed, unless the inputs hold the motion."""
    return features if inputs == "motion" else features[:, : len(FEATURES)]
