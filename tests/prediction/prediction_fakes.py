"""Segments made by hand, and the settings of a fit that takes seconds."""

import numpy as np

from coverdrive.prediction.calibrate import CertificateSettings
from coverdrive.prediction.cover.basis import BasisSettings
from coverdrive.prediction.fit import PredictionSettings
from coverdrive.prediction.learning.training import TrainingSettings
from coverdrive.prediction.segments import Segments, SegmentSettings

SETTINGS = PredictionSettings(
    sets="bases",
    segments=SegmentSettings(stride=0.5),
    basis=BasisSettings(radius=1.0),
    training=TrainingSettings(epochs=5),
    certificate=CertificateSettings(confidence=0.9, unit="window"),
)


def segments_of(points: np.ndarray) -> Segments:
    """One segment of each of N vehicles at 20 m/s along the road, from its N × 7 × 2 points."""
    count, keys = len(points), np.arange(len(points))
    speed, heading, half_sizes = np.full(count, 20.0), np.zeros(points.shape[:2]), np.full((count, 2), [2.4, 0.95])
    return Segments(points, speed, heading, half_sizes, 0.5, keys, keys, np.zeros_like(keys), keys)
