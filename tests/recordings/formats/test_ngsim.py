"""NGSIM files: units, frames of reference, several sites, and everything that can be wrong with them."""

import gzip
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from coverdrive.errors import RecordingError
from coverdrive.recordings.files.kinds import KINDS
from coverdrive.recordings.formats.ngsim import read_ngsim
from coverdrive.recordings.formats.reader import How
from coverdrive.recordings.read import read


def read_one(path: Path, location: str | None = None):
    (reading,) = read_ngsim(path, How(location))
    return reading.recording


def test_csv_in_feet_becomes_centres_in_metres(make_ngsim, write_csv):
    recording = read_one(write_csv(make_ngsim(vehicles=6, speed=15.0)))
    table = recording.table
    assert recording.dt == pytest.approx(0.1)
    assert recording.repairs == {}
    assert recording.road.edges == pytest.approx(np.arange(4) * 3.6576, abs=1e-6)
    first = table.filter(pl.col("vehicle") == 1)
    assert first["time"].to_numpy() == pytest.approx(np.arange(2, 100) / 10)
    assert first["lon"].to_numpy() == pytest.approx(50 + 1.5 * np.arange(2, 100) - 15 * 0.3048 / 2, abs=1e-3)
    assert first["lat"].to_numpy() == pytest.approx(2.5 * 3.6576, abs=1e-6)  # lane 1 is the leftmost
    assert first["speed"].to_numpy() == pytest.approx(15.0, abs=1e-2)
    assert first["heading"].to_numpy() == pytest.approx(0.0, abs=1e-6)
    assert first["length"][0] == pytest.approx(4.572)
    assert first["width"][0] == pytest.approx(1.8288)


def test_a_lane_without_vehicles_is_there(make_ngsim, write_csv):
    table = make_ngsim().filter(pl.col("Lane_ID") != 2)
    assert read_one(write_csv(table)).road.edges == pytest.approx(np.arange(4) * 3.6576, abs=1e-6)


@pytest.mark.parametrize("lanes", [2, 3])
def test_a_mirrored_road_is_refused_by_its_lane_numbers(make_ngsim, write_csv, lanes: int):
    table = make_ngsim().filter(pl.col("Lane_ID") <= lanes).with_columns(Local_X=36.0 - pl.col("Local_X"))
    with pytest.raises(RecordingError, match=r"column local_x: .*positions are mirrored, turn Local_X round"):
        read_one(write_csv(table))
    assert read_one(write_csv(table.drop("Lane_ID"))).road.lanes == 3
    assert read_one(write_csv(table.filter(pl.col("Lane_ID") == 1))).road.lanes == 1


def test_text_without_header_is_read_like_the_csv(make_ngsim, write_csv, write_text):
    table = make_ngsim()
    csv, text = read_one(write_csv(table)), read_one(write_text(table))
    assert csv.table.equals(text.table)
    assert np.array_equal(csv.road.edges, text.road.edges)


def test_a_byte_order_mark_is_no_column(make_ngsim, write_text):
    path = write_text(make_ngsim())
    expected, text = read_one(path).table, path.read_bytes()
    for first in (b"", b"  "):
        path.write_bytes(b"\xef\xbb\xbf" + first + text.lstrip())
        assert read_one(path).table.equals(expected)


def test_headers_are_matched_in_any_case(make_ngsim, write_csv):
    table = make_ngsim()
    shouted = write_csv(table.rename(str.upper), "shouted/traffic.csv")
    assert read_one(shouted).table.equals(read_one(write_csv(table)).table)


def test_windows_line_ends_and_blanks_around_numbers(make_ngsim, write_csv):
    table = make_ngsim()
    path = write_csv(table)
    expected = read_one(path).table
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert read_one(path).table.equals(expected)
    path.write_bytes(path.read_bytes().replace(b",", b" , "))
    assert read_one(path).table.equals(expected)


def test_a_site_is_chosen_in_any_case(make_ngsim, write_csv):
    sites = pl.concat([make_ngsim(location="us-101"), make_ngsim(vehicles=3, speed=20.0, location="i-80")])
    path = write_csv(sites)
    chosen = read_one(path, "I-80")
    assert chosen.table["vehicle"].n_unique() == 3
    assert chosen.table["speed"].to_numpy() == pytest.approx(20.0, abs=1e-2)
    with pytest.raises(RecordingError, match=r"several locations.*i-80 \(300 rows\), us-101 \(600 rows\)"):
        read_ngsim(path)
    with pytest.raises(RecordingError, match=r"no rows of the location 'lankershim'.*i-80.*us-101"):
        read_ngsim(path, How("lankershim"))


