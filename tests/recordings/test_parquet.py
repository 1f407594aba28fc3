"""Own Parquet files: what is written is read back exactly."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from coverdrive.errors import DataError, RecordingError
from coverdrive.recordings.parquet import write_parquet
from coverdrive.recordings.read import read
from coverdrive.recordings.recording import Recording
from coverdrive.simulation.generated import GeneratedSettings, generate

SMALL = GeneratedSettings(scenes=2, duration=3.0)


def assert_equal(left: Recording, right: Recording) -> None:
    assert left.table.equals(right.table)
    assert (left.name, left.dt, left.repairs, left.road.length) == (
        right.name,
        right.dt,
        right.repairs,
        right.road.length,
    )
    assert np.array_equal(left.road.edges, right.road.edges)


def test_recordings_are_read_back_exactly(tmp_path: Path):
    path = tmp_path / "new" / "own.parquet"
    first, second = generate(SMALL)
    second = replace(second, name="zweite Fahrt, 100 %", dt=0.1, repairs={"split tracks": 3})
    write_parquet([first, second], path)
    for recording, expected in zip(read([path]), (first, second), strict=True):
        assert_equal(recording, expected)
    assert list(path.parent.iterdir()) == [path]


def test_files_are_replaced_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "own.parquet"
    first, second = generate(SMALL)
    write_parquet([first], path)
    monkeypatch.setattr(Path, "replace", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        write_parquet([second], path)
    monkeypatch.undo()
    assert_equal(read([path])[0], first)
    assert list(tmp_path.iterdir()) == [path]


def test_nothing_is_not_written(tmp_path: Path):
    with pytest.raises(DataError, match="no recording to write"):
        write_parquet([], tmp_path / "own.parquet")


def test_damaged_files_are_refused(tmp_path: Path):
    recording = generate(SMALL)[0]
    path = tmp_path / "own.parquet"
    recording.table.drop("width").write_parquet(path, metadata={"coverdrive": '[{"name": "a"}]'})
    with pytest.raises(RecordingError, match="damaged or of another version"):
        read([path])
