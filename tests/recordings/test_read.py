"""Reading any kind of file, folders, and the numbering of groups."""

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from recordings_fakes import driving, scenario, straight, three_lanes

from coverdrive.errors import RecordingError
from coverdrive.progress import heard_by, stage
from coverdrive.recordings import read as reading
from coverdrive.recordings.formats.parquet import write_parquet
from coverdrive.recordings.read import read, together
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.road import Road
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate


def test_folders_are_read_in_natural_order(make_ngsim, tmp_path: Path):
    for number in (10, 2, 1):
        make_ngsim(vehicles=3, seconds=2).write_csv(tmp_path / f"part {number}.csv")
    (tmp_path / "notes.md").write_text("not a recording")
    (tmp_path / "folder.csv").mkdir()
    assert [recording.name for recording in read([tmp_path])] == ["part 1", "part 2", "part 10"]


def test_files_of_a_folder_without_vehicles_are_skipped_and_named(tmp_path: Path):
    bicycle = driving(100, 20.0, -1.75, 5.0, 40).replace("<type>car<", "<type>bicycle<")
    for number, vehicles in enumerate(("", bicycle, driving(100, 20.0, -1.75, 5.0, 1), "")):
        (tmp_path / f"{number}.xml").write_text(scenario(three_lanes(), vehicles))
    with pytest.raises(RecordingError, match=r"0\.xml: the scenario has no recorded vehicles"):
        read([tmp_path])
    for name in "ab":
        (tmp_path / f"{name}.xml").write_text(straight().replace("20.0", f"{19 + ord(name) % 2}.0"))
    recordings = read([tmp_path])
    assert [recording.name for recording in recordings] == ["a", "b"]
    assert recordings[0].notes["skipped"] == "0.xml, 1.xml, 2.xml and 1 more, without vehicles"
    assert "skipped" not in recordings[1].notes
    with pytest.raises(RecordingError, match=r"1\.xml: the scenario has no recorded vehicles"):
        read([tmp_path, tmp_path / "1.xml"])


def test_each_file_is_resampled_before_the_next_is_read(make_ngsim, write_csv, monkeypatch: pytest.MonkeyPatch) -> None:
    """At the rate of the files, all of a large set together may be more than the memory holds."""
    rows, real = list[int](), reading.resampled

    def resampled(recording: Recording, *how: Any) -> Recording:
        later.write_text("no recording")  # is noticed if it was read before
        rows.append(len(recording.table))
        return real(recording, *how)

    first, later = write_csv(make_ngsim(speed=10.0), "1.csv"), write_csv(make_ngsim(speed=20.0), "2.csv")
    monkeypatch.setattr(reading, "resampled", resampled)
    with pytest.raises(RecordingError, match=r"2\.csv"):
        read([first, later], dt=0.2)
    assert len(rows) == 1


def test_short_recordings_are_a_group_each(make_ngsim, write_csv):
    slow, fast = make_ngsim(speed=10.0), make_ngsim(speed=20.0)
    recordings = read([write_csv(slow, "slow.csv"), write_csv(fast, "fast.csv")])
    assert [recording.table["group"].unique().to_list() for recording in recordings] == [[0], [1]]


def test_long_recordings_are_cut_in_minutes(make_ngsim, write_csv):
    long = make_ngsim(vehicles=3, seconds=130.0)
    before, recording = read([write_csv(make_ngsim(), "before.csv"), write_csv(long, "long.csv")])
    assert before.table["group"].unique().to_list() == [0]
    expected = 1 + np.floor(recording.table["time"].to_numpy() / 60 + 1e-9)
    assert np.array_equal(recording.table["group"].to_numpy(), expected)


def test_the_same_file_twice_is_one_group(make_ngsim, write_csv):
    wavy = make_ngsim().with_columns(v_Vel=49.2 + 3 * (pl.col("Frame_ID") / 7 + pl.col("Vehicle_ID")).sin())
    recordings = read([write_csv(wavy, "one.csv"), write_csv(wavy, "two.csv")])
    assert [recording.table["group"].unique().to_list() for recording in recordings] == [[0], [0]]


def test_ids_that_repeat_in_files_of_one_name_are_different_vehicles(make_ngsim, write_csv):
    """As in INTERACTION, where every site has its vehicle_tracks_000.csv."""
    first = write_csv(make_ngsim(speed=10.0), "one/tracks.csv")
    other = write_csv(make_ngsim(speed=20.0), "other/tracks.csv")
    one, two = read([first, other])
    assert one.name == two.name == "tracks"
    assert set(one.table["identity"]).isdisjoint(two.table["identity"])
    assert read([first])[0].table.equals(one.table)
    again = read([first, other, first])
    assert set(again[2].table["identity"]) == set(one.table["identity"])


def test_own_files_keep_their_groups(tmp_path: Path):
    recordings = generate(GeneratedSettings(scenes=3, duration=3.0))
    write_parquet(recordings, tmp_path / "own.parquet")
    again = read([tmp_path / "own.parquet"])
    assert all(left.table.equals(right.table) for left, right in zip(recordings, again, strict=True))


def test_groups_of_several_own_files_are_told_apart(tmp_path: Path):
    write_parquet(generate(GeneratedSettings(scenes=2, duration=3.0), seed=1), tmp_path / "1.parquet")
    write_parquet(generate(GeneratedSettings(scenes=2, duration=3.0), seed=2), tmp_path / "2.parquet")
    recordings = read([tmp_path])
    assert [recording.table["group"].unique().to_list() for recording in recordings] == [[0], [1], [2], [3]]