def test_a_site_cannot_be_chosen_without_its_column(make_ngsim, write_csv):
    path = write_csv(make_ngsim().drop("Location"))
    assert len(read_one(path).table) == 588
    with pytest.raises(RecordingError, match="no column Location"):
        read_ngsim(path, How("us-101"))


def test_the_original_text_holds_one_site(make_ngsim, write_text):
    assert len(read_one(write_text(make_ngsim()), "us-101").table) == 588


def test_periods_with_the_same_numbers_are_different_vehicles(make_ngsim, write_csv):
    first = make_ngsim(vehicles=3)
    later = make_ngsim(vehicles=3, speed=10.0, start=1_118_847_880_200)
    path = write_csv(pl.concat([first, later]))
    one, two = read([path])
    assert [one.name, two.name] == ["traffic period 1", "traffic period 2"]
    assert one.table["speed"].mean() == pytest.approx(15.0, abs=1e-2)
    assert two.table["speed"].mean() == pytest.approx(10.0, abs=1e-2)
    assert two.table["time"].min() == pytest.approx(900.2)
    assert one.repairs == two.repairs == {}
    assert set(one.table["group"]).isdisjoint(two.table["group"])


def test_a_pause_ends_a_period_where_frames_count_on(make_ngsim, write_csv):
    first = make_ngsim(vehicles=3)
    later = make_ngsim(vehicles=3, start=1_118_847_880_200, first_frame=9010)
    assert len(read_ngsim(write_csv(pl.concat([first, later])))) == 2


def test_road_without_lane_numbers_has_lanes_of_12_ft(make_ngsim, write_csv):
    road = read_one(write_csv(make_ngsim().drop("Lane_ID"))).road
    assert road.edges == pytest.approx(np.arange(4) * 3.6576)


def test_motorcycles_are_kept(make_ngsim, write_csv):
    table = make_ngsim().with_columns(
        v_Class=pl.when(pl.col("Vehicle_ID") == 2).then(1).otherwise(2),
        v_length=pl.when(pl.col("Vehicle_ID") == 2).then(6.5).otherwise(15.0),
    )
    assert 2 in read_one(write_csv(table)).table["vehicle"]


@pytest.mark.parametrize("name", ["Vehicle_ID", "Global_Time", "Local_X", "v_length"])
def test_missing_columns_are_named(make_ngsim, write_csv, name: str):
    with pytest.raises(RecordingError, match=f"no column {name.lower()}"):
        read_ngsim(write_csv(make_ngsim().drop(name)))


def test_metres_are_refused(make_ngsim, write_csv):
    metres = make_ngsim().with_columns(pl.col("v_length", "Local_X", "Local_Y", "v_Vel", "v_Width") * 0.3048)
    with pytest.raises(RecordingError, match=r"median length of the vehicles is 1.39 m; expected 2.5 to 20 m: check"):
        read_ngsim(write_csv(metres))


def test_positions_and_speeds_of_different_units_are_refused(make_ngsim, write_csv):
    mixed = make_ngsim().with_columns(pl.col("Local_Y") * 0.3048)
    with pytest.raises(RecordingError, match=r"speeds that the file states is 0\.305"):
        read_ngsim(write_csv(mixed))


