"""The affordance: 21 features that describe the traffic around a vehicle (paper §2.2, Fig. 2).

They do not depend on the order of the vehicles, nor on their number. Left and right are one piece of code: the right
side is the left side of the mirrored scene. This is the only affordance function of the package; training,
simulation and figures all call it.

Clearances along the road are from bumper to bumper, clearances across it from side to side; a vehicle alongside has
a negative clearance along the road. Speeds of others are relative to the own speed.
"""

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float

from coverdrive.road import Road
from coverdrive.scene import Scene

FEATURES = (
    "speed",
    "distance to lane centre",
    "front clearance",
    "front relative speed",
    "left front clearance",
    "left front relative speed",
    "left front lateral clearance",
    "left rear clearance",
    "left rear lateral clearance",
    "left rear relative speed",
    "right front clearance",
    "right front relative speed",
    "right front lateral clearance",
    "right rear clearance",
    "right rear lateral clearance",
    "right rear relative speed",
    "left front length",
    "left rear length",
    "right front length",
    "right rear length",
    "own length",
)
"""Names of the features in the paper's order; lengths and clearances in m, speeds in m/s."""

MOTION = ("lateral speed",)
"""Names of what `described` adds to the features, in m/s, positive to the left."""

CLEARANCE_LIMIT = 50.0
"""[m] clearances are clipped to ± this value, which also stands for "no vehicle" (authors' scripts)"""
FREE_LATERAL_CLEARANCE = 3.6
"""[m] lateral clearance where there is no vehicle: one lane width (authors' scripts)"""


def affordance(scene: Scene, road: Road) -> Float[Array, "*batch A 21"]:
    """Features of every vehicle of every scene.

    Args:
        scene: any leading batch axes; features of slots that hold no vehicle are finite and meaningless.
        road: lanes; vehicles off the road are taken to be in the nearest lane.

    Returns:
        The features in the order of `FEATURES`.
    """
    centre = jnp.asarray(road.centres)[road.lane_of(scene.lat)]
    front = _nearest(scene, _ahead(scene) & (_lane_offset(scene, road) == 0))
    left_front, left_rear = _left_side(scene, road)
    right_front, right_rear = _left_side(scene.mirrored(), road.mirrored())
    columns = (
        scene.speed,
        scene.lat - centre,
        front.clearance,
        front.speed,
        left_front.clearance,
        left_front.speed,
        left_front.lateral,
        left_rear.clearance,
        left_rear.lateral,
        left_rear.speed,
        right_front.clearance,
        right_front.speed,
        right_front.lateral,
        right_rear.clearance,
        right_rear.lateral,
        right_rear.speed,
        left_front.length,
        left_rear.length,
        right_front.length,
        right_rear.length,
        scene.length,
    )
    return jnp.stack([jnp.asarray(column, dtype=jnp.float32) for column in columns], axis=-1)


def described(scene: Scene, road: Road) -> Float[Array, "*batch A F"]:
    """Features of every vehicle as in `affordance`, followed by `MOTION`; a network sees of it what its inputs say."""
    lateral_speed = jnp.asarray(scene.speed * jnp.sin(scene.heading), dtype=jnp.float32)
    return jnp.concatenate([affordance(scene, road), lateral_speed[..., None]], axis=-1)


class _Neighbour:
    """What the features say about one neighbour of every vehicle; each field is (*batch, A)."""

    def __init__(self, clearance: Array, lateral: Array, speed: Array, length: Array):
        limit = CLEARANCE_LIMIT
        self.clearance = jnp.clip(clearance, -limit, limit)
        self.lateral = jnp.clip(lateral, -limit, limit)
        self.speed = speed
        self.length = length


def _left_side(scene: Scene, road: Road) -> tuple[_Neighbour, _Neighbour]:
    beside = _lane_offset(scene, road) == 1
    edge_clearance = road.edges[-1] - scene.lat - scene.width / 2
    no_lane = road.lane_of(scene.lat) == road.lanes - 1

    def nearest(mask: Bool[Array, "*batch A A"]) -> _Neighbour:
        found = _nearest(scene, mask & beside)
        clearance = jnp.where(no_lane, 0.0, found.clearance)
        lateral = jnp.where(no_lane, edge_clearance, found.lateral)
        return _Neighbour(clearance, lateral, found.speed, found.length)

    ahead = _ahead(scene)
    return nearest(ahead), nearest(~ahead)


def _nearest(scene: Scene, mask: Bool[Array, "*batch A A"]) -> _Neighbour:
    """The neighbour within ``mask`` (own vehicle × other) with the smallest clearance along the road.

    Where several are equally near, each feature is the smallest of theirs, so that their order plays no role.
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
    length = jnp.broadcast_to(scene.length[..., None, :], tied.shape)
    return _Neighbour(
        clearance=of_closest(clearance, CLEARANCE_LIMIT),
        lateral=of_closest(lateral, FREE_LATERAL_CLEARANCE),
        speed=of_closest(_between(scene.speed), 0.0),
        length=of_closest(length, 0.0),
    )


def _ahead(scene: Scene) -> Bool[Array, "*batch A A"]:
    """Whether the other (last axis) is ahead of the vehicle; exactly alongside counts as ahead, itself as behind."""
    itself = jnp.eye(scene.vehicles, dtype=bool)
    return (_between(scene.lon) >= 0) & ~itself


def _lane_offset(scene: Scene, road: Road) -> Array:
    return _between(road.lane_of(scene.lat))


def _between(values: Array | np.ndarray) -> Array:
    """Value of the other (last axis) minus the own one."""
    return jnp.asarray(values)[..., None, :] - jnp.asarray(values)[..., :, None]


def _mean_of(sizes: Array | np.ndarray) -> Array:
    return (jnp.asarray(sizes)[..., None, :] + jnp.asarray(sizes)[..., :, None]) / 2
