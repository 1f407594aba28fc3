"""The affordance: 21 features that describe the traffic around a vehicle (paper §2.2, Fig. 2).

They do not depend on the order of the vehicles, nor on their number. The right side is the left side of the mirrored
scene. Clearances along the road are from bumper to bumper, clearances across it from side to side; a vehicle alongside
has a negative clearance along the road. Speeds of others are relative to the own speed.

Lanes are those at each vehicle's own position: the lane beside it is the next one that is there. E edges, L lanes. All
is computed with numbers of 32 bits, as networks are trained on them.
"""

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from coverdrive.compiled import compiled
from coverdrive.road import AWAY, LEAST_WIDTH
from coverdrive.scene import Scene

Edges = Float[np.ndarray, "... E"]
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
"""Names of what `described_at` adds to the features, in m/s, positive to the left."""

CLEARANCE_LIMIT = 50.0
"""[m] clearances are clipped to ± this value, which also stands for "no vehicle" (authors' scripts)"""
FREE_LATERAL_CLEARANCE = 3.6
"""[m] lateral clearance where there is no vehicle: one lane width (authors' scripts)"""

_MIRRORED = [0, 1, 2, 3, *range(10, 16), *range(4, 10), 18, 19, 16, 17, 20, 21]
"""columns that the mirror image has of the features and the motion: left and right are exchanged"""
_TO_THE_LEFT = [FEATURES.index("distance to lane centre"), len(FEATURES)]
"""columns that are negative in it: distances and speeds that count to the left"""
_LON, _LAT, _SPEED, _LENGTH, _WIDTH = range(5)
"""rows of what vehicles are like"""
_GAP, _LATERAL, _FASTER, _LONG = range(4)
"""columns of what is found of neighbours: clearances along and across the road, relative speed, length"""


def affordance(scene: Scene, edges: Edges) -> Float32[np.ndarray, "*batch A 21"]:
    """Features of every vehicle of every scene, in the order of `FEATURES`.

    ``edges`` are the lane edges [m] at every vehicle (`Road.edges_at`), or the same for all. The features of slots
    without a vehicle are finite and meaningless; vehicles off the road are taken to be in the nearest lane.
    """
    shape = np.shape(scene.lon)
    slots = shape[-1]
    edges = np.broadcast_to(edges, (*shape, np.shape(edges)[-1])).reshape(-1, slots, np.shape(edges)[-1])
    flat = Scene(*(np.reshape(values, (-1, slots)) for values in vars(scene).values()))
    moment, slot = np.divmod(np.arange(flat.lon.size), slots)
    return described_at(flat, edges, moment, slot).reshape(*shape, -1)[..., : len(FEATURES)]


def described_at(
    scene: Scene, edges: Float[np.ndarray, "B A E"], moment: Int[np.ndarray, " N"], slot: Int[np.ndarray, " N"]
) -> Float32[np.ndarray, "N F"]:
    """The `affordance` of some slots alone, each followed by `MOTION`; a network sees of it what its inputs say.

    In the scenes of a batch, they are ``slot`` at ``moment`` in 0 … B − 1.
    """
    cars = np.empty((len(scene.lon), 5, scene.vehicles), dtype=np.float32)
    for row, values in enumerate((scene.lon, scene.lat, scene.speed, scene.length, scene.width)):
        cars[:, row] = values
    result = np.empty((len(moment), len(FEATURES) + len(MOTION)), dtype=np.float32)
    order = np.arange(len(moment)) if len(scene.lon) == 1 else np.argsort(moment, kind="stable")  # lanes: once a moment
    edges = np.array(edges, dtype=np.float32, order="C")
    moments, slots = np.ascontiguousarray(moment), np.ascontiguousarray(slot)  # one kind of arrays is compiled
    _describe(cars, np.array(scene.valid), edges, moments, slots, order, result)
    heading = np.asarray(scene.heading)[moment, slot]
    result[:, -1] = cars[moment, _SPEED, slot] * np.sin(heading, dtype=np.float32)
    return result


def mirrored_features(features: Float32[np.ndarray, "N F"]) -> Float32[np.ndarray, "N F"]:
    """What `described_at` says of the mirror images, left for right."""
    result = features[:, _MIRRORED]
    result[:, _TO_THE_LEFT] *= -1
    return result


@compiled
def _describe(
    cars: Float32[np.ndarray, "B 5 A"],
    valid: Bool[np.ndarray, "B A"],
    edges: Float32[np.ndarray, "B A E"],
    moment: Int[np.ndarray, " N"],
    slot: Int[np.ndarray, " N"],
    order: Int[np.ndarray, " N"],
    result: Float32[np.ndarray, "N F"],
) -> None:
    """Write the features of every row, in an order in which those of a moment follow one another."""
    slots, looked_at = cars.shape[2], -1
    lane, beside = np.empty((2, slots), np.int64), np.empty((2, slots), np.int64)
    found = np.empty((5, 4), np.float32)
    for row in order:
        own = int(slot[row])
        if moment[row] != looked_at:
            looked_at = moment[row]
            for each in range(slots):
                for side in range(2):
                    lanes = _lanes(edges[looked_at, each], cars[looked_at, _LAT, each], side)
                    lane[side, each], beside[side, each] = lanes
        _find(cars[looked_at], valid[looked_at], lane, beside, own, found)
        _write(cars[looked_at], edges[looked_at, own], lane[0, own], beside[:, own], own, found, result[row])


