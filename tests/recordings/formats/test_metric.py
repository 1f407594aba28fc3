"""Metric NGSIM tracks."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from coverdrive.errors import RecordingError
from coverdrive.recordings.formats.ngsim import read_metric


def metric_table(speed: float = 12.0) -> pl.DataFrame:
    vehicle, frame = np.repeat([3, 7], 50), np.tile(np.arange(50), 2)
    return pl.DataFrame(
        {
            "Vehicle_ID": vehicle.astype(np.int32),
            "Frame_ID": (100 + frame).astype(np.int32),
            "Global_Time": 1_118_846_989_300 + 100 * frame,
            "local_x_m": np.where(vehicle == 3, 1.8, 5.4).astype(np.float32),
            "local_y_m": (20.0 + speed * frame / 10).astype(np.float32),
            "v_vel_mps": np.full(100, speed, dtype=np.float32),
        }
    )


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "tracks.parquet"


def test_front_bumpers_become_centres_of_usual_cars(path: Path):
    metric_table().write_parquet(path)
    (reading,) = read_metric(path)
    recording = reading.recording
    assert recording.repairs == {"assumed sizes": 2}
    assert recording.road.edges == pytest.approx([0, 3.6576, 7.3152])
    first = recording.table.filter(pl.col("vehicle") == 3)
    assert first["lon"].to_numpy() == pytest.approx(20 - 2.25 + 1.2 * np.arange(2, 50), abs=1e-3)
    assert first["lat"].to_numpy() == pytest.approx(7.3152 - 1.8, abs=1e-5)
    assert first["speed"].to_numpy() == pytest.approx(12.0, abs=1e-3)
    assert set(first["length"]) == {4.5}
    assert set(first["width"]) == {1.8}


def test_feet_are_refused(path: Path):
    metric_table(speed=25 / 0.3048).write_parquet(path)
    with pytest.raises(RecordingError, match=r"faster than 82 m/s.*in metres"):
        read_metric(path)


def test_missing_columns_and_broken_cells_are_named(path: Path):
    metric_table().drop("Global_Time").write_parquet(path)
    with pytest.raises(RecordingError, match="no column Global_Time"):
        read_metric(path)
    broken = metric_table()
    broken[17, "local_x_m"] = None
    broken.write_parquet(path)
    with pytest.raises(RecordingError, match="row 18, column local_x_m: expected a number, got None"):
        read_metric(path)
    metric_table()[:0].write_parquet(path)
    with pytest.raises(RecordingError, match="no rows of data"):
        read_metric(path)


@pytest.mark.real_data
def test_recorded_tracks(us101: Path):
    path = us101 / "tracks" / "us101_300_vehicles.parquet"
    readings = read_metric(path)
    tables = [reading.recording.table for reading in readings]
    assert len(readings) == 3  # the frame counter was started three times
    assert sum(map(len, tables)) == 172_888 - 2 * 300
    assert sum(table["vehicle"].n_unique() for table in tables) == 300
    assert sum(len(table.filter(pl.col("speed") > 30)) for table in tables) == 0
    stated = np.concatenate([reading.raw.speed for reading in readings])
    found = np.concatenate([table["speed"].to_numpy() for table in tables])
    assert found.mean() == pytest.approx(stated.mean(), rel=0.02)
