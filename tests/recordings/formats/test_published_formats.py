"""Public data sets, as an independent writer publishes generated traffic: `published_formats`."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from published_formats import (
    EDGES,
    LENGTH,
    Truth,
    found_again,
    truth,
    write_centre_lines,
    write_exid,
    write_highd,
    write_i24,
    write_interaction,
    write_mona,
    write_tgsim,
)

from coverdrive.errors import RecordingError
from coverdrive.recordings.files.kinds import KINDS
from coverdrive.recordings.formats import i24
from coverdrive.recordings.read import read
from coverdrive.recordings.recording import Recording

FAST, SLOW = truth(0.04, seconds=6.0), truth(0.1, seconds=6.0)
OTHER = truth(0.1, seconds=6.0, seed=4)


def kinds_of(recording: Recording) -> set[str]:
    return {KINDS[kind] for kind in recording.table["kind"].unique()}


TWO_WAY: dict[str, tuple[Callable[[Path], Path], float, float, bool]] = {
    "exiD": (lambda folder: write_exid(folder, FAST), 0.04, 0.0, True),
    "INTERACTION": (lambda folder: write_interaction(folder, SLOW), 0.1, 0.1, False),
    "MONA": (lambda folder: write_mona(folder, FAST), 0.04, 0.04, True),
    "MONA as Parquet": (lambda folder: write_mona(folder, FAST, "parquet"), 0.04, 0.04, True),
    "I-24": (lambda folder: write_i24(folder, FAST), 0.04, 0.0, True),
    "I-24, line by line": (lambda folder: write_i24(folder, FAST, lines=True, signed=False), 0.04, 0.0, True),
}
"""How each is written, its time step, how late its clock is, and whether it says what trucks are"""


@pytest.mark.parametrize("name", TWO_WAY)
def test_both_directions_are_found_again(name: str, tmp_path: Path):
    write, step, shift, classes = TWO_WAY[name]
    real = FAST if step == 0.04 else SLOW
    recordings = read([write(tmp_path)])
    assert len(recordings) == 2
    by_size = {recording.table["vehicle"].n_unique(): recording for recording in recordings}
    for table in real.tables:
        recording = by_size[table["vehicle"].n_unique()]
        assert recording.dt == 0.1 and recording.repairs == {}
        assert recording.notes["lanes"] == "estimated (tracks)"
        assert recording.notes["traffic"] == "keeps right"
        assert recording.notes["format"] == name.split(",")[0].split(" ")[0]
        assert ("resampled" in recording.notes) == (step == 0.04)
        assert recording.road.lanes == 3 and np.diff(recording.road.edges) == pytest.approx(3.6, abs=0.15)
        worst = found_again(recording, table, shift, first=0 if "I-24" in name else 1)
        assert worst["lon"] < 0.12 and worst["lat"] < 0.2 and worst["speed"] < 0.45 and worst["heading"] < 0.012
        if classes and (table["length"] > 8).any():
            assert kinds_of(recording) == {"car", "truck"}


WRITERS: dict[str, Callable[[Path], Path]] = {
    "highD": lambda folder: write_highd(folder, FAST),
    "exiD": lambda folder: write_exid(folder, FAST),
    "INTERACTION": lambda folder: write_interaction(folder, SLOW),
    "MONA": lambda folder: write_mona(folder, FAST),
    "TGSIM": lambda folder: write_tgsim(folder, [SLOW]),
}


@pytest.mark.parametrize("name", WRITERS)
def test_rows_out_of_order_are_sorted_and_counted(name: str, tmp_path: Path):
    """Of every vehicle all rows but the last one, whether vehicles follow one another or take turns."""
    path = WRITERS[name](tmp_path)
    table, expected = pl.read_csv(path), read([path])
    vehicle = next(each for each in ("id", "trackId", "track_id") if each in table.columns)
    clock = next(each for each in ("frame", "frame_id", "time") if each in table.columns)
    latest_first = table.sort(clock, descending=True)
    for rows in (latest_first.sort(vehicle, maintain_order=True), latest_first):
        rows.write_csv(path)
        found = read([path])
        assert all(one.table.equals(other.table) for one, other in zip(found, expected, strict=True))
        wrong = sum(each.repairs.get("rows out of order", 0) for each in found)
        assert wrong == len(table) - table[vehicle].n_unique()


def test_a_lane_without_vehicles_is_estimated_too(tmp_path: Path):
    outer = [table.filter(~pl.col("lat").is_between(EDGES[1], EDGES[2])) for table in truth(0.1, 1, 30.0).tables]
    (recording,) = read([write_interaction(tmp_path, Truth(tuple(outer), 0.1))])
    assert recording.road.edges == pytest.approx(EDGES, abs=0.02)


@pytest.mark.parametrize("tall", [False, True])
@pytest.mark.parametrize("hyphens", [False, True])
def test_runs_are_told_apart(hyphens: bool, tall: bool, tmp_path: Path):
    write_tgsim(tmp_path, [SLOW, OTHER], hyphens, tall)
    recordings = read([tmp_path])
    assert [recording.name for recording in recordings] == ["TGSIM run 1", "TGSIM run 2"]
    assert [recording.table["group"].unique().to_list() for recording in recordings] == [[0], [1]]
    for run, (recording, real) in enumerate(zip(recordings, (SLOW, OTHER), strict=True), 1):
        assert recording.notes["lanes"] == "lane numbers, growing to the right" and recording.repairs == {}
        assert recording.road.lanes == 3 and np.diff(recording.road.edges) == pytest.approx(3.6, abs=0.1)
        worst = found_again(recording, real.tables[0], shift=1e5 * run)
        assert worst["lon"] < 0.12 and worst["lat"] < 0.2 and worst["speed"] < 0.45 and worst["heading"] < 0.012
    assert "truck" in kinds_of(recordings[0]) | kinds_of(recordings[1])


def test_centre_lines_beside_the_tracks_are_used(tmp_path: Path):
    write_tgsim(tmp_path, [SLOW, OTHER])
    for run in (1, 2):
        write_centre_lines(tmp_path, run)
    for run, (recording, real) in enumerate(zip(read([tmp_path]), (SLOW, OTHER), strict=True), 1):
        assert recording.notes["lanes"] == "centre lines"
        assert recording.road.edges == pytest.approx(EDGES)
        assert found_again(recording, real.tables[0], shift=1e5 * run)["lat"] < 0.02
    with pytest.raises(RecordingError, match=r"it is no recording, but belongs to one of the format TGSIM"):
        read([write_centre_lines(tmp_path, 3)])


def test_types_of_files_with_automated_vehicles_are_unknown(tmp_path: Path):
    write_tgsim(tmp_path, [SLOW], av=pl.lit(0))
    assert kinds_of(read([tmp_path])[0]) == {"unknown"}


def test_pedestrians_are_left_out_and_counted(tmp_path: Path):
    walking = pl.when(pl.col("trackId") == 5).then(pl.lit("pedestrian")).otherwise(pl.lit("car"))
    write_exid(tmp_path, FAST)
    listed = pl.read_csv(tmp_path / "03_tracksMeta.csv")
    listed.with_columns(**{"class": walking}).write_csv(tmp_path / "03_tracksMeta.csv")
    recordings = read([tmp_path])
    assert sum(recording.repairs.get("rows of other road users", 0) for recording in recordings) > 100
    (tmp_path / "pedestrian_tracks_007.csv").write_text("track_id,frame_id,timestamp_ms,agent_type,x,y,vx,vy\nP1,1\n")
    assert len(read([tmp_path])) == 2


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"yCenter": -pl.col("yCenter")}, "positions along y run against the velocities"),
        ({"heading": pl.col("heading").radians()}, r"vehicles move at .*° to their headings"),
        ({"frame": pl.col("frame") * 2}, "ratio of the speeds"),
        ({"xVelocity": pl.col("xVelocity") * 3.6, "yVelocity": pl.col("yVelocity") * 3.6}, "speeds .* is 0.278"),
        ({"length": pl.col("width"), "width": pl.col("length")}, r"width|wider than long"),
        ({"xCenter": pl.col("xCenter") / 0.3048, "yCenter": pl.col("yCenter") / 0.3048}, "ratio of the speeds"),
        ({"trackId": pl.col("trackId") + 0.5}, "is not in 03_tracksMeta|expected a whole number"),
    ],
)
def test_wrong_units_and_directions_are_noticed(changes: dict[str, pl.Expr], problem: str, tmp_path: Path):
    write_exid(tmp_path, FAST, **changes)
    with pytest.raises(RecordingError, match=problem):
        read([tmp_path])


def test_a_mirrored_map_is_noticed_by_its_headings(tmp_path: Path):
    """Positions of an image, with speeds but no velocities."""
    with pytest.raises(RecordingError, match=r"in a frame whose y is up"):
        read([write_mona(tmp_path, FAST, y=-pl.col("y"))])


def test_oncoming_traffic_in_the_same_lanes_is_refused(tmp_path: Path):
    half = pl.col("track_id") % 2 == 0
    turned = {"x": pl.when(half).then(2000 - pl.col("x")).otherwise(pl.col("x"))}
    turned |= {"vx": pl.when(half).then(-pl.col("vx")).otherwise(pl.col("vx"))}
    path = write_interaction(tmp_path, SLOW, degrees=0.0, **turned)
    pl.read_csv(path).drop("psi_rad").with_columns(psi_rad=pl.arctan2("vy", "vx")).write_csv(path)
    with pytest.raises(RecordingError, match="vehicles drive both ways in the same place"):
        read([path])


def test_few_vehicles_the_other_way_are_left_out_and_counted(tmp_path: Path):
    one = truth(0.1, carriageways=1)
    wrong = pl.col("track_id") == 3
    path = write_interaction(
        tmp_path,
        one,
        degrees=0.0,
        x=pl.when(wrong).then(2000 - pl.col("x")).otherwise(pl.col("x")),
        vx=pl.when(wrong).then(-pl.col("vx")).otherwise(pl.col("vx")),
        psi_rad=pl.when(wrong).then(pl.lit(np.pi)).otherwise(pl.col("psi_rad")),
    )
    (recording,) = read([path])
    assert recording.repairs["vehicles the other way"] == 1


def test_junctions_are_refused(tmp_path: Path):
    north = pl.col("track_id") % 3 == 0
    path = write_interaction(tmp_path, SLOW, degrees=0.0)
    table = pl.read_csv(path)
    swapped = {
        a: pl.when(north).then(pl.col(b)).otherwise(pl.col(a)) for a, b in zip(("x", "y"), ("y", "x"), strict=True)
    }
    swapped |= {a: pl.when(north).then(pl.col(b)).otherwise(pl.col(a)) for a, b in (("vx", "vy"), ("vy", "vx"))}
    table.with_columns(**swapped).with_columns(psi_rad=pl.arctan2("vy", "vx")).write_csv(path)
    with pytest.raises(RecordingError, match=r"vehicles drive at more than 30° to the others.*no junction"):
        read([path])


@pytest.mark.parametrize("radius", [1000.0, 600.0, -800.0])
def test_roads_that_bend_are_followed(radius: float, tmp_path: Path):
    """By 31° to 52°, to the left and to the right."""
    real = truth(0.1, carriageways=1)
    path = write_interaction(tmp_path, real, degrees=0.0, curvature=1 / radius)
    (recording,) = read([path])
    assert recording.repairs == {} and recording.road.lanes == 3
    curvature = recording.road.curvature(np.linspace(50, float(recording.road.length) - 50, 20))
    assert curvature == pytest.approx(1 / radius, rel=0.2)
    assert found_again(recording, real.tables[0], 0.1)["lat"] < 0.1


@pytest.mark.parametrize("radius", [1000.0, -1000.0])
@pytest.mark.parametrize("direction", [0, 1])
def test_who_stands_where_a_road_bends_is_of_its_own_direction(direction: int, radius: float, tmp_path: Path):
    """Near an end of the road, where nobody else is, and far from a straight line along its middle."""
    tables = list(truth(0.1).tables)
    place = {"lon": 15.0 if direction == 0 else LENGTH - 15.0, "lat": 1.8, "speed": 0.0, "heading": 0.0}
    standing = tables[direction].unique("frame", maintain_order=True).with_columns(vehicle=999, length=4.5, **place)
    tables[direction] = pl.concat([tables[direction], standing.cast(dict(tables[0].schema))])
    path = write_interaction(tmp_path, Truth(tuple(tables), 0.1), degrees=0.0, curvature=1 / radius)
    own, other = sorted(read([path]), key=lambda recording: 1000 not in recording.table["vehicle"])
    assert own.name.endswith("towards +x" if direction == 0 else "towards -x")
    assert 1000 in own.table["vehicle"] and 1000 not in other.table["vehicle"]


def test_junctions_of_few_are_left_out(tmp_path: Path):
    """One vehicle crosses the road."""
    path = write_interaction(tmp_path, SLOW, degrees=0.0)
    crossing = pl.col("track_id") == 4
    table = pl.read_csv(path).with_columns(
        x=pl.when(crossing).then(pl.col("y")).otherwise(pl.col("x")),
        y=pl.when(crossing).then(pl.col("x")).otherwise(pl.col("y")),
        vx=pl.when(crossing).then(pl.col("vy")).otherwise(pl.col("vx")),
        vy=pl.when(crossing).then(pl.col("vx")).otherwise(pl.col("vy")),
    )
    table.with_columns(psi_rad=pl.arctan2("vy", "vx")).write_csv(path)
    assert [recording.repairs for recording in read([path])] == [{"crossing vehicles": 1}, {}]


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ('"direction": 1,', '"direction": 2,', r"trajectory \d+ is damaged"),
        ('"width"', '"breadth"', "trajectory 1 is damaged.*numbers length, width"),
        ("[1600000000.0, ", "[", "trajectory 1 is damaged"),
        ("[1600000000.0, ", "[1600000009.0, ", "times of trajectory 1 do not ascend"),
        ("}]", "", "the file is cut or no JSON"),
        ('"direction": ', '"direction": -', "vehicles of direction 1 drive towards smaller x_position"),
    ],
)
def test_damaged_trajectories_are_named(old: str, new: str, problem: str, tmp_path: Path):
    path = write_i24(tmp_path, FAST)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new).replace("--", ""))
    with pytest.raises(RecordingError, match=problem):
        read([path])


def test_trajectories_are_read_in_small_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = write_i24(tmp_path, FAST)
    whole = read([path])
    monkeypatch.setattr(i24, "CHUNK", 100)
    again = read([path])
    assert all(one.table.equals(other.table) for one, other in zip(whole, again, strict=True))
    monkeypatch.setattr(i24, "MOST_ROWS", 1000)
    with pytest.raises(RecordingError, match=r"more than 1,000 points; cut it"):
        read([path])


@pytest.mark.parametrize("length", [0.0, 500.0])
def test_a_vehicle_of_odd_length_is_where_one_of_the_usual_length_is(length: float, tmp_path: Path):
    path = write_i24(tmp_path, FAST)
    records = json.loads(path.read_text())
    places = list[pl.DataFrame]()
    for each in (length, 4.5 / 0.3048):
        records[0]["length"] = each
        path.write_text(json.dumps(records))
        places.append(pl.concat([one.table.select("vehicle", "time", "lon", "length") for one in read([path])]))
    assert places[0].select("lon", "length").to_numpy() == pytest.approx(places[1].select("lon", "length").to_numpy())


def test_long_trajectories_are_recognised(tmp_path: Path):
    """The keys after the lists are a megabyte away."""
    path = write_i24(tmp_path, FAST)
    records = json.loads(path.read_text())
    path.write_text(json.dumps([{"road_segment_ids": [0.0] * 200_000} | record for record in records[:3]] + records))
    assert len(read([path])) == 2


def test_other_json_in_a_folder_is_passed_over(tmp_path: Path):
    write_i24(tmp_path, FAST)
    (tmp_path / "result.json").write_text('{"speed": 3}')
    assert len(read([tmp_path])) == 2
    with pytest.raises(RecordingError, match=r"unknown columns speed; if it is of one of the formats.*I-24.*--format"):
        read([tmp_path / "result.json"])
