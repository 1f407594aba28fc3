"""Fits to some groups of recordings, which are tried on the others."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
from simulation_fakes import fakes

from coverdrive.dialling import groups
from coverdrive.errors import DataError
from coverdrive.league.beliefs import ConstantVelocity
from coverdrive.prediction.boxes.predictor import BoxPredictor
from coverdrive.prediction.cover.basis import BasisSettings
from coverdrive.prediction.fit import PredictionSettings
from coverdrive.recordings.recording import IDENTITY, SCHEMA, Recording
from coverdrive.road import Road
from coverdrive.simulation.measures.trial import SCHEMA as MEASURED
from coverdrive.simulation.measures.trial import unstarted


def recording_of(vehicle: int) -> Recording:
    """One vehicle at one moment, which no other recording shows."""
    usual = {"vehicle": vehicle, "group": 0, "time": 0.0, "speed": 20.0, "length": 4.8, "width": 1.9}
    row = {name: [usual.get(name, 0.0)] for name in SCHEMA} | {"identity": [vehicle]}
    table = pl.DataFrame(row, schema=SCHEMA | IDENTITY)
    return Recording("one", table, 0.1, Road.straight(), {})


def test_only_the_same_recordings_settings_and_seed_have_the_same_fit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = list[Path]()

    def save(file: Path) -> None:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
        made.append(file)

    kept = SimpleNamespace(save=save)
    monkeypatch.setattr(groups, "fit", lambda *_, **__: SimpleNamespace(predictor=kept, scored=kept))
    monkeypatch.setattr(groups, "Predictor", SimpleNamespace(load=lambda _: BoxPredictor.__new__(BoxPredictor)))
    monkeypatch.setattr(groups, "ScoredSides", SimpleNamespace(load=lambda *_: SimpleNamespace(calibration=None)))
    monkeypatch.setattr(groups, "scale_left", lambda *_: 1.0)
    scenes, settings = [recording_of(vehicle) for vehicle in range(4)], PredictionSettings()
    wider = [replace(each, road=Road.straight(width=4.0)) for each in scenes]
    asked = [(scenes[:3], settings, 0), (scenes[1:], settings, 0), (wider[:3], settings, 0), (scenes[:3], settings, 1)]
    asked += [(scenes[:3], settings.model_copy(update={"basis": BasisSettings(radius=1.0)}), 0)]
    for _ in range(2):
        for each in asked:
            groups._fitted(*each, tmp_path)  # pyright: ignore[reportPrivateUsage]
        assert len(made) == len(set(made)) == 2 * len(asked)


def test_where_no_replay_can_start_nothing_is_chosen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sets = ConstantVelocity(np.ones((3, 2)))
    monkeypatch.setattr(groups, "_fitted", lambda *_: (SimpleNamespace(scaled=lambda _: sets), [1.0] * 8))
    idle = pl.DataFrame([unstarted(0, 0, 1, "no room")], schema=MEASURED)
    monkeypatch.setattr(groups, "drive_missing", lambda *_: idle)
    with pytest.raises(DataError, match=r"no replay of any of the 2 groups .* could start"):
        scenes = [recording_of(vehicle) for vehicle in range(2)]
        groups.across_groups(scenes, PredictionSettings(), fakes(traffic="replay"), tmp_path)
