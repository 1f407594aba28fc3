"""What is known to go wrong with files of published formats: each is refused by name, or repaired and counted."""

import json
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from published_commonroad import write_commonroad
from published_formats import (
    Truth,
    placed,
    truth,
    write_exid,
    write_highd,
    write_i24,
    write_interaction,
    write_lanelets,
    write_mona,
    write_tgsim,
)
from published_ngsim import write_ngsim
from recordings_fakes import FOOT, lanelet, scenario, state, vehicle

from coverdrive.errors import RecordingError
from coverdrive.recordings.formats.registry import readers
from coverdrive.recordings.map_tracks import MapTracks, readings_from_map
from coverdrive.recordings.read import read
from coverdrive.recordings.tracks.smoothing import SmoothingSettings

FAST, SLOW, OTHER = truth(0.04, seconds=4.0), truth(0.1, seconds=4.0), truth(0.1, seconds=4.0, seed=4)

WRITERS: dict[str, Callable[[Path], Path]] = {
    "NGSIM": lambda folder: write_ngsim(folder, SLOW),
    "NGSIM-metric": lambda folder: write_ngsim(folder, SLOW, "parquet"),
    "highD": lambda folder: write_highd(folder, FAST),
    "exiD": lambda folder: write_exid(folder, FAST),
    "INTERACTION": lambda folder: write_interaction(folder, SLOW),
    "MONA": lambda folder: write_mona(folder, FAST),
    "TGSIM": lambda folder: write_tgsim(folder, [SLOW]),
    "I-24": lambda folder: write_i24(folder, FAST),
    "CommonRoad": lambda folder: write_commonroad(folder, SLOW),
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_of_one_format_named_as_another(name: str, tmp_path: Path):
    path = WRITERS[name](tmp_path)
    for other in set(readers()) - {name}:
        with pytest.raises(RecordingError, match=rf"{path.stem}.*it is of the format {name}, not {other}: leave"):
            read([path], format=other)


@pytest.mark.parametrize("name", ["exiD", "INTERACTION", "MONA", "I-24"])
def test_two_carriageways_without_a_map_are_two_recordings(name: str, tmp_path: Path):
    found = read([WRITERS[name](tmp_path)])
    assert [each.repairs for each in found] == [{}, {}]
    assert {each.notes["traffic"] for each in found} == {"keeps right"}


def test_ids_that_repeat_between_runs_that_are_not_told(tmp_path: Path):
    """At the same time, and one after the other."""
    problem = r"TGSIM\.csv, row \d+: the number 1 of a vehicle is at two places.*each run a file of its own"
    with pytest.raises(RecordingError, match=problem):
        read([write_tgsim(tmp_path, [SLOW, OTHER], run_index=pl.lit(1))])
    later = {"time": pl.col("time") + 600 * pl.col("run_index"), "run_index": pl.lit(1)}
    (recording,) = read([write_tgsim(tmp_path, [SLOW, OTHER], **later)])
    vehicles = [run.tables[0]["vehicle"].n_unique() for run in (SLOW, OTHER)]
    assert recording.repairs == {"split tracks": min(vehicles)}
    assert recording.table["vehicle"].n_unique() == sum(vehicles)


Y_DOWN: dict[str, tuple[Callable[[Path], Path], str]] = {
    "highD": (lambda folder: write_highd(folder, FAST, y=-pl.col("y")), "positions along y run against the velocities"),
    "exiD": (lambda folder: write_exid(folder, FAST, yCenter=-pl.col("yCenter")), "along y run against the velocities"),
    "INTERACTION": (lambda folder: write_interaction(folder, SLOW, y=-pl.col("y")), "along y run against the veloc"),
    "MONA": (lambda folder: write_mona(folder, FAST, y=-pl.col("y")), "in a frame whose y is up"),
}


@pytest.mark.parametrize("name", Y_DOWN)
def test_y_down(name: str, tmp_path: Path):
    write, problem = Y_DOWN[name]
    with pytest.raises(RecordingError, match=problem):
        read([write(tmp_path)])


@pytest.mark.parametrize("down", [True, False])
def test_y_of_tgsim_that_is_not_down(down: bool, tmp_path: Path):
    """It states no velocities or headings: with two directions their side tells, with one the order of lanes."""
    mirror = 1 if down else -1
    path = write_tgsim(tmp_path, [SLOW], yloc_kf=mirror * pl.col("yloc_kf"))
    (recording,) = read([path])
    assert recording.notes["lanes"] == f"lane numbers, growing to the {'right' if down else 'left'}"
    unordered = pl.read_csv(path).with_columns(lane_kf=1 + (pl.col("lane_kf") + 1) % 3)
    unordered.write_csv(path)
    assert read([path])[0].notes["lanes"] == "lane numbers, in no order"
    table = pl.read_csv(write_tgsim(tmp_path, [SLOW], yloc_kf=mirror * pl.col("yloc_kf")))
    other = table.with_columns(
        id=pl.col("id") + 1000, xloc_kf=900 - pl.col("xloc_kf"), yloc_kf=mirror * 32.4 - pl.col("yloc_kf")
    )
    pl.concat([table, other]).write_csv(path)
    if down:
        assert [each.notes["traffic"] for each in read([path])] == ["keeps right"] * 2
        return
    with pytest.raises(RecordingError, match=r"keep left of those that come.*to keep right: .* turn the y round"):
        read([path])


SIZES = {"length": pl.col("width"), "width": pl.col("length")}
SWAPPED: dict[str, Callable[[Path], Path]] = {
    "highD": lambda folder: write_highd(folder, FAST, width=pl.col("height"), height=pl.col("width")),
    "exiD": lambda folder: write_exid(folder, FAST, **SIZES),
    "INTERACTION": lambda folder: write_interaction(folder, SLOW, **SIZES),
    "MONA": lambda folder: write_mona(folder, FAST, **SIZES),
    "TGSIM": lambda folder: write_tgsim(
        folder, [SLOW], length_smoothed=pl.col("width_smoothed"), width_smoothed=pl.col("length_smoothed")
    ),
}


@pytest.mark.parametrize("name", SWAPPED)
def test_size_columns_swapped(name: str, tmp_path: Path):
    with pytest.raises(RecordingError, match=r"csv, column width: most .*(are swapped|swap the columns)"):
        read([SWAPPED[name](tmp_path)])


def scaled(factor: float, *names: str) -> dict[str, pl.Expr]:
    return {name: factor * pl.col(name) for name in names}


def of_i24(folder: Path, x: float = 1.0, y: float = 1.0, size: float = 1.0) -> Path:
    """Positions and sizes in feet times these factors."""
    path = write_i24(folder, SLOW)
    factors = {"x_position": x, "y_position": y, "length": size, "width": size}
    records = json.loads(path.read_text())
    for record, (name, factor) in product(records, factors.items()):
        record[name] = (factor * np.array(record[name])).tolist()
    path.write_text(json.dumps(records))
    return path


def of_ngsim(folder: Path, *metric: str, without: str = "Zone") -> Path:
    """The portal's CSV, in which some columns are in metres."""
    path = write_ngsim(folder, SLOW)
    pl.read_csv(path).with_columns(**scaled(FOOT, *metric)).drop(without, strict=False).write_csv(path)
    return path


MOVED = ("Local_X", "Local_Y", "v_Vel")
WITHIN = r"vehicle \d+ at .* s lies within vehicle \d+, and so do \d\d % of those .* are in one unit"
MIXED: dict[str, tuple[Callable[[Path], Path], str]] = {
    "NGSIM, sizes in feet, the rest in metres": (lambda folder: of_ngsim(folder, *MOVED), WITHIN),
    "the same without lanes": (lambda folder: of_ngsim(folder, *MOVED, without="Lane_ID"), WITHIN),
    "NGSIM, metres across": (lambda folder: of_ngsim(folder, "Local_X"), WITHIN),
    "NGSIM, sizes in metres": (
        lambda folder: of_ngsim(folder, "v_length", "v_Width"),
        "median length .* is 1.4.*: check the unit",
    ),
    "NGSIM, widths in metres": (lambda folder: of_ngsim(folder, "v_Width"), "median width .* is 0.5.* check the unit"),
    "I-24, positions in metres": (lambda folder: of_i24(folder, FOOT, FOOT), WITHIN),
    "I-24, metres across": (lambda folder: of_i24(folder, 1.0, FOOT), WITHIN),
    "I-24, sizes in metres": (lambda folder: of_i24(folder, size=FOOT), "median length .* is 1.4.* check the unit"),
    "TGSIM, half of it": (lambda folder: write_tgsim(folder, [SLOW], **scaled(FOOT, *TGSIM_MOVED)), WITHIN),
    "exiD, half of it": (lambda folder: write_exid(folder, FAST, **scaled(FOOT, *EXID_MOVED)), WITHIN),
}
TGSIM_MOVED = ("xloc_kf", "yloc_kf", "speed_kf")
EXID_MOVED = ("xCenter", "yCenter", "xVelocity", "yVelocity")


@pytest.mark.parametrize("case", MIXED)
def test_units_that_are_mixed(case: str, tmp_path: Path):
    write, problem = MIXED[case]
    with pytest.raises(RecordingError, match=problem):
        read([write(tmp_path)])


def slower(real: Truth, times: int) -> Truth:
    """Every so many moments."""
    kept = (pl.col("frame") - 1) % times == 0
    anew = (pl.col("frame") - 1) // times + 1
    return Truth(tuple(table.filter(kept).with_columns(frame=anew) for table in real.tables), times * real.dt)


LONG = truth(0.1, seconds=20.0)
RATES: dict[str, Callable[[Path, Truth], Path]] = {
    "NGSIM": write_ngsim,
    "highD": write_highd,
    "exiD": write_exid,
    "INTERACTION": lambda folder, real: write_interaction(
        folder, real, timestamp_ms=1000 * real.dt * pl.col("frame_id")
    ),
    "TGSIM": lambda folder, real: write_tgsim(folder, [real]),
    "I-24": write_i24,
    "CommonRoad": write_commonroad,
}


@pytest.mark.parametrize("name", RATES)
def test_one_row_a_second_is_read_and_slower_is_refused_by_its_rate(name: str, tmp_path: Path):
    assert read([RATES[name](tmp_path, slower(LONG, 10))])
    problem = r"is 2 s; expected 0\.02 to 1 s \(50 to 1 Hz\): at 0\.5 Hz .* take a recording of 1 Hz or more"
    with pytest.raises(RecordingError, match=problem):
        read([RATES[name](tmp_path, slower(LONG, 20))])


def test_clocks_that_waver_at_one_row_a_second_split_no_track(tmp_path: Path):
    path = write_i24(tmp_path, slower(LONG, 10))
    records = json.loads(path.read_text())
    for record in records:
        record["timestamp"] = [time + 0.0004 * (-1) ** number for number, time in enumerate(record["timestamp"])]
    path.write_text(json.dumps(records))
    assert not any("split tracks" in each.repairs for each in read([path]))


def test_too_few_rows_name_the_rate(tmp_path: Path):
    path = write_ngsim(tmp_path, SLOW)
    pl.read_csv(path).filter(pl.int_range(pl.len()).over("Vehicle_ID") < 2).write_csv(path)
    with pytest.raises(RecordingError, match="in more than 2 successive rows, at 10 Hz; choose another file, or one"):
        read([path])


@pytest.mark.parametrize(
    ("number", "problem"),
    [
        (pl.col("vehicle") + 2**60, ""),
        (pl.col("vehicle").cast(pl.UInt64) + 2**63, "expected an exact whole number.*got 922337203685477"),
        (
            pl.col("vehicle") + 2.0**53,
            r"row 1, column vehicle: expected an exact whole number.*got 90071992547409\d\d\.0;",
        ),
    ],
)
def test_numbers_of_vehicles_are_exact_or_refused(number: pl.Expr, problem: str, tmp_path: Path):
    table = placed(Truth(SLOW.tables[:1], SLOW.dt)).select("x", "y", "time", "length", "width", vehicle=number)
    tracks = MapTracks("mine", table, dt=0.1)
    if problem:
        with pytest.raises(RecordingError, match=problem):
            readings_from_map(tmp_path / "mine.csv", tracks, SmoothingSettings())
        return
    (reading,) = readings_from_map(tmp_path / "mine.csv", tracks, SmoothingSettings())
    assert set(reading.recording.table["vehicle"]) <= set(table["vehicle"])


@pytest.mark.parametrize("write", [write_highd, write_exid])
@pytest.mark.parametrize("missing", ["tracksMeta", "recordingMeta"])
def test_missing_meta_files(write: Callable[..., Path], missing: str, tmp_path: Path):
    path = write(tmp_path, FAST)
    path.with_name(path.name.replace("tracks", missing)).unlink()
    with pytest.raises(RecordingError, match=rf"its description \d\d_{missing}\.csv is not beside it; expected NN_"):
        read([path])


@pytest.mark.parametrize(("radius", "refused"), [(150.0, False), (45.0, True)])
def test_a_curve_below_50_m_without_a_map(radius: float, refused: bool, tmp_path: Path):
    """By 40° in the middle of the tracks."""
    path, turn = write_interaction(tmp_path, SLOW, degrees=0.0), np.radians(40.0)
    table = pl.read_csv(path)
    way, left = table["x"].to_numpy(), table["y"].to_numpy() - table["y"].to_numpy().mean()
    way = way - (way.min() + way.max() - turn * radius) / 2
    heading = np.clip(way, 0, turn * radius) / radius
    rest = np.clip(way - turn * radius, 0, None)
    velocity = (table["vx"].to_numpy() + 1j * table["vy"].to_numpy()) * np.exp(1j * heading)
    place = np.minimum(way, 0) + 1j * radius * (1 - np.exp(1j * heading)) + (rest + 1j * left) * np.exp(1j * heading)
    parts = {"x": place.real, "y": place.imag, "vx": velocity.real, "vy": velocity.imag, "psi_rad": np.angle(velocity)}
    table.with_columns(**{name: pl.Series(values) for name, values in parts.items()}).write_csv(path)
    if not refused:
        assert read([path])
        return
    with pytest.raises(RecordingError, match=r"bends by \d+° more than a road .* as in curves below about 60 m radius"):
        read([path])


def crossing(start: float, count: int, number: int) -> str:
    """A vehicle that drives across the road of `on_two_lanes`, from its right to its left side."""
    states = [state(start, -7.0 + 0.9 * k, 9.0, k, "state" if k else "initialState") for k in range(count)]
    return vehicle(number, states)


def on_two_lanes(end: float, vehicles: str) -> str:
    """Two lanes of 3.5 m and 180 m, of which the right one ends."""
    left = lanelet(1, 0.0, 180.0, 0.0, 3.5, "")
    return scenario(left + lanelet(2, 0.0, end, -3.5, 3.5, ""), vehicles)


def along(number: int, start: float, left: Callable[[float], float], count: int = 40) -> str:
    """A vehicle at 20 m/s."""
    spots = start + 2.0 * np.arange(count)
    return vehicle(
        number, [state(at, left(at), 20.0, k, "state" if k else "initialState") for k, at in enumerate(spots)]
    )


def test_crossings_of_few_are_left_out_and_counted_and_of_many_refused(tmp_path: Path):
    usual = "".join(along(10 + k, 5.0 * k, lambda _: -1.75) for k in range(5))
    path = tmp_path / "scene.xml"
    path.write_text(on_two_lanes(180.0, usual + crossing(100.0, 8, 100)))
    (recording,) = read([path])
    assert recording.repairs == {"implausible vehicles": 1}
    path.write_text(on_two_lanes(180.0, usual + crossing(100.0, 8, 100) + crossing(80.0, 8, 101)))
    with pytest.raises(RecordingError, match=r"vehicle 10\d at .* s (drives across|moves).*"):
        read([path])


def test_oncoming_traffic_in_the_same_file_has_its_own_recording_on_a_map(tmp_path: Path):
    path = write_exid(tmp_path, FAST)
    found = read([path], map=write_lanelets(tmp_path))
    assert [(each.road.lanes, each.repairs) for each in found] == [(3, {}), (3, {})]


def test_a_lane_change_at_the_end_of_a_lane(tmp_path: Path):
    """Who leaves a lane before it ends, or soon after, stays; rows half a lane beside the next one are counted."""
    path = tmp_path / "scene.xml"

    def merging(until: float) -> Callable[[float], float]:
        return lambda at: float(np.interp(at, [until - 40, until], [-5.6, -1.75]))

    for until, off in ((100.0, False), (130.0, False), (160.0, True)):
        path.write_text(on_two_lanes(110.0, along(10, 10.0, lambda _: -1.75) + along(11, 60.0, merging(until))))
        (recording,) = read([path])
        assert ("rows off the road" in recording.repairs) == off
        assert recording.road.lanes == 2 and set(recording.table["vehicle"]) >= {10, 11}
        lanes = recording.road.lane_at(recording.table["lon"].to_numpy(), recording.table["lat"].to_numpy())
        there = recording.road.has_lane(recording.table["lon"].to_numpy())
        assert there[np.arange(len(lanes)), lanes].all()
