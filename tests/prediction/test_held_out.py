from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from coverdrive.errors import DataError
from coverdrive.prediction.fit import Fit
from coverdrive.prediction.held_out import held_out
from coverdrive.recordings.recording import Recording
from coverdrive.simulation.generated import GeneratedSettings, generate


def test_only_the_groups_of_the_test_split_are_left(fitted: Fit, scenes: tuple[Recording, ...]) -> None:
    kept = held_out(fitted.source, fitted.predictor, scenes)
    groups = {int(group) for recording in kept for group in recording.table["group"].unique()}
    assert groups == set(fitted.segments.group[fitted.split.test].tolist())
    made_from = np.concatenate([fitted.split.train, fitted.split.calibration])
    assert not groups & set(fitted.segments.group[made_from].tolist())


def test_each_recording_is_known_by_itself(fitted: Fit, scenes: tuple[Recording, ...]) -> None:
    whole = {recording.name for recording in held_out(fitted.source, fitted.predictor, scenes)}
    for recording in scenes:
        kept = held_out(fitted.source, fitted.predictor, [recording])
        assert [each.name for each in kept] == ([recording.name] if recording.name in whole else [])


def test_what_the_predictor_was_made_from_must_be_as_it_was(fitted: Fit, scenes: tuple[Recording, ...]) -> None:
    trained = scenes[int(fitted.segments.recording[fitted.split.train[0]])]
    moved = replace(trained, table=trained.table.with_columns(pl.col("speed") + 0.1))
    with pytest.raises(DataError, match="no scene of it is known to be new"):
        held_out(fitted.source, fitted.predictor, [moved])
    with pytest.raises(DataError, match="no scene of it is known to be new"):
        held_out((), fitted.predictor, [trained])  # its vehicles give it away


def test_recordings_that_it_never_saw_are_kept_whole(fitted: Fit) -> None:
    new = generate(GeneratedSettings(scenes=3, duration=5.0, vehicles=(4, 5)), seed=9)
    assert held_out(fitted.source, fitted.predictor, new) == new
