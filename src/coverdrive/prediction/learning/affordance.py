"""The affordance: 21 features that describe the traffic around a vehicle (paper §2.2, Fig. 2).

They do not depend on the order of the vehicles, nor on their number. The right side is the left side of the mirrored
scene. Clearances along the road are from bumper to bumper, clearances across it from side to side; a vehicle alongside
has a negative clearance along the road. Speeds of others are relative to the own speed.

Lanes are those at each vehicle's own position: the lane beside it is the next one that is there. E edges, L lanes.
"""

import operator
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int

from coverdrive.road import lanes_there, nearest_lane
from coverdrive.scene import Scene

Edges = Float[Array | np.ndarray, "... E"]
"""lat [m] of the lane edges at every vehicle, or of all"""

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


def affordance(scene: Scene, edges: Edges) -> Float[Array, "*batch A 21"]:
    """Features of every vehicle of every scene, in the order of `FEATURES`.

    ``edges`` are the lane edges [m] at every vehicle (`Road.edges_at`), or the same for all. The features of slots
    without a vehicle are finite and meaningless; vehicles off the road are taken to be in the nearest lane.
    """
    left_side, right_side = _Side.of(scene, jnp.asarray(edges)), _Side.of(scene.mirrored(), mirrored_edges(edges))
    itself = jnp.eye(scene.vehicles, dtype=bool)
    ahead = (_between(scene.lon) >= 0) & ~itself  # exactly alongside counts as ahead, itself as behind
    same = _between(left_side.lane) == 0
    left, right = (each.lane[..., None, :] == each.beside[..., None] for each in (left_side, right_side))
    nearest = _nearest(scene, jnp.stack([ahead & same, ahead & left, ~ahead & left, ahead & right, ~ahead & right]))
    front, *beside = (jax.tree.map(operator.itemgetter(index), nearest) for index in range(5))
    left_front, left_rear = (_on_a_side(each, left_side) for each in beside[:2])
    right_front, right_rear = (_on_a_side(each, right_side) for each in beside[2:])
    columns = (
        *(scene.speed, scene.lat - left_side.centre, front.clearance, front.speed),
        *(left_front.clearance, left_front.speed, left_front.lateral),
        *(left_rear.clearance, left_rear.lateral, left_rear.speed),
        *(right_front.clearance, right_front.speed, right_front.lateral),
        *(right_rear.clearance, right_rear.lateral, right_rear.speed),
        *(left_front.length, left_rear.length, right_front.length, right_rear.length, scene.length),
    )
    return jnp.stack([jnp.asarray(column, dtype=jnp.float32) for column in columns], axis=-1)


def mirrored_edges(edges: Edges) -> Edges:
    """The same with left and right exchanged."""
    return -edges[..., ::-1]


def described(scene: Scene, edges: Edges) -> Float[Array, "*batch A F"]:
    """Features of every vehicle as in `affordance`, followed by `MOTION`; a network sees of it what its inputs say."""
    lateral_speed = jnp.asarray(scene.speed * jnp.sin(scene.heading), dtype=jnp.float32)
    return jnp.concatenate([affordance(scene, edges), lateral_speed[..., None]], axis=-1)


class _Side(NamedTuple):
    """What the lanes say about the left side of every vehicle."""

    lane: Int[Array, "*batch A"]
    centre: Float[Array, "*batch A"]
    """[m] of that lane"""
    beside: Int[Array, "*batch A"]
    """the next lane to the left that is there, −1 where there is none"""
    clearance: Float[Array, "*batch A"]
    """[m] to the edge of the road"""

    @staticmethod
    def of(scene: Scene, edges: Edges) -> "_Side":
        lat = jnp.asarray(scene.lat)
        edges = jnp.broadcast_to(edges, (*lat.shape, edges.shape[-1]))
        lane, number = nearest_lane(edges, lat), jnp.arange(edges.shape[-1] - 1)
        further = lanes_there(edges) & (number > lane[..., None])
        centre = jnp.take_along_axis((edges[..., :-1] + edges[..., 1:]) / 2, lane[..., None], axis=-1)[..., 0]
        beside = jnp.where(further.any(-1), further.argmax(-1), -1)
        return _Side(lane, centre, beside, edges[..., -1] - lat - scene.width / 2)


class _Neighbour(NamedTuple):
    """What the features say about one neighbour of every vehicle."""

    clearance: Float[Array, "*batch A"]
    lateral: Float[Array, "*batch A"]
    speed: Float[Array, "*batch A"]
    length: Float[Array, "*batch A"]


def _on_a_side(found: _Neighbour, side: _Side) -> _Neighbour:
    """The neighbour there, or what stands for it where there is no lane."""
    no_lane = side.beside < 0
    clearance = jnp.where(no_lane, 0.0, found.clearance)
    lateral = jnp.where(no_lane, _limited(side.clearance), found.lateral)
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


def _between(values: Array | np.ndarray) -> Array:
    """Value of the other (last axis) minus the own one."""
    return jnp.asarray(values)[..., None, :] - jnp.asarray(values)[..., :, None]


def _mean_of(sizes: Array | np.ndarray) -> Array:
    return (jnp.asarray(sizes)[..., None, :] + jnp.asarray(sizes)[..., :, None]) / 2
