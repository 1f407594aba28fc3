"""Which trials of a study are worth looking at: collisions, near misses, and the drive in which most happens."""

from collections.abc import Sequence

import numpy as np
import polars as pl
from jaxtyping import Bool

from coverdrive.distances import kept
from coverdrive.geometry import body_distance
from coverdrive.progress import done
from coverdrive.recordings.recording import Recording
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drives.outcome import Fault, Kind
from coverdrive.simulation.measures.trial import STARTED

NEAR_GAP = 1.0
"""[m] a smaller gap to another vehicle is a near miss"""
NEAR_TIME = 1.0
"""[s] a smaller time to collision is a near miss"""
_LOOK = 0.5
"""[s] after which recorded traffic is looked at again"""

COLLIDED = STARTED & (pl.col("kind") != Kind.FINISHED.value)
"""whether the ego touched anybody, as an expression on a table of trials"""
OWN_FAULT = COLLIDED & (pl.col("at_fault") == Fault.EGO.value)
"""the same at its own fault"""
NEARLY = ~COLLIDED & ((pl.col("minimum_gap") < NEAR_GAP) | (pl.col("minimum_time_to_collision") < NEAR_TIME))
"""whether it nearly did"""


def recorded_near_misses(recordings: Sequence[Recording]) -> dict[str, float]:
    """Of recorded vehicles the ``share`` that came as near to another, and for how many ``seconds`` each was seen.

    Half-seconds are looked at, with bodies in the map. A vehicle that several recordings show counts once, as in that
    which shows it longest.
    """
    shown = list[pl.DataFrame]()
    for number, each in enumerate(recordings, start=1):
        came = list[np.ndarray]()
        for scene, vehicle in each.frames().every(max(1, round(_LOOK / each.dt))):
            soon = kept(scene, each.road, np.arange(scene.vehicles)).time_to_collision < NEAR_TIME
            came.append(vehicle[soon | _close(scene, each.road)])
        near = pl.col("vehicle").is_in(pl.Series(np.concatenate(came))).any().alias("share")
        shown.append(each.table.group_by("identity", maintain_order=True).agg(near, seconds=pl.len() * each.dt))
        done(number, len(recordings))
    longest = pl.concat(shown).sort("seconds", descending=True, maintain_order=True)
    once = longest.unique("identity", keep="first", maintain_order=True)
    return once.select(pl.col("share", "seconds").mean()).row(0, named=True)


def _close(scene: Scene, road: Road) -> Bool[np.ndarray, "m A"]:
    """Which slots of a scene with leading axis m hold a body that is nearer to another one than that."""
    (centre, heading), half_sizes = road.bodies_to_map(scene.lon, scene.lat, scene.heading), scene.half_sizes
    reach, both = np.hypot(half_sizes[..., 0], half_sizes[..., 1]), scene.valid[..., None] & scene.valid[:, None]
    apart = np.hypot(*np.moveaxis(centre[:, None] - centre[:, :, None], -1, 0)) - reach[:, None] - reach[..., None]
    moment, *pair = np.nonzero(np.triu(both & (apart < NEAR_GAP), k=1))
    bodies = [(centre[moment, each], heading[moment, each], half_sizes[moment, each]) for each in pair]
    near = body_distance(*bodies[0], *bodies[1]) < NEAR_GAP
    close = np.zeros(scene.valid.shape, dtype=bool)
    for each in pair:
        close[moment[near], each[near]] = True
    return close


def liveliest(trials: pl.DataFrame) -> int:
    """Number of the trial of the longest drive with most lane changes and overtakes."""
    order = trials.sort("time", pl.col("lane_changes") + pl.col("overtakes"), "trial", descending=[True, True, False])
    return int(order["trial"][0])


def notable(trials: pl.DataFrame, most: int) -> list[int]:
    """Numbers of the trials worth a replay: the collisions, then the nearest misses, and last the liveliest drive.

    Without a collision or a near miss the drive with the least gap is the first one. The liveliest gives way only if
    there is room for no more than one.
    """
    nearest = trials.sort("minimum_gap", "trial")
    collisions, near_misses = trials.filter(COLLIDED)["trial"].to_list(), nearest.filter(NEARLY)["trial"].to_list()
    dangers = [*collisions, *near_misses] or [int(nearest["trial"][0])]
    return list(dict.fromkeys([*dangers[: max(most - 1, 1)], liveliest(trials), *dangers]))[:most]