def test_times_in_another_unit_are_refused(make_ngsim, write_csv):
    seconds = make_ngsim().with_columns(pl.col("Global_Time") // 10)
    problem = r"two rows of a vehicle \(Global_Time is in milliseconds\) is 0\.01 s; expected 0\.02 to 1 s"
    with pytest.raises(RecordingError, match=problem):
        read_ngsim(write_csv(seconds.with_columns(pl.col("v_Vel") * 10)))


def test_times_between_those_of_the_frame_rate_are_refused(make_ngsim, write_csv):
    """They were taken for the nearest of these, and speeds for other ones."""
    late = 40 * (pl.col("Vehicle_ID") == 2).cast(pl.Int64)
    with pytest.raises(RecordingError, match=r"the times of the rows are not multiples of 0\.1 s apart"):
        read_ngsim(write_csv(make_ngsim().with_columns(pl.col("Global_Time") + late)))


@pytest.mark.parametrize(
    ("cell", "found"), [("n/a", "'n/a'"), ("", "an empty cell"), ("NaN", "'NaN'"), ("inf", "'inf'")]
)
def test_cells_that_are_no_numbers_are_named(make_ngsim, write_csv, cell: str, found: str):
    broken = make_ngsim().with_columns(pl.col("Local_Y").cast(pl.String))
    broken[41, "Local_Y"] = cell
    with pytest.raises(RecordingError, match=rf"traffic\.csv, row 43, column local_y: expected a number, got {found}"):
        read_ngsim(write_csv(broken))


def test_text_cells_that_are_no_numbers_are_named(make_ngsim, write_text):
    path = write_text(make_ngsim())
    lines = path.read_text().splitlines()
    lines[9] = lines[9].replace("49.21", "4x.21")
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(RecordingError, match=r"traffic\.txt, row 10, column v_vel: expected a number, got '4x.21'"):
        read_ngsim(path)


def test_a_line_with_too_many_columns_is_named(make_ngsim, write_csv):
    path = write_csv(make_ngsim())
    lines = path.read_text().splitlines()
    lines[5] += ",1"
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(RecordingError, match=r"row 6: the line has 26 columns, expected 25"):
        read_ngsim(path)


def test_a_cut_last_line_is_left_out_and_counted(make_ngsim, write_csv):
    path = write_csv(make_ngsim())
    path.write_bytes(path.read_bytes()[:-60])
    recording = read_one(path)
    assert recording.repairs == {"truncated rows": 1}
    assert len(recording.table) == 587


def test_a_whole_last_line_needs_no_line_end(make_ngsim, write_csv):
    path = write_csv(make_ngsim())
    path.write_bytes(path.read_bytes().rstrip(b"\n"))
    recording = read_one(path)
    assert recording.repairs == {}
    assert len(recording.table) == 588


def test_duplicated_rows_are_dropped_and_counted(make_ngsim, write_csv):
    table = make_ngsim()
    conflicting = table[110:113].with_columns(pl.col("Local_Y") + 5.0)
    recording = read_one(write_csv(pl.concat([table, table[:20], conflicting])))
    assert recording.repairs == {"duplicated rows": 23, "conflicting rows": 3}
    assert recording.table.equals(read_one(write_csv(table, "clean/traffic.csv")).table)


def test_rows_in_any_order_are_sorted(make_ngsim, write_csv):
    table = make_ngsim()
    recording = read_one(write_csv(table.reverse()))
    assert recording.repairs == {"rows out of order": 6 * 99}
    assert recording.table.equals(read_one(write_csv(table, "clean/traffic.csv")).table)


def test_rows_sorted_by_time_are_read_like_those_sorted_by_vehicle(make_ngsim, write_csv):
    table = make_ngsim()
    recording = read_one(
        write_csv(table.sort("Global_Time", "Vehicle_ID", descending=[False, True]), "later/traffic.csv")
    )
    assert recording.repairs == {}
    assert recording.table.equals(read_one(write_csv(table)).table)


def test_short_gaps_are_interpolated(make_ngsim, write_csv):
    table = make_ngsim()
    recording = read_one(write_csv(pl.concat([table[:30], table[39:]])))
    assert recording.repairs == {"interpolated rows": 9}
    clean = read_one(write_csv(table, "clean.csv")).table
    assert recording.table["lon"].to_numpy() == pytest.approx(clean["lon"].to_numpy(), abs=1e-3)


def test_long_gaps_split_a_track(make_ngsim, write_csv):
    table = make_ngsim()
    recording = read_one(write_csv(pl.concat([table[:30], table[40:]])))
    assert recording.repairs == {"split tracks": 1}
    assert recording.table["vehicle"].unique().sort().to_list() == [1, 2, 3, 4, 5, 6, 7]
    part = recording.table.filter(pl.col("vehicle") == 7)
    assert part["time"].to_numpy() == pytest.approx(np.arange(42, 100) / 10)


def test_vehicles_on_ramps_are_left_out(make_ngsim, write_csv):
    ramp = make_ngsim(vehicles=1).with_columns(
        Vehicle_ID=pl.lit(99, pl.Int64), Lane_ID=pl.lit(7, pl.Int64), Local_X=50.0
    )[:8]
    recording = read_one(write_csv(pl.concat([make_ngsim(), ramp])))
    assert recording.repairs == {"rows off the road": 8}
    assert recording.road.lanes == 3


def test_traffic_in_both_directions_is_refused(make_ngsim, write_csv):
    away = make_ngsim(vehicles=3)
    back = make_ngsim(vehicles=3).with_columns(
        Vehicle_ID=pl.col("Vehicle_ID") + 10, Local_Y=2000 - pl.col("Local_Y"), v_Vel=pl.col("v_Vel")
    )
    with pytest.raises(RecordingError, match=r"against the direction of the road"):
        read_ngsim(write_csv(pl.concat([away, away.with_columns(pl.col("Vehicle_ID") + 20), back])))


@pytest.mark.parametrize(
    ("spoilt", "problem"),
    [
        (lambda text: text.encode("utf-16"), "text in UTF-16; save it as UTF-8"),
        (lambda text: gzip.compress(text.encode()), "packed by gzip; unpack it"),
        (lambda text: b"PK\x03\x04" + text.encode(), "a ZIP archive or a workbook"),
        (lambda text: text.replace("\n", "\r").encode(), "end in carriage returns alone"),
    ],
)
def test_files_that_are_no_usual_text_are_named(spoilt, problem: str, tmp_path: Path):
    path = tmp_path / "ngsim.csv"
    path.write_bytes(spoilt("Vehicle_ID,Frame_ID,Global_Time,Local_X,Local_Y\n" + "1,2,3,4,5\n" * 9))
    with pytest.raises(RecordingError, match=problem):
        read([path])


def test_semicolons_are_named(tmp_path: Path):
    path = tmp_path / "a.csv"
    path.write_text("a;b\n1,5;2\n")
    with pytest.raises(RecordingError, match="apart by semicolons; write it with commas"):
        read([path])


def test_a_blank_first_line_is_named(tmp_path: Path):
    path = tmp_path / "a.csv"
    path.write_text("\na,b\n1,2\n")
    with pytest.raises(RecordingError, match="the first line is blank"):
        read([path])


@pytest.mark.parametrize("content", ["", "\n", "   \n"])
def test_empty_files_are_refused(tmp_path: Path, content: str):
    path = tmp_path / "empty.csv"
    path.write_text(content)
    with pytest.raises(RecordingError, match="the file is empty"):
        read_ngsim(path)


def test_a_header_alone_is_refused(make_ngsim, write_csv):
    with pytest.raises(RecordingError, match="no rows of data"):
        read_ngsim(write_csv(make_ngsim()[:0]))


def test_a_file_of_something_else_is_refused(tmp_path: Path):
    path = tmp_path / "notes.txt"
    path.write_text("nothing to see here\n")
    with pytest.raises(RecordingError, match=r"row 1: the first line has 4 columns and no comma"):
        read_ngsim(path)


def test_single_rows_have_no_speed(make_ngsim, write_csv):
    single = make_ngsim(vehicles=1).with_columns(Vehicle_ID=pl.lit(99, pl.Int64))[50:51]
    recording = read_one(write_csv(pl.concat([make_ngsim(), single])))
    assert recording.repairs == {"dropped tracks": 1}
    assert 99 not in recording.table["vehicle"]


@pytest.mark.real_data
@pytest.mark.parametrize(
    ("name", "rows", "vehicles", "ramp"),
    [("us101_around_vehicle_320.csv", 11_422, 27, 2), ("us101_around_vehicle_888.txt", 6_577, 15, 110)],
)
def test_recorded_traffic(us101: Path, name: str, rows: int, vehicles: int, ramp: int):
    recording = read_one(us101 / "ngsim" / name)
    table = recording.table
    assert (len(table), table["vehicle"].n_unique()) == (rows - ramp - 2 * vehicles, vehicles)
    assert recording.repairs == {"rows off the road": ramp}
    assert recording.road.lanes == 5
    assert np.diff(recording.road.edges) == pytest.approx(3.5, abs=0.3)
    lat = table["lat"].to_numpy()
    centre = recording.road.centres[recording.road.lane_of(lat)]
    assert np.median(np.abs(lat - centre)) < 0.5
    assert abs(np.median(table["heading"].to_numpy())) < 0.005
    assert table["speed"].max() < 30


def test_classes_are_kept(make_ngsim, write_csv):
    table = make_ngsim().with_columns(v_Class=pl.col("Vehicle_ID").replace({4: 1, 5: 3, 6: 9}).clip(1, 9))
    table = table.with_columns(v_Class=pl.when(pl.col("Vehicle_ID") <= 3).then(2).otherwise("v_Class"))
    (recording,) = read([write_csv(table)])
    found = dict(recording.table.select("vehicle", "kind").unique().iter_rows())
    names = {vehicle: KINDS[kind] for vehicle, kind in found.items()}
    assert names == {1: "car", 2: "car", 3: "car", 4: "motorcycle", 5: "truck", 6: "unknown"}
