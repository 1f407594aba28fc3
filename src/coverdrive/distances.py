"""How near vehicles come to one another: the distances that people keep, and that one may wish for.

A leader is the nearest vehicle ahead in the lane of a vehicle's centre, a follower the nearest behind. m moments, n
vehicles that are looked at, A slots.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from coverdrive.geometry import turned_half_extents
from coverdrive.road import Road
from coverdrive.scene import Scene

FREE = 3.0
"""[s] headway from which on one drives as fast as one wants"""

STANDING = 0.1
"""[m/s] below which no time headway is larger"""


class Kept(NamedTuple):
    """Distances of vehicles at moments, and who follows; infinite where there is nobody, or they do not come nearer."""

    headway: Float[np.ndarray, "m *n"]
    """[s] from the front to the rear of the leader, at the own speed"""
    left: Float[np.ndarray, "m *n"]
    """[s] headway that is left to the follower"""
    follower: Int[np.ndarray, "m *n"]
    """its slot; any where nobody follows"""
    beside: Float[np.ndarray, "m *n"]
    """[m] across to the nearest body alongside"""
    time_to_collision: Float[np.ndarray, "m *n"]
    """[s] to the first contact with anybody if all kept their velocity"""


def kept(scene: Scene, road: Road, slots: Int[np.ndarray, " n"]) -> Kept:
    """The distances of some slots in a scene with leading axis m; bodies are boxes along the road."""
    states, valid = scene.states, np.asarray(scene.valid)
    extents, lane = turned_half_extents(scene.half_sizes, states[..., 3]), road.lane_at(scene.lon, scene.lat)
    apart = states[:, None, :, :2] - states[:, slots, None, :2]
    gap = np.abs(apart) - extents[:, None] - extents[:, slots, None]
    other = valid[:, None] & valid[:, slots, None] & (np.arange(scene.vehicles) != slots[:, None])
    same = other & (lane[:, None] == lane[:, slots, None])
    along, ahead = np.maximum(gap[..., 0], 0.0), apart[..., 0] > 0
    speed = np.maximum(np.abs(states[..., 2]), STANDING)
    behind = np.where(same & ~ahead, along, np.inf)
    follower = behind.argmin(-1)
    return Kept(
        headway=along.min(-1, initial=np.inf, where=same & ahead) / speed[:, slots],
        left=behind.min(-1, initial=np.inf) / np.take_along_axis(speed, follower, -1),
        follower=follower,
        beside=gap[..., 1].min(-1, initial=np.inf, where=other & (gap[..., 0] < 0) & (gap[..., 1] > 0)),
        time_to_collision=_times_to_collision(states, apart, gap, slots).min(-1, initial=np.inf, where=other),
    )


def _times_to_collision(
    states: Float[np.ndarray, "m A 4"], apart: Float[np.ndarray, "m n A 2"], gap: Float[np.ndarray, "m n A 2"],
    slots: Int[np.ndarray, " n"],
) -> Float[np.ndarray, "m n A"]:  # fmt: skip
    """[s] to contact with each slot; velocities have two components, so that contact from the side counts as well."""
    speed, heading = states[..., 2], states[..., 3]
    velocity = np.stack([speed * np.cos(heading), speed * np.sin(heading)], axis=-1)
    velocity = velocity[:, None] - velocity[:, slots, None]
    reach = np.abs(apart) - gap
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        crossings = np.stack([(-reach - apart) / velocity, (reach - apart) / velocity])
    enter = np.where(velocity == 0, np.where(gap < 0, -np.inf, np.inf), crossings.min(0)).max(-1)
    leave = np.where(velocity == 0, np.where(gap < 0, np.inf, -np.inf), crossings.max(0)).min(-1)
    enter = np.maximum(enter, 0.0)
    return np.where(enter < leave, enter, np.inf)
