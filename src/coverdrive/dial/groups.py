"""Recorded scenes that share no vehicle: what is fitted to some of them is tried on the others.

Scenes that were cut from one recording show the same vehicles, so that replays of them depend on each other. Files say
who is who by numbers, which may begin anew in every file: two of them are taken to be of one recording if most of the
numbers that both have belong to vehicles of the same size.
"""

from collections.abc import Sequence

import numpy as np
import polars as pl
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from coverdrive.prediction.segments import Segments
from coverdrive.prediction.split import Split
from coverdrive.recordings.recording import Recording

_ALIKE = 0.01
"""[m] sizes of one vehicle differ by less"""

_MOST = 0.5
"""share of the numbers that two groups have in common, from which on their vehicles are the same"""

_TRAINING, _CALIBRATION = 0.65, 0.3
"""shares of the vehicles, where the scenes that are left to fit to are all of one recording"""


def independent(recordings: Sequence[Recording]) -> list[list[Recording]]:
    """The recordings in parts of which no vehicle is in two, the largest part first."""
    sizes = pl.concat(
        [
            each.table.group_by("vehicle")
            .agg(pl.col("length", "width").median(), pl.col("identity").first())
            .with_columns(recording=pl.lit(number, pl.Int64))
            .select("recording", "vehicle", "length", "width", "identity")
            for number, each in enumerate(recordings)
        ]
    )
    pairs = sizes.join(sizes, on="vehicle", suffix="_b").filter(pl.col("recording") < pl.col("recording_b"))
    alike = pl.all_horizontal((pl.col(name) - pl.col(f"{name}_b")).abs() < _ALIKE for name in ("length", "width"))
    numbered = pairs.group_by("recording", "recording_b").agg(alike.mean()).filter(pl.last() >= _MOST)
    known = sizes.join(sizes, on="identity", suffix="_b").select("recording", "recording_b")
    links = pl.concat([numbered.select("recording", "recording_b"), known]).to_numpy()
    graph = coo_array((np.ones(len(links)), links.T), shape=(len(recordings), len(recordings)))
    part = connected_components(graph, directed=False)[1]
    return [[recordings[i] for i in np.flatnonzero(part == each).tolist()] for each in np.argsort(-np.bincount(part))]


def sides_by_vehicle(recordings: Sequence[Recording], segments: Segments, seed: int) -> Split:
    """Sides of segments by vehicles alone, for scenes that are all of one recording."""
    number = np.concatenate(
        [each.table["vehicle"].to_numpy()[segments.row[segments.recording == i]] for i, each in enumerate(recordings)]
    )
    assert (np.diff(segments.recording) >= 0).all()
    vehicle = np.unique(number, return_inverse=True)[1]
    place = np.random.default_rng(seed).permutation(vehicle.max() + 1) / (vehicle.max() + 1)
    side = np.searchsorted([_TRAINING, _TRAINING + _CALIBRATION], place, side="right")[vehicle]
    return Split(*(np.flatnonzero(side == each) for each in range(3)), dropped=0)
