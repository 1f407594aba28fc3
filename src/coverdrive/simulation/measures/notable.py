"""Which trials of a study are worth looking at: collisions, near misses, and the drive in which most happens."""

import polars as pl

from coverdrive.simulation.drives.outcome import Fault, Kind
from coverdrive.simulation.measures.trial import STARTED

NEAR_GAP = 1.0
"""[m] a smaller gap to another vehicle is a near miss"""
NEAR_TIME = 1.0
"""[s] a smaller time to collision is a near miss"""

COLLIDED = STARTED & (pl.col("kind") != Kind.FINISHED.value)
"""whether the ego touched anybody, as an expression on a table of trials"""
OWN_FAULT = COLLIDED & (pl.col("at_fault") == Fault.EGO.value)
"""the same at its own fault"""
NEARLY = ~COLLIDED & ((pl.col("minimum_gap") < NEAR_GAP) | (pl.col("minimum_time_to_collision") < NEAR_TIME))
"""whether it nearly did"""


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
