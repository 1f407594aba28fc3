"""highD and AD4CHE, as an independent writer publishes generated traffic: `published_formats`."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest
from published_formats import EDGES, found_again, truth, write_highd

from coverdrive.errors import RecordingError
from coverdrive.recordings.files.kinds import KINDS
from coverdrive.recordings.formats.parquet import write_parquet
from coverdrive.recordings.read import read

REAL = truth(0.04, seconds=5.0)


def test_both_carriageways_are_found_again(tmp_path: Path):
    write_highd(tmp_path, REAL)
    upper, lower = read([tmp_path])
    assert (upper.name, lower.name) == ("01 upper", "01 lower")
    for recording, real in zip((lower, upper), REAL.tables, strict=True):
        assert recording.road.edges == pytest.approx(EDGES)
        assert recording.repairs == {}
        assert recording.dt == 0.1
        assert recording.notes["lanes"] == "markings"
        assert recording.notes["resampled"].startswith("25 Hz to 10 Hz after the Savitzky–Golay fit")
        worst = found_again(recording, real, shift=0.04)
        assert worst["lon"] < 0.1 and worst["lat"] < 0.02 and worst["speed"] < 0.4 and worst["heading"] < 0.01
        sizes = recording.table.select("length", "width").min().row(0)
        assert sizes == pytest.approx(real.select("length", "width").min().row(0), abs=0.01)


def test_classes_are_kept(tmp_path: Path):
    write_highd(tmp_path, REAL)
    for recording in read([tmp_path]):
        trucks = recording.table.filter(pl.col("length") > 8)["kind"].unique().to_list()
        cars = recording.table.filter(pl.col("length") < 8)["kind"].unique().to_list()
        assert trucks in ([KINDS.index("truck")], []) and cars == [KINDS.index("car")]


def test_own_files_keep_what_was_read(tmp_path: Path):
    write_highd(tmp_path, REAL)
    before = read([tmp_path])
    write_parquet(before, tmp_path / "own.parquet")
    for one, other in zip(before, read([tmp_path / "own.parquet"]), strict=True):
        assert one.table.equals(other.table) and one.notes == other.notes and one.repairs == other.repairs
        assert other.road.to_map(100.0, 2.0) == pytest.approx(one.road.to_map(100.0, 2.0))


@pytest.mark.parametrize("suffix", [".parquet", ".json", ".xml", ".txt", ".dat"])
def test_files_that_are_named_as_another_format(suffix: str, tmp_path: Path):
    tracks = write_highd(tmp_path, REAL).rename(tmp_path / f"01_tracks{suffix}")
    with pytest.raises(RecordingError, match=r"01_tracks\.\w+"):
        read([tracks])


def test_carriageways_of_a_minute_are_of_one_group(tmp_path: Path):
    write_highd(tmp_path, REAL)
    assert [recording.table["group"].unique().to_list() for recording in read([tmp_path])] == [[0], [0]]


def test_without_markings_lanes_are_estimated(tmp_path: Path):
    """AD4CHE: more columns, no markings."""
    write_highd(tmp_path, REAL, orientation=pl.lit(0.0))
    (tmp_path / "01_recordingMeta.csv").write_text("id,frameRate,locationId\n1,25,2\n")
    for recording in read([tmp_path]):
        assert recording.notes["lanes"] == "estimated (tracks)"
        assert np.diff(recording.road.edges) == pytest.approx(3.6, abs=0.15)
        assert recording.road.lanes == 3


def test_swapped_sizes_are_noticed(tmp_path: Path):
    write_highd(tmp_path, REAL, width=pl.col("height"), height=pl.col("width"))
    with pytest.raises(RecordingError, match=r"01_tracks\.csv, column width: most boxes are higher than wide.*swapped"):
        read([tmp_path])


def test_missing_descriptions_are_named(tmp_path: Path):
    tracks = write_highd(tmp_path, REAL)
    (tmp_path / "01_recordingMeta.csv").unlink()
    with pytest.raises(RecordingError, match=r"01_recordingMeta\.csv is not beside it; expected NN_tracks\.csv"):
        read([tracks])
    with pytest.raises(RecordingError, match=r"01_tracksMeta\.csv: it is no recording, but belongs.*highD"):
        read([tmp_path / "01_tracksMeta.csv"])
    tracks.rename(tmp_path / "mine.csv")
    with pytest.raises(RecordingError, match=r"NN_tracksMeta\.csv is not beside it"):
        read([tmp_path / "mine.csv"])


def test_descriptions_of_another_recording_are_noticed(tmp_path: Path):
    tracks = write_highd(tmp_path, REAL)
    listed = pl.read_csv(tmp_path / "01_tracksMeta.csv")
    listed.filter(pl.col("id") > 3).write_csv(tmp_path / "01_tracksMeta.csv")
    with pytest.raises(RecordingError, match=r"row 2, column id: vehicle 1 is not in 01_tracksMeta"):
        read([tracks])
    listed.write_csv(tmp_path / "01_tracksMeta.csv")
    about = (tmp_path / "01_recordingMeta.csv").read_text()
    (tmp_path / "01_recordingMeta.csv").write_text(about.replace("4.00;", "four;"))
    with pytest.raises(RecordingError, match=r"column upperlanemarkings: expected y of two or more markings"):
        read([tracks])
    (tmp_path / "01_recordingMeta.csv").write_text(about.replace(",25,", ",0,"))
    with pytest.raises(RecordingError, match=r"expected frames per second, got 0"):
        read([tracks])
    (tmp_path / "01_recordingMeta.csv").write_text(about.replace(",25,", ",12,"))
    with pytest.raises(RecordingError, match=r"ratio of the speeds of the positions.*0\.48"):
        read([tracks])


def test_a_turned_axis_is_noticed(tmp_path: Path):
    tracks = write_highd(tmp_path, REAL, xVelocity=-pl.col("xVelocity"))
    with pytest.raises(RecordingError, match="positions along x run against the velocities"):
        read([tracks])


def test_markings_of_the_other_carriageway_are_noticed(tmp_path: Path):
    tracks = write_highd(tmp_path, REAL)
    listed = pl.read_csv(tmp_path / "01_tracksMeta.csv")
    listed.with_columns(drivingDirection=3 - pl.col("drivingDirection")).write_csv(tmp_path / "01_tracksMeta.csv")
    with pytest.raises(RecordingError, match=r"only 0 of .* rows are on the 3 lanes"):
        read([tracks])
