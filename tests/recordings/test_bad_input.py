"""All that is known to be wrong with recordings: each case is refused where it is wrong, or repaired and counted."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from recordings_fakes import FOOT, bent, driving, metric, scenario, straight, three_lanes, traffic

from coverdrive.errors import DataError, RecordingError
from coverdrive.recordings.read import read
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.road import Road


def at(vehicle: int, time: float) -> pl.Expr:
    return (pl.col("vehicle") == vehicle) & ((pl.col("time") - time).abs() < 1e-6)


def put(name: str, value: object, where: pl.Expr) -> Callable[[pl.DataFrame], pl.DataFrame]:
    """One cell replaced."""
    return lambda table: table.with_columns(pl.when(where).then(pl.lit(value)).otherwise(pl.col(name)).alias(name))


def scaled(names: str, factor: float) -> Callable[[pl.DataFrame], pl.DataFrame]:
    return lambda table: table.with_columns(pl.col(names.split()) * factor)


def shifted(name: str, by: float, where: pl.Expr) -> Callable[[pl.DataFrame], pl.DataFrame]:
    return lambda table: table.with_columns(pl.when(where).then(pl.col(name) + by).otherwise(pl.col(name)).alias(name))


def backwards(table: pl.DataFrame) -> pl.DataFrame:
    """Vehicle 4 drives in the lane for the others."""
    only = pl.col("vehicle") == 4
    return table.with_columns(
        pl.when(only).then(600 - pl.col("lon")).otherwise(pl.col("lon")).alias("lon"),
        pl.when(only).then(np.pi).otherwise(pl.col("heading")).alias("heading"),
    )


TABLES: dict[str, tuple[Callable[[pl.DataFrame], pl.DataFrame], str]] = {
    "km/h": (
        scaled("speed", 3.6),
        r"0\.278 times as far as their speeds say.*look like km/h: multiply them by 0\.2778",
    ),
    "mph": (scaled("speed", 1 / 0.44704), r"look like mph: multiply them by 0\.447"),
    "ft/s": (scaled("speed", 1 / FOOT), r"look like ft/s: multiply them by 0\.3048"),
    "positions in feet": (scaled("lon lat", 1 / FOOT), r"3\.28 times as far.*positions look like feet"),
    "no speeds": (scaled("speed", 0.0), r"inf times as far"),
    "sizes in feet": (scaled("length width", 1 / FOOT), r"median width .* is 6\.23 m; expected 1 to 3 m.*feet"),
    "sizes swapped": (
        lambda t: t.rename({"length": "width", "width": "length"}).select(SCHEMA.names()),
        "swap the columns",
    ),
    "degrees": (lambda t: t.with_columns(heading=pl.lit(90.0)), r"heading of vehicle 0 at 0 s is 90 rad.*π/180"),
    "small degrees": (
        scaled("heading", 180 / np.pi),
        r"vehicle 1 at 0 s moves \(217\.\d, 2\.0\) m.*multiply degrees by π/180",
    ),
    "from north": (lambda t: t.with_columns(heading=np.pi / 2 - pl.col("heading")), "count from the road's direction"),
    "turned round": (
        lambda t: t.with_columns(lon=800 - pl.col("lon")),
        "lon runs against the direction of travel: turn the road round",
    ),
    "driving backwards": (backwards, r"vehicle 4 at 0 s drives 218 m against the direction of the road"),
    "negative speed": (put("speed", -22.0, at(2, 3.0)), r"the speed of vehicle 2 at 3 s is -22 m/s"),
    "too fast": (put("speed", 400.0, at(2, 3.0)), r"the speed of vehicle 2 at 3 s is 400 m/s; expected 0 to 90"),
    "NaN": (put("lat", float("nan"), at(2, 3.0)), r"lat of vehicle 2 in row 230 is nan; expected a number"),
    "null": (put("lon", None, at(2, 3.0)), r"lon of vehicle 2 in row 230 is None"),
    "infinite": (put("speed", float("inf"), at(5, 9.9)), r"speed of vehicle 5 in row 599 is inf"),
    "no vehicle": (put("vehicle", None, at(5, 9.9)), r"vehicle of vehicle None in row 599"),
    "negative vehicle": (scaled("vehicle", -1), r"a vehicle has the number -5; expected 0 or more"),
    "gap": (lambda t: t.filter(~at(2, 3.0)), r"vehicle 2 at 2\.9 s is next seen at 3\.1 s.*fill the gap"),
    "unsorted": (
        lambda t: t.reverse(),
        r"vehicle 5 at 9\.8 s comes after vehicle 5 at 9\.9 s.*sort by vehicle and time",
    ),
    "by time": (lambda t: t.sort("time", "vehicle"), "sort by vehicle and time"),
    "twice": (lambda t: pl.concat([t, t.filter(at(2, 3.0))]).sort("vehicle", "time"), r"vehicle 2 at 3 s has two rows"),
    "between": (shifted("time", 0.04, at(2, 9.9)), r"vehicle 2 at 9\.94 s is between two time steps.*resample"),
    "milliseconds": (
        lambda t: t.with_columns(time=1.7e12 + pl.col("time")),
        "expected seconds; divide milliseconds by 1000",
    ),
    "length 0": (put("length", 0.0, at(1, 1.0)), r"the length of vehicle 1 at 1 s is 0 m; expected 1 to 60 m"),
    "negative width": (
        put("width", -1.8, at(1, 1.0)),
        r"the width of vehicle 1 at 1 s is -1\.8 m; expected 0\.4 to 4 m",
    ),
    "length 1e9": (put("length", 1e9, at(1, 1.0)), r"the length of vehicle 1 at 1 s is 1e\+09 m"),
    "teleport": (
        shifted("lon", 300.0, (pl.col("vehicle") == 3) & (pl.col("time") >= 5)),
        r"vehicle 3 at 4\.9 s moves 302\.2 m",
    ),
    "one outlier": (
        shifted("lat", 5.0, at(3, 5.0)),
        r"vehicle 3 at 4\.9 s moves 5\.5 m in 0\.1 s.*expected positions without",
    ),
    "off the road": (
        lambda t: t.with_columns(lat=pl.col("lat") + 40),
        r"vehicle 0 at 0 s is off the road, lat = 41\.8 m",
    ),
    "beyond the road": (
        lambda t: t.with_columns(lon=pl.col("lon") + 5e6),
        r"off the road, lon = 5e\+06 m.*or shift lon",
    ),
    "within each other": (
        lambda t: t.with_columns(lat=1.8 + 1.1 * (pl.col("vehicle") % 3), lon=pl.col("lon") - 39 * pl.col("vehicle")),
        r"vehicle \d at 0 s lies within vehicle \d, and so do 100 % of those .* are in one unit",
    ),
    "widths of another unit": (
        scaled("width", FOOT),
        r"the median width of the vehicles is 0\.579 m; expected 1 to 3 m: check the unit",
    ),
    "no rows": (lambda t: t.clear(), "the table holds no rows"),
    "columns": (lambda t: t.drop("width"), "columns"),
    "types": (lambda t: t.with_columns(pl.col("vehicle").cast(pl.Float64)), "columns"),
}


def row_of(vehicle: int, frame: int) -> pl.Expr:
    return (pl.col("Vehicle_ID") == vehicle) & (pl.col("Frame_ID") == frame)


def parquet(path: Path, table: pl.DataFrame, **head: Any) -> Path:
    """An own file, written without the package."""
    rows = table.with_columns(recording=pl.lit(0, dtype=pl.Int64))
    first = {"name": "mine", "dt": 0.1, "edges": [0.0, 3.6, 7.2, 10.8], "length": 1000.0, "repairs": {}} | head
    rows.write_parquet(path, metadata={"coverdrive": json.dumps([first])})
    return path


@pytest.mark.parametrize("case", TABLES)
def test_tables_that_are_no_traffic(case: str, tmp_path: Path):
    change, problem = TABLES[case]
    with pytest.raises(DataError, match=problem):
        Recording("mine", change(traffic()), 0.1, Road.straight(), {})
    path = parquet(tmp_path / "own [1].parquet", change(traffic()))
    with pytest.raises(RecordingError, match=r"own \[1\]\.parquet: .*(?s:.)*" + problem):
        read([path])


@pytest.mark.parametrize(
    ("head", "problem"),
    [
        ({"dt": 0.0}, "mine: the time step is 0 s; expected 0.02 to 1 s"),
        ({"dt": -0.1}, "the time step is -0.1 s"),
        ({"dt": float("nan")}, "the time step is nan s"),
        ({"dt": 100.0}, "the time step is 100 s"),
        ({"dt": None}, "0 dt: Input should be a valid number"),
        ({"edges": []}, "expected two or more"),
        ({"edges": [0.0]}, "expected two or more"),
        ({"edges": [10.8, 7.2, 3.6, 0.0]}, "ascending from the right edge"),
        ({"edges": [0.0, 3.6, 3.6]}, "ascending from the right edge"),
        ({"edges": [0.0, float("inf")]}, "the lane edges are"),
        ({"edges": [0.0, 12.0, 24.0, 36.0]}, "lane 0 is 12 m wide.*are these feet"),
        ({"edges": [-5.4, -1.8, 1.8, 5.4]}, r"the right edge of the road is at lat = -5\.4 m; expected 0"),
        ({"edges": None}, "0 edges: Input should be a valid"),
        ({"length": 0.0}, "the road is 0 m long"),
        ({"length": 1e30}, r"the road is 1e\+30 m long"),
        ({"repairs": None}, "0 repairs: Input should be an object"),
        ({"name": 7}, "0 name: Input should be a valid string"),
    ],
)
def test_heads_that_are_no_road(head: dict[str, Any], problem: str, tmp_path: Path):
    with pytest.raises(RecordingError, match=problem):
        read([parquet(tmp_path / "own.parquet", traffic(), **head)])


WIDE = [0.0, 3.6, 7.2, 10.8]


@pytest.mark.parametrize(
    ("lon", "lat", "problem"),
    [
        (
            [0, 500],
            [WIDE, [float("nan"), *WIDE[1:]]],
            r"\[nan, 3\.6, 7\.2, 10\.8\] at lon = 500 m, number 1; .*coincide",
        ),
        ([0, float("inf")], [WIDE, WIDE], r"at lon = inf m, number 1; expected numbers"),
        ([500, 0], [WIDE, WIDE], "at lon = 500 m and then at 0 m; expected ascending positions: sort them"),
        ([0, 0], [WIDE, WIDE], "at lon = 0 m and then at 0 m; expected ascending positions"),
        ([0, 5e6], [WIDE, WIDE], r"are given at lon = 5e\+06 m; expected −200000 to 200000 m: check the unit"),
        ([0, 500], [WIDE, [0, 7.2, 3.6, 10.8]], r"lane 1 cross at lon = 500 m, the left one at 3\.6 m; .* 7\.2 m or"),
        (
            [0, 500],
            [[0, 12, 24, 36]] * 2,
            "lane 0, where it is there, is 12 m wide; expected 2 to 7.5 m; are these feet",
        ),
        ([0, 9, 500], [WIDE, WIDE, [0, 3.6, 7.2, 30]], r"lane 2 is 22\.8 m wide at lon = 500 m; expected up to 15 m"),
        (
            [0, 500],
            [[2.6, *WIDE[1:]]] * 2,
            "lane 0 is nowhere there, up to 1 m wide; expected 2 m or more.*leave it out",
        ),
        (
            [0, 500],
            [WIDE, WIDE[1:]],
            r"0 changing: .*expected a row .* got 2 rows of \[3, 4\] edges at 2 positions\); write the",
        ),
        ([0, 500], [WIDE[1:], WIDE[1:]], r"shape \(2,\) and lat of shape \(2, 3\); expected \(P,\) and \(P, 4\)"),
        ([0, 9, 500], [WIDE, WIDE], r"got 2 rows of \[4\] edges at 3 positions"),
        ([], [], r"got 0 rows of \[\] edges at 0 positions"),
    ],
)
def test_edges_that_no_road_has_along_it(lon: list[float], lat: list[list[float]], problem: str, tmp_path: Path):
    with pytest.raises(RecordingError, match=problem):
        read([parquet(tmp_path / "own.parquet", traffic(), changing={"lon": lon, "lat": lat})])


def test_lanes_that_begin_narrow_and_end_beyond_the_road_are_read(tmp_path: Path):
    changing = {"lon": [-50, 0, 300, 1500], "lat": [WIDE, WIDE, [2.0, *WIDE[1:]], [3.6, *WIDE[1:]]]}
    road = read([parquet(tmp_path / "own.parquet", traffic(), changing=changing)])[0].road
    assert road.has_lane(np.array([0.0, 300.0])).tolist() == [[True, True, True], [False, True, True]]


@pytest.mark.parametrize("text", ["", "[]", "{}", "[1]", "null", "{", '[{"name": "a"}]'])
def test_damaged_heads(text: str, tmp_path: Path):
    path = tmp_path / "own.parquet"
    traffic().with_columns(recording=pl.lit(0, dtype=pl.Int64)).write_parquet(path, metadata={"coverdrive": text})
    with pytest.raises(RecordingError, match=r"write the recordings anew"):
        read([path])


def test_rows_of_no_recording(tmp_path: Path):
    path = parquet(tmp_path / "own.parquet", traffic())
    metadata = pl.read_parquet_metadata(path)["coverdrive"]
    rows = pl.read_parquet(path).with_columns(recording=pl.when(at(2, 3.0)).then(1).otherwise(0).cast(pl.Int64))
    rows.write_parquet(path, metadata={"coverdrive": metadata})
    with pytest.raises(
        RecordingError, match="row 231, column recording: expected the number of one of 1 recordings, got 1"
    ):
        read([path])


@pytest.mark.parametrize("name", ["a[/b]c", "[red]", "tab\there", "ünïcödé", ""])
def test_any_name_is_a_name(name: str, tmp_path: Path):
    assert read([parquet(tmp_path / "own.parquet", traffic(), name=name)])[0].name == name


def test_other_time_steps_are_read(tmp_path: Path):
    path = parquet(tmp_path / "own.parquet", traffic(dt=0.04), dt=0.04)
    assert read([path])[0].dt == 0.1
    assert read([path], dt=0.04)[0].table.select(SCHEMA.names()).equals(traffic(dt=0.04))


def test_a_filtered_recording_may_lack_groups_between_others():
    table = traffic().with_columns(group=(pl.col("time") // 3).cast(pl.Int64))
    whole = Recording("mine", table, 0.1, Road.straight(), {})
    Recording("mine", whole.table.filter(pl.col("group") != 1), 0.1, whole.road, {})


def test_damaged_pages_of_parquet(tmp_path: Path):
    path = parquet(tmp_path / "own.parquet", traffic())
    content = path.read_bytes()
    for begin in (4, 100, len(content) // 2):
        path.write_bytes(content[:begin] + b"\xff" * 60 + content[begin + 60 :])
        with pytest.raises(RecordingError, match=r"own\.parquet"):
            read([path])


# NGSIM ---------------------------------------------------------------------------------------------------------------

NGSIM: dict[str, tuple[Callable[[pl.DataFrame], pl.DataFrame], str | dict[str, int]]] = {
    "width 0": (
        put("v_Width", 0.0, pl.col("Vehicle_ID") == 2),
        "row 102, column width: expected 0.4 to 4 m in most rows",
    ),
    "some widths -6": (
        put("v_Width", -6.0, (pl.col("Vehicle_ID") == 2) & (pl.col("Frame_ID") < 20)),
        {"odd widths": 10},
    ),
    "one length -17": (put("v_length", -17.0, row_of(2, 30)), {"odd lengths": 1}),
    "one length 1e9": (put("v_length", 1e9, row_of(2, 30)), {"odd lengths": 1}),
    "one Local_Y 1e9": (put("Local_Y", 1e9, row_of(2, 30)), {"lone outliers": 1, "interpolated rows": 1}),
    "all Local_Y * 1e9": (scaled("Local_Y", 1e9), "column local_y: the road is .* m long; expected up to 200000 m"),
    "all Local_X * 1e9": (scaled("Local_X", 1e9), "speeds that the file states|lane 0 is"),
    "a teleport": (
        shifted("Local_Y", 2000.0, (pl.col("Vehicle_ID") == 2) & (pl.col("Frame_ID") >= 60)),
        {"split tracks": 1},
    ),
    "one vehicle backwards": (
        lambda t: t.with_columns(
            pl.when(pl.col("Vehicle_ID") == 6)
            .then(2000 - pl.col("Local_Y"))
            .otherwise(pl.col("Local_Y"))
            .alias("Local_Y")
        ),
        {"implausible vehicles": 1},
    ),
    "microseconds": (
        lambda t: t.with_columns(pl.col("Global_Time") * 1000),
        r"\(Global_Time is in milliseconds\) is 100 s",
    ),
    "ids + 1e18": (
        lambda t: t.with_columns(pl.col("Vehicle_ID") + 10**18),
        r"row 2, column vehicle_id: expected a number below",
    ),
    "fractional ids": (
        lambda t: t.with_columns(pl.col("Vehicle_ID") / 7),
        r"row 2, column vehicle: expected a whole number",
    ),
    "negative ids": (
        lambda t: t.with_columns(-pl.col("Vehicle_ID")),
        r"row 2, column vehicle: expected a whole number",
    ),
    "lane 1e30": (put("Lane_ID", 1e30, row_of(2, 30)), r"row 122, column lane_id"),
    "a lane per row": (lambda t: t.with_columns(Lane_ID=pl.int_range(pl.len())), "the lanes cannot be told"),
    "huge Local_X without lanes": (
        lambda t: t.drop("Lane_ID").with_columns(pl.col("Local_X") * 1e6),
        "the lanes cannot be told",
    ),
    "widths in metres": (scaled("v_Width", FOOT), "column width: the median width of the vehicles is 0.557 m"),
    "1.1 s between rows": (
        lambda t: t.with_columns(Global_Time=1_118_846_980_200 + 1100 * pl.col("Frame_ID")),
        r"is 1\.1 s; expected 0\.02 to 1 s \(50 to 1 Hz\): at 0\.909 Hz .* take a recording of 1 Hz or more",
    ),
    "speeds in mph": (scaled("v_Vel", 0.6818), r"speeds that the file states is 1\.47; expected 1"),
}


@pytest.mark.parametrize("case", NGSIM)
def test_ngsim_tables(case: str, make_ngsim, write_csv):
    change, outcome = NGSIM[case]
    path = write_csv(change(make_ngsim()))
    if isinstance(outcome, str):
        with pytest.raises(RecordingError, match=r"traffic\.csv.*" + outcome):
            read([path])
    else:
        (recording,) = read([path])
        assert recording.repairs == outcome
        clean = make_ngsim()["Local_Y"].max() * FOOT
        assert recording.road.length < clean + 2000 * FOOT + 1
        assert recording.table["length"].is_between(4, 5).all() and recording.table["width"].is_between(1.8, 1.9).all()


def lines(change: Callable[[list[bytes]], list[bytes]]) -> Callable[[bytes], bytes]:
    return lambda content: b"\n".join(change(content.split(b"\n")))


def quoted(content: bytes) -> bytes:
    return content.replace(b"us-101", b'"us-101, CA"')


TEXTS: dict[str, tuple[Callable[[bytes], bytes], str | dict[str, int]]] = {
    "latin-1": (lambda text: text.replace(b"us-101", "Straße".encode("latin-1")), {}),
    "a blank line after the header": (lines(lambda found: [found[0], b"", *found[1:]]), {"blank lines": 1}),
    "blank lines": (lines(lambda found: [*found[:50], b"  ", b"\r", *found[50:]]), {"blank lines": 2}),
    "the header twice": (
        lambda text: text.replace(b"Total_Frames", b"Vehicle_ID"),
        "row 1, column vehicle_id: .*twice",
    ),
    "another name twice": (lambda text: text.replace(b"O_Zone,D_Zone", b"Zone,Zone"), {}),
    "quoted cells": (quoted, {}),
    "a short row among quoted cells": (
        lines(lambda found: [*map(quoted, found[:7]), b"1,2", *map(quoted, found[8:])]),
        "row 8: the line has 2 columns, expected 25",
    ),
    "an open quote": (
        lines(lambda found: [*found[:7], b'"' + found[7], *found[8:]]),
        "row 8: a quoted cell has no end",
    ),
    "a short row": (lines(lambda found: [*found[:7], b"1,2", *found[8:]]), "row 8: the line has 2 columns"),
    "zeros": (lambda text: text + b"\0" * 500, {"truncated rows": 1}),
    "a byte order mark": (lambda text: b"\xef\xbb\xbf" + text, {}),
    "UTF-16": (lambda text: text.decode().encode("utf-16"), r"traffic\.csv"),
    "a JSON text": (lambda text: b'{"a": 1, "b": 2}\n', "unknown columns"),
}


@pytest.mark.parametrize("case", TEXTS)
def test_texts(case: str, make_ngsim, write_csv):
    change, outcome = TEXTS[case]
    path = write_csv(make_ngsim())
    path.write_bytes(change(path.read_bytes()))
    if isinstance(outcome, str):
        with pytest.raises(RecordingError, match=outcome):
            read([path])
    else:
        (recording,) = read([path])
        assert recording.repairs == outcome
        assert len(recording.table) == 588


def test_many_jumps_are_another_unit(make_ngsim, write_csv):
    every_third = shifted("Local_Y", 900.0, pl.col("Frame_ID") % 3 == 0)
    with pytest.raises(RecordingError):
        read([write_csv(every_third(make_ngsim()))])


# Metric tracks -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("table", "problem"),
    [
        (metric(v_vel_mps=pl.col("v_vel_mps") * 3.6), r"speeds that the file states is 0\.278"),
        (metric(local_y_m=pl.col("local_y_m") * 1e9), "expected up to 200000 m"),
        (metric(Vehicle_ID=pl.lit("a")), "column Vehicle_ID: expected numbers, got String"),
        (metric(Vehicle_ID=pl.col("Vehicle_ID") + 10**18), "row 1, column Vehicle_ID: expected a number"),
        (metric(Vehicle_ID=pl.col("Vehicle_ID") / 3), "row 1, column vehicle: expected a whole number"),
        (metric(Global_Time=pl.col("Global_Time") * 1000), "is 100 s; expected 0.02 to 1 s"),
        (metric(local_x_m=pl.lit(None)), "column local_x_m: expected numbers, got Null"),
        (metric(local_x_m=pl.col("local_x_m") * 1e9), "the lanes cannot be told"),
        (metric().drop("Frame_ID"), "no column Frame_ID"),
    ],
)
def test_metric_tables(table: pl.DataFrame, problem: str, tmp_path: Path):
    table.write_parquet(tmp_path / "tracks.parquet")
    with pytest.raises(RecordingError, match=r"tracks\.parquet.*" + problem):
        read([tmp_path / "tracks.parquet"])


# CommonRoad ----------------------------------------------------------------------------------------------------------

DRIVEN = scenario(three_lanes(), driving(100, 20.0, -1.75, 20.0, 40) + driving(101, 60.0, -9.0, 10.0, 30))
BOMB = (
    '<!DOCTYPE commonRoad [<!ENTITY a "aaaaaaaaaa">'
    + "".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True))
    + "]>"
)
SCENARIOS: dict[str, tuple[str, str]] = {
    "dt -0.1": (DRIVEN.replace('Size="0.1"', 'Size="-0.1"'), r"timeStepSize is -0\.1 s; expected 0\.02 to 1 s"),
    "dt 0": (DRIVEN.replace('Size="0.1"', 'Size="0"'), "timeStepSize is 0 s"),
    "dt NaN": (DRIVEN.replace('Size="0.1"', 'Size="NaN"'), "timeStepSize is nan s"),
    "dt 1e9": (DRIVEN.replace('Size="0.1"', 'Size="1e9"'), r"timeStepSize is 1e\+09 s"),
    "dt 1e-5": (DRIVEN.replace('Size="0.1"', 'Size="1e-5"'), "timeStepSize is 1e-05 s"),
    "dt 0.04": (DRIVEN.replace('Size="0.1"', 'Size="0.04"'), r"states is 2\.5; expected 1.*time step of 0\.04 s"),
    "dt 1": (DRIVEN.replace('Size="0.1"', 'Size="1"'), r"states is 0\.1; expected 1.*time step of 1 s"),
    "bent by 700 degrees": (
        bent(700),
        r"a curve of 1\d m radius, \d+ m after.*at least 20 m, choose or cut",
    ),
    "an entity bomb": (DRIVEN.replace("<commonRoad", BOMB + "<commonRoad", 1), "row 1: it declares a document type"),
    "coordinates * 1e9": (DRIVEN.replace("</x>", "e9</x>").replace("</y>", "e9</y>"), "expected|check the coordinates"),
    "one position 1e30": (DRIVEN.replace("<x>", "<x>1e30", 400).replace("<x>1e30", "<x>", 399), "expected|check"),
    "a lanelet beside itself": (DRIVEN.replace('adjacentLeft ref="10"', 'adjacentLeft ref="20"'), "lies beside itself"),
    "a lanelet that is not there": (
        DRIVEN.replace('adjacentRight ref="20"', 'adjacentRight ref="77"'),
        "lanelet 10 refers to 77, which is not in the file",
    ),
    "a lanelet that is no number": (
        DRIVEN.replace('adjacentRight ref="20"', 'adjacentRight ref="x"').replace("><", ">\n<"),
        r"row 11: commonroad-io cannot read the lanelet 10 \(ValueError.*\); check the file",
    ),
    "a type that is none": (
        DRIVEN.replace("<dynamicObstacle", "\n<dynamicObstacle").replace("<type>car", "<type>hovercraft"),
        "row 2: commonroad-io cannot read the dynamicObstacle 100 .*hovercraft",
    ),
    "a time that is none": (
        DRIVEN.replace("<dynamicObstacle", "\n<dynamicObstacle").replace("<exact>35</exact>", "<exact>late</exact>"),
        "row 2: commonroad-io cannot read time of the dynamicObstacle 100 .*'late'",
    ),
    "a number twice": (
        DRIVEN.replace("<dynamicObstacle", "\n<dynamicObstacle").replace('id="101"', 'id="100"'),
        "row 3: .*ID 100 is already used",
    ),
    "a place that is none": (DRIVEN.replace("Latitude>0", "Latitude>north"), "cannot read its element location"),
    "no time step": (DRIVEN.replace('timeStepSize="0.1"', ""), "commonroad-io cannot read it .*check the file"),
    "numbers beyond 2⁵³": (
        DRIVEN.replace('id="101"', f'id="{2**53 + 1}"'),
        "obstacle 9007199254740993 has no number below 2⁵³, as they are told apart",
    ),
    "numbers beyond int64": (DRIVEN.replace('id="101"', f'id="{2**64}"'), "obstacle 18446744073709551616 has no"),
    "a width of 0": (
        DRIVEN.replace("<width>1.9</width>", "<width>0</width>"),
        "the median width of the vehicles is 0 m; expected 1 to 3 m",
    ),
    "a length of 1e9": (DRIVEN.replace("<length>4.6</length>", "<length>1e9</length>"), "expected numbers below"),
    "cut": (DRIVEN[:-40], r"row 1: not a CommonRoad file: it is cut or damaged"),
}


@pytest.mark.parametrize("case", SCENARIOS)
def test_scenarios(case: str, tmp_path: Path):
    content, problem = SCENARIOS[case]
    path = tmp_path / "scene.xml"
    path.write_text(content)
    with pytest.raises(RecordingError, match=r"scene\.xml.*(?s:.)*" + problem):
        read([path])


def test_straight_scenarios_are_read(tmp_path: Path):
    (tmp_path / "scene.xml").write_text(straight())
    assert read([tmp_path / "scene.xml"])[0].repairs == {}


# Files ---------------------------------------------------------------------------------------------------------------


def test_data_sets_that_are_not_read_are_told(tmp_path: Path):
    (tmp_path / "tracks.csv").write_text("frameNum,carId,carCenterX,carCenterY,headX,boundingBox1X\n1,2,3\n")
    with pytest.raises(RecordingError, match=r"CitySim.*not read.*described at https://.*own Parquet"):
        read([tmp_path])


@pytest.mark.parametrize("name", ["a[1]*?.{}", "[red]x[", "**", "~", "-", "line\nbreak", "x" * 240])
def test_names_of_files_are_literal(name: str, make_ngsim, tmp_path: Path):
    folder = tmp_path / name
    folder.mkdir()
    make_ngsim(vehicles=3).write_csv(folder / "[x].csv")
    metric().write_parquet(folder / "[y]*.parquet")
    parquet(folder / "[z]?.parquet", traffic())
    (folder / "[s].xml").write_text(straight())
    assert [recording.name for recording in read([folder])] == ["[s]", "[x]", "[y]*", "mine"]


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".xml"])
def test_names_of_files_need_not_be_utf8(suffix: str, make_ngsim, tmp_path: Path):
    path = tmp_path / os.fsdecode(b"caf\xe9" + suffix.encode())
    if suffix == ".csv":
        make_ngsim().write_csv(path.with_name("a.csv"))
        path.with_name("a.csv").rename(path)
    elif suffix == ".xml":
        path.write_text(straight())
    else:
        parquet(tmp_path / "a.parquet", traffic()).rename(path)
    assert len(read([path])[0].name.encode()) > 3
    path.write_text("<nonsense")
    with pytest.raises(RecordingError, match="caf\\?") as caught:
        read([path])
    assert str(caught.value).encode()


@pytest.mark.parametrize("path", ["a\0b.csv", "x" * 300 + ".csv", "/dev/null", "nowhere/[x].csv"])
def test_paths_that_cannot_be(path: str):
    with pytest.raises(RecordingError, match=r"check the path|no such file"):
        read([Path(path)])


@pytest.mark.parametrize("name", ["a.csv", "a.txt", "a.parquet", "a.xml", "a.json"])
def test_files_that_cannot_be_read(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / name).write_text("a,b\n1,2\n")

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    monkeypatch.setattr(Path, "read_bytes", refuse)
    with pytest.raises(RecordingError, match=rf"{name}: the file cannot be read \(Permission denied\)"):
        read([tmp_path / name])


def test_a_folder_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def refuse(_: Path) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", refuse)
    with pytest.raises(RecordingError, match=r"cannot be looked into .*Permission denied"):
        read([tmp_path])
