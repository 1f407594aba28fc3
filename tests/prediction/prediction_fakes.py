"""Segments and recordings made by hand, and the settings of a fit that takes seconds."""

import numpy as np
import polars as pl

from coverdrive.prediction.certifying.calibrate import CertificateSettings
from coverdrive.prediction.cover.basis import BasisSettings
from coverdrive.prediction.data.segments import Segments, SegmentSettings
from coverdrive.prediction.fit import PredictionSettings
from coverdrive.prediction.learning.affordance import described_at
from coverdrive.prediction.learning.training import TrainingSettings
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.road import Road
from coverdrive.scene import Scene

SETTINGS = PredictionSettings(
    sets="bases",
    segments=SegmentSettings(stride=0.5),
    basis=BasisSettings(radius=1.0),
    training=TrainingSettings(epochs=10, members=2, hidden=(16,)),
    certificate=CertificateSettings(confidence=0.9, unit="window"),
)


def recording_of(tracks: list[dict[str, object]], name: str = "made", dt: float = 0.1) -> Recording:
    """A recording from tracks given as dicts of columns; scalars are repeated over the track."""
    defaults = {"group": 0, "speed": 20.0, "heading": 0.0, "length": 4.8, "width": 1.9}
    frames = []
    for number, track in enumerate(tracks):
        lon = np.asarray(track["lon"], dtype=float)
        columns = {"vehicle": number, "time": dt * np.arange(len(lon))} | defaults | track
        frames.append(
            pl.DataFrame({key: np.broadcast_to(columns[key], lon.shape) for key in SCHEMA}).cast(dict(SCHEMA))
        )
    return Recording(name, pl.concat(frames), dt, Road.straight(), {})


def described(scene: Scene, edges: np.ndarray) -> np.ndarray:
    """`described_at` of all slots of a scene, or of several; the edges are the same for all of these, or their own."""
    shape = np.shape(scene.lon)
    lanes = np.broadcast_to(edges, (*shape, np.shape(edges)[-1])).reshape(-1, shape[-1], np.shape(edges)[-1])
    scenes = Scene(*(np.reshape(values, (-1, shape[-1])) for values in vars(scene).values()))
    return described_at(scenes, lanes, *np.divmod(np.arange(scenes.lon.size), shape[-1])).reshape(*shape, -1)


def segments_of(points: np.ndarray) -> Segments:
    """One segment of each of N vehicles at 20 m/s along the road, from its N × 7 × 2 points."""
    count, keys = len(points), np.arange(len(points))
    speed, heading, half_sizes = np.full(count, 20.0), np.zeros(points.shape[:2]), np.full((count, 2), [2.4, 0.95])
    return Segments(points, speed, heading, half_sizes, 0.5, keys, keys, np.zeros_like(keys), keys)
