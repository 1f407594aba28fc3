"""Training samples: the affordance of a moment, and a label for every base trajectory (paper §2.3)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Literal

import jax
import numpy as np
from jaxtyping import Bool, Float, Int, Int8

from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.learning.affordance import FEATURES, MOTION, Edges, described, mirrored_edges
from coverdrive.prediction.learning.bodies import body_radius
from coverdrive.prediction.learning.collision import colliding_bases
from coverdrive.prediction.segments import Segments
from coverdrive.progress import done
from coverdrive.recordings.recording import Recording
from coverdrive.scene import Scene

POSSIBLE, OTHER, COLLIDES = 1, 0, -1
"""Labels: the base that stands for what the vehicle did; one that it did not drive; one that would collide (0̄)."""

_CHUNK = 512
_SLOTS = 16


Assignment = Literal["covering", "nearest"]
"""Which base stands for what a vehicle did: one that covers it, or only the nearest (the paper)"""


@dataclass(frozen=True)
class Samples:
    """N samples; every recorded segment is one, whatever it does."""

    features: Float[np.ndarray, "N F"]
    """affordance at the start of the segment, followed by the lateral speed"""
    distance: Float[np.ndarray, "N M"]
    """radius of the tube around every base in which the vehicle stays: its centre by the atomic norm, its body by the
    boxes (`coverdrive.prediction.learning.bodies`); where none is within the basis' ε, no base covers the segment"""
    collides: Bool[np.ndarray, "N M"]
    """whether each base would collide"""
    base: Int[np.ndarray, " N"]
    """the base that stands for what the vehicle did"""
    vehicle: Int[np.ndarray, " N"]
    """key of the vehicle"""
    group: Int[np.ndarray, " N"]
    """scene group"""

    def __len__(self) -> int:
        """Number of samples N."""
        return len(self.features)

    @property
    def labels(self) -> Int8[np.ndarray, "N M"]:
        """`POSSIBLE` for the one base that was driven, `COLLIDES` or `OTHER` for the others."""
        labels = np.where(self.collides, COLLIDES, OTHER).astype(np.int8)
        labels[np.arange(len(self)), self.base] = POSSIBLE
        return labels

    def of(self, keep: np.ndarray) -> "Samples":
        """The samples selected by an index or boolean array."""
        return replace(self, **{field.name: getattr(self, field.name)[keep] for field in fields(self)})

    def and_also(self, others: "Samples") -> "Samples":
        """These samples followed by others of the same basis."""
        pairs = ((getattr(self, field.name), getattr(others, field.name)) for field in fields(self))
        return Samples(*map(np.concatenate, pairs))


def make_samples(
    recordings: Sequence[Recording],
    segments: Segments,
    basis: Basis,
    assignment: Assignment = "covering",
    mirrored: bool = False,
) -> Samples:
    """Describe and label the moments at which segments, or a selection of them, start in the recordings.

    The first base in the basis' order of choice that covers a segment stands for it, so that few bases stand for most,
    or the nearest by the atomic norm, as where none covers it. Mirrored: the mirror images of scenes and segments.
    """

    def look(scene: Scene, edges: Edges, own: np.ndarray) -> tuple[np.ndarray, ...]:
        return _seen(scene, edges, own), np.asarray(colliding_bases(basis, scene, own))

    empty = np.zeros((0, len(FEATURES) + len(MOTION)), dtype=np.float32), np.zeros((0, len(basis)), dtype=bool)
    features, collides = _looked(recordings, segments, mirrored, look, empty)
    driven = segments.mirrored if mirrored else segments
    apart = basis.distance(driven.points)
    distance = np.maximum(apart, body_radius(basis, driven))
    base = apart.argmin(1)
    if assignment == "covering":
        covered = distance <= basis.radius
        base = np.where(covered.any(1), covered.argmax(1), base)
    return Samples(features, distance, collides, base, segments.vehicle, segments.group)


def make_features(
    recordings: Sequence[Recording], segments: Segments, mirrored: bool = False
) -> Float[np.ndarray, "N F"]:
    """The affordance at the start of every segment, or of its mirror image, followed by the lateral speed."""
    empty = np.zeros((0, len(FEATURES) + len(MOTION)), dtype=np.float32)
    return _looked(recordings, segments, mirrored, lambda *moment: (_seen(*moment),), (empty,))[0]


def _looked(
    recordings: Sequence[Recording],
    segments: Segments,
    mirrored: bool,
    look: Callable[[Scene, Edges, np.ndarray], tuple[np.ndarray, ...]],
    empty: tuple[np.ndarray, ...],
) -> list[np.ndarray]:
    """What ``look`` says of the moments at which segments start, of the lane edges then, and of their vehicles' slots.

    In chunks of one size, so that everything is compiled once per number of slots and lanes.
    """
    found, places = [empty], [np.arange(0)]
    for index, recording in enumerate(recordings):
        chosen = np.flatnonzero(segments.recording == index)
        frames = recording.frames()
        scenes = frames.scene.padded(_SLOTS)
        for first in range(0, len(chosen), _CHUNK):
            place = chosen[first : first + _CHUNK]
            rows = np.resize(segments.row[place], _CHUNK)
            frame = frames.frame[rows]
            scene: Scene = jax.tree.map(lambda values, frame=frame: values[frame], scenes)
            edges = recording.road.edges_at(scene.lon).astype(np.float32)
            if mirrored:
                scene, edges = scene.mirrored(), mirrored_edges(edges)
            found.append(tuple(values[: len(place)] for values in look(scene, edges, frames.slot[rows])))
            places.append(place)
        done(index + 1, len(recordings))
    order = np.argsort(np.concatenate(places), kind="stable")
    return [np.concatenate(parts)[order] for parts in zip(*found, strict=True)]


def _seen(scene: Scene, edges: Edges, own: np.ndarray) -> np.ndarray:
    return np.asarray(_described(scene, edges))[np.arange(_CHUNK), own]


_described = jax.jit(described)