def test_progress_rises_to_one(make_ngsim, write_csv):
    seen: dict[str, list[float]] = {"reading": [], "shared vehicles": []}
    with heard_by(lambda stage, share: seen[stage].append(share)), stage("reading"):
        read([write_csv(make_ngsim(), "one.csv"), write_csv(make_ngsim(), "two.csv")])
    for shares in seen.values():
        assert shares == sorted(shares)
        assert shares[-1] == 1.0
        assert 0.5 in shares


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("missing.csv", "no such file or folder"),
        ("empty", "the folder holds no recording"),
        ("a.md", "unknown kind of file '.md'"),
        ("protobuf", r"protobuf: the folder holds no recording.*protobuf \(.pb\) are not read; write them as XML"),
        ("protobuf/a.pb", r"a.pb: CommonRoad scenarios in protobuf \(.pb\) are not read; write them as XML"),
    ],
)
def test_paths_to_nothing_are_refused(tmp_path: Path, name: str, problem: str):
    for folder in ("empty", "protobuf"):
        (tmp_path / folder).mkdir()
    (tmp_path / "protobuf" / "a.pb").write_bytes(b"\n\x0e\n\x052020a")
    (tmp_path / "a.md").write_text("{}")
    with pytest.raises(RecordingError, match=problem):
        read([tmp_path / name])


def test_no_paths_are_refused():
    with pytest.raises(RecordingError, match="nothing to read"):
        read([])


def test_other_parquet_files_are_refused(tmp_path: Path):
    path = tmp_path / "other.parquet"
    pl.DataFrame({"a": [1]}).write_parquet(path)
    with pytest.raises(RecordingError, match="unknown columns a"):
        read([path])
    path.write_text("no parquet")
    with pytest.raises(RecordingError, match=r"the file cannot be read .*check that it is whole"):
        read([path])


def filmed(moments: int, **columns: pl.Expr) -> Recording:
    """Two vehicles at 25 Hz and 20 m/s, in one place until the second, which goes aside, is 0.25 m away at 0.94 s."""
    aside = 0.25 / 0.94 * pl.col("vehicle")
    table = pl.DataFrame({"vehicle": np.repeat([0, 1], moments), "time": 0.04 * np.tile(np.arange(moments), 2)})
    table = table.with_columns(group=0, lon=20 * pl.col("time"), lat=3 + aside * pl.col("time"), length=4.5, width=1.8)
    table = table.with_columns(speed=(400 + aside**2).sqrt(), heading=pl.arctan2(aside, pl.lit(20.0)))
    table = table.with_columns(**columns).select(SCHEMA.names()).cast(dict(SCHEMA))
    return Recording("filmed", table, 0.04, Road.straight(length=600.0), {})


def test_who_is_double_in_the_rows_of_another_time_step_alone_is_left_out_and_counted(tmp_path: Path):
    """The second one is in the place of the first in 24 of 48 rows, and then in 10 of 19."""
    write_parquet([filmed(48)], tmp_path / "own.parquet")
    (whole,), (recording,) = (read([tmp_path / "own.parquet"], dt=dt) for dt in (0.04, 0.1))
    assert whole.repairs == {} and whole.table["vehicle"].n_unique() == 2
    assert recording.repairs == {"doubled vehicles": 1} and recording.table["vehicle"].unique().to_list() == [0]


def test_a_recording_that_is_none_at_another_time_step_is_refused_by_its_file(tmp_path: Path):
    apart = {"lat": pl.col("lat") + 4 * pl.col("vehicle")}
    write_parquet([filmed(48, **apart)], tmp_path / "long.parquet")
    write_parquet([filmed(2, time=pl.col("time") + 0.04, **apart)], tmp_path / "short.parquet")
    with pytest.raises(RecordingError, match=r"short\.parquet: recording filmed: the table holds no rows"):
        read([tmp_path])


@pytest.mark.real_data
def test_all_kinds_of_recorded_files_together(us101: Path):
    scenario = us101 / "commonroad" / "USA_US101-30_1_T-1.xml"
    recordings = read([scenario, us101 / "ngsim", us101 / "tracks"])
    assert [recording.name for recording in recordings][:3] == [
        "USA_US101-30_1_T-1",
        "us101_around_vehicle_320",
        "us101_around_vehicle_888",
    ]
    assert len(recordings) == 6
    groups = [set(recording.table["group"]) for recording in recordings]
    assert groups[:3] == [{0}, {1}, {2}]
    assert set().union(*groups[3:]) == set(range(3, 3 + len(set().union(*groups[3:]))))
    for recording in recordings:
        assert np.all(np.isfinite(recording.table.drop("stated").to_numpy()))


def test_files_that_are_read_one_by_one_have_a_group_each(make_ngsim, write_csv):
    files = [write_csv(make_ngsim(vehicles=3, seconds=3, speed=8.0 + k), f"{k}.csv") for k in range(8)]
    apart = together([recording for file in files for recording in read(file)])
    assert [recording.table["group"].unique().to_list() for recording in apart] == [[k] for k in range(8)]
    assert [each.table.equals(other.table) for each, other in zip(apart, read(files), strict=True)] == [True] * 8
    assert together(apart) == apart
