"""How an episode ends: without a contact of the ego, or with a frontal, side or rear-end collision (paper §5).

Decided from the last moment before the contact: the other vehicle ahead in the ego's way → frontal; behind in
its way → rear-end (the ego was hit from behind); else → side. Whose fault it is says
`coverdrive.simulation.drives.fault`.
"""

import enum
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from coverdrive.geometry import axis_gap, boxes_overlap, turned_extents
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.roads.initial import EGO

_STRAIGHT = Road.straight()
_ROUNDING = 1e-6
"""[m] of a distance"""


class Kind(enum.StrEnum):
    """How an episode ended for the ego."""

    FINISHED = "finished"
    """no contact"""
    FRONTAL = "frontal"
    """the ego ran into a vehicle ahead"""
    SIDE = "side"
    """contact from the side"""
    REAR_END = "rear-end"
    """a vehicle behind ran into the ego"""
    NOT_STARTED = "not started"
    """the vehicles found no place, so that nobody drove"""


class Fault(enum.StrEnum):
    """Whose driving led to the contact."""

    EGO = "ego"
    """the ego ran into the other, or had just cut in when the other did; from the side, it moved faster sideways"""
    OTHER = "other"
    """the reverse"""
    NONE = "none"
    """no contact, or a contact from the side that nobody moved towards"""


class Cause(enum.StrEnum):
    """What a collision has to do with the predictions (`coverdrive.simulation.measures.misses.cause_of`)."""

    NONE = "none"
    """no collision"""
    PREDICTION = "prediction miss"
    """the vehicle in contact had left its predicted set"""
    PLANNING = "planning failure"
    """it had not: the plan was to keep clear of what it did, and did not"""
    START = "hopeless start"
    """no plan was clear from the first on: the ego was put where it may be that nobody gets out"""


@dataclass(frozen=True)
class Outcome:
    """How an episode ended."""

    kind: Kind
    time: float
    """[s] of the end"""
    partner: int | None = None
    """slot of the vehicle in contact with the ego; the first one, if several are"""
    at_fault: Fault = Fault.NONE


def judge(before: Scene, after: Scene, road: Road = _STRAIGHT) -> tuple[Kind, int] | None:
    """The kind of the ego's collision between two successive moments, and with whom (the first slot, if several).

    The road is to be told where it bends.
    """
    along, across = turned_extents(after.length / 2, after.width / 2, after.heading)
    if road.line is not None:  # 1 m of lon is 0.5 m at the least
        along = across = np.hypot(after.length, after.width)
    near = np.abs(after.lon - after.lon[EGO]) < along + along[EGO] + _ROUNDING
    near &= np.abs(after.lat - after.lat[EGO]) < across + across[EGO] + _ROUNDING
    if np.count_nonzero(near) <= 1:  # most moments, on any road
        return None
    contact = contacts(after, road)[EGO]
    partner = int(contact.argmax())
    return (_kind(before, partner), partner) if contact.any() else None


def contacts(scene: Scene, road: Road = _STRAIGHT) -> Bool[np.ndarray, "*batch A A"]:
    """Whether the bodies of two different valid vehicles overlap, for every pair of slots; on the map of a road."""
    half_sizes = scene.half_sizes
    centre, heading = road.bodies_to_map(scene.lon, scene.lat, scene.heading)
    overlap = boxes_overlap(
        centre[..., :, None, :], heading[..., :, None], half_sizes[..., :, None, :],
        centre[..., None, :, :], heading[..., None, :], half_sizes[..., None, :, :],
    )  # fmt: skip
    different = ~np.eye(scene.vehicles, dtype=bool)
    return overlap & different & scene.valid[..., :, None] & scene.valid[..., None, :]


def _kind(before: Scene, partner: int) -> Kind:
    position, half_sizes = before.states[:, :2], before.half_sizes
    gap_lon, gap_lat = axis_gap(position[partner], position[EGO], half_sizes[partner], half_sizes[EGO])
    if gap_lon < 0 or gap_lat >= 0:
        return Kind.SIDE
    return Kind.FRONTAL if position[partner, 0] > position[EGO, 0] else Kind.REAR_END
