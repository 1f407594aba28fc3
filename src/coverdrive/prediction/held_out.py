"""Scenes that neither trained nor calibrated a predictor: what it may be tried on without flattering it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import polars as pl

from coverdrive.errors import DataError
from coverdrive.prediction.fit import PredictionSettings, cut_and_split
from coverdrive.prediction.foresight import refuse_foresight
from coverdrive.prediction.predictor import Predictor
from coverdrive.recordings.recording import Recording


def held_out(
    predictor: Predictor,
    recordings: Sequence[Recording],
    settings: PredictionSettings | None = None,
    seed: int = 0,
) -> tuple[Recording, ...]:
    """The recordings without all groups of scenes that the predictor was made from.

    Recordings that share no vehicle with those that trained the predictor are held out as a whole; those that do must
    be the ones that it was made from, and their test groups are.

    Args:
        predictor: knows the vehicles that trained it.
        recordings: to choose from.
        settings: that the predictor was made with.
        seed: that the predictor was made with.

    Raises:
        SettingError: the predictor sees a motion that was estimated from the future.
        DataError: the recordings are other ones than the predictor was made from, yet share vehicles with them.
    """
    refuse_foresight(recordings, predictor.network.inputs)
    segments, sides = cut_and_split(recordings, settings or PredictionSettings(), seed)
    if not np.isin(segments.vehicle, predictor.trained_on).any():
        return tuple(recordings)
    trained_on = np.unique(segments.vehicle[sides.train])
    if not np.array_equal(trained_on, predictor.trained_on):
        raise DataError(
            "some of these recordings trained the predictor, so that no scene of them is known to be new to it; give "
            "exactly those that it was made from, with the same settings and seed, or entirely new ones"
        )
    used = np.unique(segments.group[np.concatenate([sides.train, sides.calibration])])
    kept = np.setdiff1d(np.unique(segments.group[sides.test]), used).tolist()
    tables = ((recording, recording.table.filter(pl.col("group").is_in(kept))) for recording in recordings)
    return tuple(replace(recording, table=table) for recording, table in tables if len(table))