@compiled
def _lanes(edges: Float32[np.ndarray, " E"], lat: float, side: int) -> tuple[int, int]:
    """The lane of a position, and the next one to the left that is there, or −1; for side 1, in the mirror."""
    lanes = len(edges) - 1
    lane, beside, least = 0, -1, np.inf
    for number in range(lanes):
        right = -edges[lanes - number] if side else edges[number]
        left = -edges[lanes - number - 1] if side else edges[number + 1]
        there, at = left - right > LEAST_WIDTH, -lat if side else lat
        outside = max(right - at, 0.0) + max(at - left, 0.0) + (0.0 if there else AWAY)
        if outside <= least:
            lane, beside, least = number, -1, outside
        elif there and beside < 0:
            beside = number
    return lane, beside


@compiled
def _find(
    cars: Float32[np.ndarray, "5 A"],
    valid: Bool[np.ndarray, " A"],
    lane: Int[np.ndarray, "2 A"],
    beside: Int[np.ndarray, "2 A"],
    own: int,
    found: Float32[np.ndarray, "5 4"],
) -> None:
    """The nearest vehicle ahead in the own lane, and ahead and behind in those on the left and on the right."""
    for place in range(5):
        found[place, _GAP] = np.inf
    for other in range(len(valid)):
        if other == own or not valid[other]:
            continue
        behind = int(cars[_LON, other] < cars[_LON, own])  # exactly alongside counts as ahead
        if lane[0, other] == lane[0, own] and not behind:
            _meet(cars, own, other, found[0])
        for side in range(2):
            if lane[side, other] == beside[side, own]:
                _meet(cars, own, other, found[1 + 2 * side + behind])


@compiled
def _meet(cars: Float32[np.ndarray, "5 A"], own: int, other: int, found: Float32[np.ndarray, " 4"]) -> None:
    """Keep another vehicle instead of the one that was found if it is nearer along the road.

    Where several are equally near, each feature is the smallest of theirs, so that their order plays no role.
    """
    gap = np.float32(abs(cars[_LON, other] - cars[_LON, own]) - (cars[_LENGTH, other] + cars[_LENGTH, own]) / 2)
    if gap > found[_GAP]:
        return
    if gap < found[_GAP]:
        found[_GAP], found[_LATERAL], found[_FASTER], found[_LONG] = gap, np.inf, np.inf, np.inf
    lateral = abs(cars[_LAT, other] - cars[_LAT, own]) - (cars[_WIDTH, other] + cars[_WIDTH, own]) / 2
    found[_LATERAL] = min(found[_LATERAL], lateral)
    found[_FASTER] = min(found[_FASTER], cars[_SPEED, other] - cars[_SPEED, own])
    found[_LONG] = min(found[_LONG], cars[_LENGTH, other])


@compiled
def _write(
    cars: Float32[np.ndarray, "5 A"],
    edges: Float32[np.ndarray, " E"],
    lane: int,
    beside: Int[np.ndarray, " 2"],
    own: int,
    found: Float32[np.ndarray, "5 4"],
    result: Float32[np.ndarray, " F"],
) -> None:
    """Put what was found into the order of the features, and what stands for it where there is nobody or no lane."""
    lat, half_width = cars[_LAT, own], cars[_WIDTH, own] / 2
    for place in range(5):
        near = found[place]
        if near[_GAP] == np.inf:
            near[_GAP], near[_LATERAL], near[_FASTER], near[_LONG] = np.inf, FREE_LATERAL_CLEARANCE, 0.0, 0.0
        side = (place - 1) // 2
        if place > 0 and beside[side] < 0:
            near[_GAP], near[_LATERAL] = 0.0, (lat - edges[0] if side else edges[-1] - lat) - half_width
        for clearance in (_GAP, _LATERAL):
            near[clearance] = min(max(near[clearance], -CLEARANCE_LIMIT), CLEARANCE_LIMIT)
    result[0], result[1] = cars[_SPEED, own], lat - np.float32((edges[lane] + edges[lane + 1]) / 2)
    result[2], result[3] = found[0, _GAP], found[0, _FASTER]
    for side in range(2):
        front, rear, at = found[1 + 2 * side], found[2 + 2 * side], 4 + 6 * side
        result[at], result[at + 1], result[at + 2] = front[_GAP], front[_FASTER], front[_LATERAL]
        result[at + 3], result[at + 4], result[at + 5] = rear[_GAP], rear[_LATERAL], rear[_FASTER]
        result[16 + 2 * side], result[17 + 2 * side] = front[_LONG], rear[_LONG]
    result[20] = cars[_LENGTH, own]
