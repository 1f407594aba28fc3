"""Scores of a network on samples with a known outcome, and those of a whole split in one file."""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from coverdrive.certificates.calibration import ScoredSamples
from coverdrive.errors import DataError
from coverdrive.prediction.learning.network import Network
from coverdrive.prediction.learning.own_network import OwnNetwork
from coverdrive.prediction.learning.samples import Samples
from coverdrive.prediction.predictor import AnyPredictor
from coverdrive.prediction.storage import loaded, save_arrays

_SIDES = ("train", "calibration", "test")


@dataclass(frozen=True)
class ScoredSides:
    """Scores of the samples of each side of a split, by the network of one predictor."""

    train: ScoredSamples
    calibration: ScoredSamples
    test: ScoredSamples
    predictor: str
    """fingerprint of the predictor at scale 1"""

    @property
    def crossed(self) -> bool:
        """Whether the vehicles that calibrate also test (`coverdrive.prediction.data.split`)."""
        return np.array_equal(self.calibration.vehicle, self.test.vehicle)

    def apart(self, seed: int) -> tuple[ScoredSamples, ScoredSamples]:
        """What calibrates and what tests without a vehicle in both: where they are the same, a half each, by chance."""
        if not self.crossed:
            return self.calibration, self.test
        _, vehicle = np.unique(self.calibration.vehicle, return_inverse=True)
        tests = np.random.default_rng(seed).permutation(vehicle.max() + 1)[vehicle] % 2 == 1
        return self.calibration.of(np.flatnonzero(~tests)), self.calibration.of(np.flatnonzero(tests))

    def save(self, path: Path) -> None:
        """Write them to a file; an interrupted write leaves no file behind."""
        arrays = {
            f"{side}.{name}": values
            for side in _SIDES
            for name, values in vars(getattr(self, side)).items()
            if values is not None
        }
        save_arrays(path, "scores", {"predictor": self.predictor}, arrays)

    @staticmethod
    def load(path: Path, predictor: AnyPredictor) -> "ScoredSides":
        """Read what `save` wrote; else, or if they are not those of the predictor, raise `DataError`."""
        with loaded(path, "scores", "coverdrive fit") as (header, arrays):
            names = [each.name for each in fields(ScoredSamples)]
            sides = (
                ScoredSamples(**{name: arrays[f"{side}.{name}"] for name in names if f"{side}.{name}" in arrays})
                for side in _SIDES
            )
            scored = ScoredSides(*sides, predictor=header["predictor"])
        if scored.predictor != (expected := predictor.scaled(1).fingerprint):
            raise DataError(
                f"{path}: these are scores of the predictor {scored.predictor}, expected those of {expected}; a "
                "predictor and its scores are made together, by `coverdrive fit`"
            )
        return scored


def score(network: Network | OwnNetwork, samples: Samples, tube: float | None = None) -> ScoredSamples:
    """Scores, and the last hidden layer, of samples with a known outcome.

    A vehicle is in its predicted set if it stays within ``tube`` of any possible base: of the bases that it stayed that
    close to, the one with the highest score stands for what it did. Without a tube, and where no base is that close, it
    is the base of the samples.
    """
    if isinstance(network, OwnNetwork):
        scores, hidden = network.scores(samples.features), None
    else:
        scores, hidden = network.scores_and_hidden(samples.features)
    base = samples.base
    if tube is not None:
        covering = samples.distance <= tube
        base = np.where(covering.any(1), np.where(covering, scores, -1).argmax(1), base)
    distance = samples.distance[np.arange(len(samples)), base]
    return ScoredSamples(scores, base, distance, samples.vehicle, hidden, samples.group)
