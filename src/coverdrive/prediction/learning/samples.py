"""Training samples: the affordance of a moment, and a label for every base trajectory (paper §2.3).

Which bases would collide is seen by putting each on the vehicle's position and speed, and checking for overlap of boxes
with every other vehicle of the scene, which drives on along the road at its present speed.

Which bases cover what a vehicle did is a matter of bodies: it makes a certificate a statement about what planning keeps
clear of. Around every point of a path there is a box: the vehicle's body, turned as the base trajectory turns, and the
tube. A vehicle in the tube sticks out of the box if it is turned otherwise, so its body has to stay in the boxes, too,
for a base to cover what it did. A base that would go backwards is measured as it is; predicted, it stands still
(`motion.follow`), nearer to a vehicle that does not go backwards either: the covered stays in the predicted boxes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Float32, Int, Int8

from coverdrive.geometry import turned_half_extents
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.cover.motion import follow
from coverdrive.prediction.data.parts import parts
from coverdrive.prediction.data.segments import Segments
from coverdrive.prediction.learning.affordance import FEATURES, MOTION, described_at, mirrored_features
from coverdrive.progress import done
from coverdrive.recordings.recording import Recording
from coverdrive.scene import Scene

POSSIBLE, OTHER, COLLIDES = 1, 0, -1
"""Labels: the base that stands for what the vehicle did; one that it did not drive; one that would collide (0̄)."""

CHECK_INTERVAL = 0.25
"""[s] between two moments at which overlap is checked; relative speeds are far below a car length per interval"""

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
    boxes; where none is within the basis' ε, no base covers the segment"""
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
    features = make_features(recordings, segments)
    collides = _colliding(recordings, segments, basis, mirrored)
    driven = segments.mirrored if mirrored else segments
    apart = basis.distance(driven.points)
    distance = np.maximum(apart, body_radius(basis, driven))
    base = apart.argmin(1)
    if assignment == "covering":
        covered = distance <= basis.radius
        base = np.where(covered.any(1), covered.argmax(1), base)
    seen = mirrored_features(features) if mirrored else features
    return Samples(seen, distance, collides, base, segments.vehicle, segments.group)


def make_features(recordings: Sequence[Recording], segments: Segments) -> Float32[np.ndarray, "N F"]:
    """The affordance at the start of every segment, followed by the lateral speed."""
    features = np.empty((len(segments), len(FEATURES) + len(MOTION)), dtype=np.float32)
    for index, recording in enumerate(recordings):
        chosen = np.flatnonzero(segments.recording == index)
        if len(chosen):
            frames, rows = recording.frames(), segments.row[chosen]
            edges = recording.road.edges_at(frames.scene.lon)
            features[chosen] = described_at(frames.scene, edges, frames.frame[rows], frames.slot[rows])
        done(index + 1, len(recordings))
    return features


def _colliding(
    recordings: Sequence[Recording], segments: Segments, basis: Basis, mirrored: bool
) -> Bool[np.ndarray, "N M"]:
    """Which bases would collide, in chunks of one size, so that all is compiled once per number of slots."""
    collides = np.zeros((len(segments), len(basis)), dtype=bool)
    for index, recording in enumerate(recordings):
        chosen = np.flatnonzero(segments.recording == index)
        frames = recording.frames()
        scenes = frames.scene.padded(_SLOTS)
        for first in range(0, len(chosen), _CHUNK):
            place = chosen[first : first + _CHUNK]
            rows = np.resize(segments.row[place], _CHUNK)
            frame = frames.frame[rows]
            scene: Scene = jax.tree.map(lambda values, frame=frame: values[frame], scenes)
            found = colliding_bases(basis, scene.mirrored() if mirrored else scene, frames.slot[rows])
            collides[place] = np.asarray(found)[: len(place)]
        done(index + 1, len(recordings))
    return collides


def colliding_bases(basis: Basis, scene: Scene, own: Int[np.ndarray, " N"]) -> Bool[Array, "N M"]:
    """Whether each base trajectory of one vehicle per scene, in slot ``own``, hits another within the horizon."""
    times = np.arange(CHECK_INTERVAL, basis.horizon + 1e-9, CHECK_INTERVAL)
    deviation, _ = basis.rollout(times)
    return _collides(deviation, times, scene, own)


@jax.jit
def _collides(
    deviation: Float[Array, "M n 2"], times: Float[Array, " n"], scene: Scene, own: Int[Array, " N"]
) -> Bool[Array, "N M"]:
    slots = own[:, None]
    speed = scene.speed * jnp.cos(scene.heading)

    def own_of(values: Array | np.ndarray) -> Array:
        return jnp.take_along_axis(jnp.asarray(values), slots, axis=1)

    others = scene.valid & (jnp.arange(scene.vehicles) != slots)
    lon, lat, closing = (values - own_of(values) for values in (scene.lon, scene.lat, speed))
    length, width = ((sizes + own_of(sizes)) / 2 for sizes in (scene.length, scene.width))
    hit = jnp.zeros((len(own), deviation.shape[0]), dtype=bool)
    for k in range(len(times)):
        apart_lon = (lon + closing * times[k])[:, None, :] - deviation[None, :, k, 0, None]
        apart_lat = lat[:, None, :] - deviation[None, :, k, 1, None]
        overlap = (jnp.abs(apart_lon) < length[:, None, :]) & (jnp.abs(apart_lat) < width[:, None, :])
        hit |= (overlap & others[:, None, :]).any(-1)
    return hit


def body_radius(basis: Basis, segments: Segments) -> Float[np.ndarray, "N M"]:
    """The least radius of the tube around every base with which the boxes hold the whole body at every point."""
    tube, (deviation, rate) = basis.tube(basis.times)[1:], basis.rollout(basis.times)
    result = np.empty((len(segments), len(basis)))
    for part in parts(len(segments)):
        few = segments.of(part)
        body, still = turned_half_extents(few.half_sizes[:, None], few.heading), np.zeros(len(few))
        state = np.stack([still, still, few.speed, still], axis=-1)
        for base, points in enumerate(basis.points):
            heading = follow(state, basis.times, deviation[base], rate[base])[..., 3]
            beyond = body - turned_half_extents(few.half_sizes[:, None], heading)
            result[part, base] = ((np.abs(few.points - points) + beyond)[:, 1:] / tube).max((1, 2))
    return result
