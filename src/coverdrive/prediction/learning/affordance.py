"""The affordance: 21 features that describe the traffic around a vehicle (paper §2.2, Fig. 2).

They do not depend on the order of the vehicles, nor on their number. The right side is the left side of the mirrored
scene. Clearances along the road are from bumper to bumper, clearances across it from side to side; a vehicle alongside
has a negative clearance along the road. Speeds of others are relative to the own speed.
"""

import operator
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float

from coverdrive.road import Road
from coverdrive.scene import Scene

FEATURES = (
    *("speed", "distance to lane centre", "front clearance", "front relative speed"),
    *("left front clearance", "left front relative speed", "left front lateral clearance"),
    *("left rear clearance", "left rear lateral clearance", "left rear relative speed"),
    *("right front clearance", "right front relative speed", "right front lateral clearance"),
    *("right rear clearance", "right rear lateral clearance", "right rear relative speed"),
    *("left front length", "left rear length", "right front length", "right rear length", "own length"),
)
"""Names of the features in the paper's order; lengths and clearances in m, speeds in m/s."""

MOTION = ("lateral speed",)
"""Names of what `described` adds to the features, in m/s, positive to the left."""

CLEARANCE_LIMIT = 50.0
"""[m] clearances are clipped to ± this value, which also stands for "no vehicle" (authors' scripts)"""
FREE_LATERAL_CLEARANCE = 3.6
"""[m] lateral clearance where there is no vehicle: one lane width (authors' scripts)"""


def affordance(scene: Scene, road: Road) -> Float[Array, "*batch A 21"]:
    """Features of every vehicle of every scene, in the order of `FEATURES`.

    Those of slots without a vehicle are finite and meaningless; vehicles off the road are taken to be in the nearest
    lane.
    """
    centre = jnp.asarray(road.centres)[road.lane_of(scene.lat)]
    itself = jnp.eye(scene.vehicles, dtype=bool)
    ahead = (_between(scene.lon) >= 0) & ~itself  # exactly alongside counts as ahead, itself as behind
    same = _lane_offset(scene, road) == 0
    sides = (scene, road), (scene.mirrored(), road.mirrored())
    left, right = (_lane_offset(*side) == 1 for side in sides)
    nearest = _nearest(scene, jnp.stack([ahead & same, ahead & left, ~ahead & left, ahead & right, ~ahead & right]))
    front, *beside = (jax.tree.map(operator.itemgetter(index), nearest) for index in range(5))
    left_front, left_rear = (_on_the_left(each, *sides[0]) for each in beside[:2])
    right_front, right_rear = (_on_the_left(each, *sides[1]) for each in beside[2:])
    columns = (
        *(scene.speed, scene.lat - centre, front.clearance, front.speed),
        *(left_front.clearance, left_front.speed, left_front.lateral),
        *(left_rear.clearance, left_rear.lateral, left_rear.speed),
        *(right_front.clearance, right_front.speed, right_front.lateral),
        *(right_rear.clearance, right_rear.lateral, right_rear.speed),
        *(left_front.length, left_rear.length, right_front.length, right_rear.length, scene.length),
    )
    return jnp.stack([jnp.asarray(column, dtype=jnp.float32) for column in columns], axis=-1)


def described(scene: Scene, road: Road) -> Float[Array, "*batch A F"]:
    """Features of every vehicle as in `affordance`, followed by `MOTION`; a network sees of it what its inputs say."""
    lateral_speed = jnp.asarray(scene.speed * jnp.sin(scene.heading), dtype=jnp.float32)
    return jnp.concatenate([affordance(scene, road), lateral_speed[..., None]], axis=-1)


class _Neighbour(NamedTuple):
    """What the features say about one neighbour of every vehicle."""

    clearance: Float[Array, "*batch A"]
    lateral: Float[Array, "*batch A"]
    speed: Float[Array, "*batch A"]
    length: Float[Array, "*batch A"]


def _on_the_left(found: _Neighbour, scene: Scene, road: Road) -> _Neighbour:
    """The neighbour to the left, or what stands for it where there is no lane."""
    edge_clearance = road.edges[-1] - scene.lat - scene.width / 2
    no_lane = road.lane_of(scene.lat) == road.lanes - 1
    clearance = jnp.where(no_lane, 0.0, found.clearance)
    lateral = jnp.where(no_lane, _limited(edge_clearance), found.lateral)
    return found._replace(clearance=clearance, lateral=lateral)


def _nearest(scene: Scene, mask: Bool[Array, "n *batch A A"]) -> _Neighbour:
    """The neighbour within each ``mask`` (own vehicle × other) with the smallest clearance along the road.

    Where several are equally near, each feature is the smallest of theirs, so that their order plays no role. XLA takes
    much less time for all masks together than one after the other.
    """
    others = mask & scene.valid[..., None, :]
    apart = jnp.abs(_between(scene.lon))
    clearance = apart - _mean_of(scene.length)
    closest = jnp.where(others, clearance, jnp.inf).min(-1, keepdims=True)
    tied = others & (clearance == closest)

    def of_closest(values: Array, default: float) -> Array:
        smallest = jnp.where(tied, values, jnp.inf).min(-1)
        return jnp.where(jnp.isfinite(smallest), smallest, default)

    lateral = jnp.abs(_between(scene.lat)) - _mean_of(scene.width)
    length = jnp.asarray(scene.length)[..., None, :]
    return _Neighbour(
        clearance=_limited(of_closest(clearance, CLEARANCE_LIMIT)),
        lateral=_limited(of_closest(lateral, FREE_LATERAL_CLEARANCE)),
        speed=of_closest(_between(scene.speed), 0.0),
        length=of_closest(length, 0.0),
    )


def _limited(clearance: Array | np.ndarray) -> Array:
    return jnp.clip(clearance, -CLEARANCE_LIMIT, CLEARANCE_LIMIT)


def _lane_offset(scene: Scene, road: Road) -> Array:
    return _between(road.lane_of(scene.lat))


def _between(values: Array | np.ndarray) -> Array:
    """Value of the other (last axis) minus the own one."""
    return jnp.asarray(values)[..., None, :] - jnp.asarray(values)[..., :, None]


def _mean_of(sizes: Array | np.ndarray) -> Array:
    return (jnp.asarray(sizes)[..., None, :] + jnp.asarray(sizes)[..., :, None]) / 2
