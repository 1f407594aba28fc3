"""What an agent is shown of a scene: the affordance of the ego, or the vehicles around it in arrays with a mask."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from coverdrive.extras import require
from coverdrive.prediction.learning.affordance import FEATURES, MOTION
from coverdrive.prediction.stored import features_of
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.roads.initial import EGO

if TYPE_CHECKING:
    import gymnasium
else:
    gymnasium = require("gymnasium")

Shown = Literal["affordance", "scene"]
"""kinds of observations"""

_SPEED, _CLEARANCE, _SIZE, _FAR = 100.0, 50.0, 30.0, 300.0
"""[m/s], [m] that is shown at the most"""
_VEHICLE = np.array([_FAR, _FAR, _SPEED, np.pi, _SIZE, _SIZE], dtype=np.float32)


def observation_of(kind: Shown, slots: int) -> tuple["gymnasium.Space[Any]", Callable[[Scene, Road], Any]]:
    """The space of a kind of observations, and what makes one.

    Args:
        kind: ``affordance``: the 22 numbers of `coverdrive.prediction.learning.affordance.described_at`, of the ego.
            ``scene``: a dict of ``vehicles`` (slots, 6), of which the first is the ego and the others are the nearest
            by distance: lon and lat [m] from the ego, speed [m/s], heading [rad], length and width [m]; ``mask``
            (slots,), 1 where there is one; and ``road`` (4,): the ways [m] of the ego's centre to the right edge of the
            road, to the left one, and to the left to the centre of its lane, and the width of its lane [m].
        slots: how many vehicles the latter holds, the ego's included.
    """
    box = gymnasium.spaces.Box
    if kind == "affordance":
        names = (*FEATURES, *MOTION)
        high = np.array(
            [_CLEARANCE if "clearance" in name else _SIZE if "length" in name else _SPEED for name in names]
        )
        low = np.where(["length" in name for name in names], 0.0, -high)
        space = box(low.astype(np.float32), high.astype(np.float32))
        return space, partial(_affordance, low=space.low, high=space.high)
    spaces: dict[str, gymnasium.Space[Any]] = {
        "vehicles": box(np.tile(-_VEHICLE, (slots, 1)), np.tile(_VEHICLE, (slots, 1))),
        "mask": gymnasium.spaces.MultiBinary(slots),
        "road": box(-_FAR, _FAR, (4,)),
    }
    return gymnasium.spaces.Dict(spaces), partial(_around, slots=slots)


def _affordance(scene: Scene, road: Road, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The features of the ego, within their bounds."""
    return np.clip(features_of(scene, road, np.array([EGO]))[0], low, high)


def _around(scene: Scene, road: Road, slots: int) -> dict[str, np.ndarray]:
    """The vehicles nearest to the ego, and where it is on the road."""
    states = scene.states
    apart = states[:, :2] - states[EGO, :2]
    order = np.argsort(np.where(scene.valid, np.hypot(*apart.T), np.inf), kind="stable")[:slots]
    order = np.concatenate([[EGO], order[order != EGO]])[:slots]
    shown, mask = np.zeros((slots, 6), dtype=np.float32), np.zeros(slots, dtype=np.int8)
    mask[: len(order)] = np.asarray(scene.valid)[order]
    seen = np.concatenate([apart, states[:, 2:], 2 * scene.half_sizes], axis=1)[order]
    shown[: len(order)] = np.clip(seen, -_VEHICLE, _VEHICLE) * mask[: len(order), None]
    lon, lat = states[EGO, :2]
    lane, edges = int(road.lane_at(lon, lat)), road.edges_at(lon)
    width = edges[lane + 1] - edges[lane]
    ways = [lat - edges[0], edges[-1] - lat, edges[lane] + width / 2 - lat, width]
    return {"vehicles": shown, "mask": mask, "road": np.clip(ways, -_FAR, _FAR).astype(np.float32)}
