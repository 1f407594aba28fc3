"""Whose driving led to a collision (own definition; the paper counts kinds of collisions alone).

From the side it is whoever moved faster towards the other. Else it is whoever ran into the one ahead, unless that one
had just cut in: it came sideways into the way of the one behind, too near for that one to brake in time, which then
came nearer and nearer until the contact.

What is too near follows UN Regulation No. 79 (5.6.4.7, automatic lane changes): a vehicle that is faster by Δv
is given 0.4 s to react, and is then asked for 3 m/s², so that it needs Δv · 0.4 s + Δv² / (2 · 3 m/s²). The regulation
adds the way of the one ahead in 1 s, which is left out: there a distance is to remain, here no contact is to follow.
It looks at the moment at which a car crosses the marking; here it is when the bodies begin to overlap across the road.
"""

from collections.abc import Sequence

import numpy as np

from coverdrive.geometry import axis_gap, turned_half_extents
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drives.outcome import Fault, Kind, Outcome, judge
from coverdrive.simulation.roads.initial import EGO

_REACTION = 0.4
"""[s] given to the driver behind (UN Regulation No. 79, 5.6.4.7)"""
_DECELERATION = 3.0
"""[m/s²] that the driver behind can be asked for (UN Regulation No. 79, 5.6.4.7)"""


def collision_at(moment: int, scenes: Sequence[Scene], dt: float, road: Road) -> Outcome | None:
    """The collision of the ego at a moment of successive scenes on a road, ``dt`` [s] apart; None if there is none."""
    collision = judge(scenes[moment - 1], scenes[moment], road)
    if collision is None:
        return None
    kind, partner = collision
    return Outcome(kind, moment * dt, partner, fault_of(kind, partner, scenes[:moment]))


def fault_of(kind: Kind, partner: int, before: Sequence[Scene]) -> Fault:
    """Who is at fault in a collision of the ego with ``partner``, of all vehicles at all moments before the contact."""
    if kind is Kind.FRONTAL:
        return Fault.OTHER if _cut_in(before, partner, EGO) else Fault.EGO
    if kind is Kind.REAR_END:
        return Fault.EGO if _cut_in(before, EGO, partner) else Fault.OTHER
    if _came_over(before[-1], EGO, partner):
        return Fault.EGO
    return Fault.OTHER if _came_over(before[-1], partner, EGO) else Fault.NONE


def _cut_in(before: Sequence[Scene], ahead: int, behind: int) -> bool:
    """Whether the one ahead came into the way of the one behind too near to it, which has come nearer ever since."""
    since = _in_way_since(before, ahead, behind)
    if since is None or not _came_over(before[since], ahead, behind):
        return False
    along = np.array([scene.speed * np.cos(scene.heading) for scene in before[since:]])
    closing = along[:, behind] - along[:, ahead]
    needed = closing[0] * _REACTION + closing[0] ** 2 / (2 * _DECELERATION)
    return bool((closing > 0).all() and _gaps(before[since], ahead, behind)[0] < needed)


def _in_way_since(before: Sequence[Scene], first: int, second: int) -> int | None:
    """The moment from which on two bodies overlap across the road; None if they do for as long as both are there."""
    for moment in reversed(range(len(before))):
        scene = before[moment]
        if not (scene.valid[first] and scene.valid[second]):
            return None
        if _gaps(scene, first, second)[1] >= 0:
            return moment + 1
    return None


def _gaps(scene: Scene, first: int, second: int) -> np.ndarray:
    """[m] gaps of two bodies along and across the road, negative where they overlap."""
    extents = turned_half_extents(scene.half_sizes, scene.states[:, 3])
    position = scene.states[:, :2]
    return axis_gap(position[first], position[second], extents[first], extents[second])


def _came_over(scene: Scene, one: int, other: int) -> bool:
    """Whether the one moves towards the other across the road, faster than the other towards it."""
    towards_other = np.sign(scene.lat[other] - scene.lat[one]) * scene.speed * np.sin(scene.heading)
    return bool(towards_other[one] > max(0.0, -towards_other[other]))
