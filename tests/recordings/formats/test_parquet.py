"""Own Parquet files: what is written is read back exactly."""

from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
import polars as pl
import pytest

from coverdrive.errors import DataError, RecordingError
from coverdrive.recordings.formats.parquet import write_parquet
from coverdrive.recordings.read import read
from coverdrive.recordings.recording import Recording
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import LaneEdges
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate

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


def test_roads_that_bend_are_read_back_exactly(tmp_path: Path):
    recording = generate(SMALL)[0]
    edges = np.asarray(recording.road.edges, dtype=float)
    line = ReferenceLine(np.array([1.1, -2.2]), 0.3, np.linspace(0, 1 / 300, 1001), 1000.0, lat=4.4)
    changing = LaneEdges(np.array([0.0, 333.3, 500.0]), np.stack([edges, edges + [0.1, 0, 0, 0][: len(edges)], edges]))
    road = replace(recording.road, line=line, changing=changing, speed_limit=100 / 3.6, side="left")
    curved = replace(recording, table=recording.table.filter(pl.col("lon") < 990), road=road)
    write_parquet([curved], tmp_path / "own.parquet")
    found = read([tmp_path / "own.parquet"])[0]
    assert_equal(found, curved)
    assert (found.road.speed_limit, found.road.side) == (100 / 3.6, "left")
    assert all(map(np.array_equal, jax.tree.leaves(found.road), jax.tree.leaves(road)))


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
