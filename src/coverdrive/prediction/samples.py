"""Training samples: the affordance of a moment, and a label for every base trajectory (paper §2.3)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import jax
import numpy as np
from jaxtyping import Bool, Float, Int, Int8

from coverdrive.prediction.affordance import affordance
from coverdrive.prediction.basis import Basis
from coverdrive.prediction.collision import colliding_bases
from coverdrive.prediction.segments import Segments
from coverdrive.recordings.recording import Recording
from coverdrive.scene import Scene

POSSIBLE, OTHER, COLLIDES = 1, 0, -1
"""Labels: the base nearest to what the vehicle did; one that it did not drive; one that would collide (0̄)."""

_CHUNK = 512
_SLOTS = 16


@dataclass(frozen=True)
class Samples:
    """N samples; every recorded segment is one, whatever it does."""

    features: Float[np.ndarray, "N 21"]
    """affordance at the start of the segment"""
    labels: Int8[np.ndarray, "N M"]
    """exactly one `POSSIBLE` in each row"""
    distance: Float[np.ndarray, " N"]
    """atomic norm of the difference to the nearest base; above the basis' ε, no base covers the segment"""
    vehicle: Int[np.ndarray, " N"]
    """key of the vehicle"""
    group: Int[np.ndarray, " N"]
    """group of scenes that may share vehicles"""

    def __len__(self) -> int:
        """Number of samples N."""
        return len(self.features)

    @property
    def base(self) -> Int[np.ndarray, " N"]:
        """Index of the base trajectory nearest to what the vehicle did."""
        return (self.labels == POSSIBLE).argmax(1)

    def of(self, keep: np.ndarray) -> "Samples":
        """The samples selected by an index or boolean array."""
        return replace(self, **{field.name: getattr(self, field.name)[keep] for field in fields(self)})


def make_samples(
    recordings: Sequence[Recording],
    segments: Segments,
    basis: Basis,
    progress: Callable[[float], None] | None = None,
) -> Samples:
    """Describe and label the moments at which segments start.

    Args:
        recordings: what the segments were cut from.
        segments: N segments; may be a selection of those of the recordings.
        basis: M base trajectories.
        progress: called with the share of the recordings done.
    """
    features = np.zeros((len(segments), 21), dtype=np.float32)
    collides = np.zeros((len(segments), len(basis)), dtype=bool)
    for index, recording in enumerate(recordings):
        chosen = np.flatnonzero(segments.recording == index)
        if len(chosen):
            features[chosen], collides[chosen] = _describe(recording, segments.row[chosen], basis)
        if progress is not None:
            progress((index + 1) / len(recordings))
    distance = basis.distance(segments.points)
    nearest = distance.argmin(1)
    labels = np.where(collides, COLLIDES, OTHER).astype(np.int8)
    everyone = np.arange(len(segments))
    labels[everyone, nearest] = POSSIBLE
    return Samples(features, labels, distance[everyone, nearest], segments.vehicle, segments.group)


def _describe(
    recording: Recording, rows: Int[np.ndarray, " n"], basis: Basis
) -> tuple[Float[np.ndarray, "n 21"], Bool[np.ndarray, "n M"]]:
    """Describe in chunks of one size, so that everything is compiled once per number of slots and lanes."""
    frames = recording.frames()
    scenes = frames.scene.padded(_SLOTS)
    features, collides = [], []
    for part in np.split(np.resize(rows, len(rows) + -len(rows) % _CHUNK), range(_CHUNK, len(rows), _CHUNK)):
        scene: Scene = jax.tree.map(lambda values, part=part: values[frames.frame[part]], scenes)
        own = frames.slot[part]
        features.append(np.asarray(_affordance(scene, recording.road))[np.arange(_CHUNK), own])
        collides.append(np.asarray(colliding_bases(basis, scene, own)))
    return np.concatenate(features)[: len(rows)], np.concatenate(collides)[: len(rows)]


_affordance = jax.jit(affordance)
