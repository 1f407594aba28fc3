"""CommonRoad scenarios: drawn ones of known content, and the recorded ones of US-101."""

import warnings
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from published_commonroad import write_commonroad
from published_formats import EDGES, Truth, found_again, truth
from recordings_fakes import bent, driving, scenario, three_lanes

from coverdrive.errors import RecordingError
from coverdrive.prediction.data.segments import SegmentSettings, cut_segments
from coverdrive.recordings.files.kinds import KINDS
from coverdrive.recordings.formats.commonroad import read_commonroad
from coverdrive.recordings.read import read


@pytest.fixture
def bend(tmp_path: Path) -> Path:
    path = tmp_path / "bend.xml"
    vehicles = driving(100, 20.0, -1.75, 20.0, 40) + driving(101, 60.0, -9.0, 10.0, 30)
    path.write_text(
        scenario(three_lanes(), vehicles + driving(102, 150.0, -15.0, 10.0, 20) + driving(103, 5, -5, 9, 1))
    )
    return path


def test_a_bend_becomes_a_straight_road(bend: Path):
    recording = read_commonroad(bend)[0].recording
    assert recording.name == "bend"
    assert recording.dt == pytest.approx(0.1)
    assert recording.road.edges == pytest.approx([0, 4.0, 7.5, 11.0], abs=0.05)
    assert recording.road.length == pytest.approx(180.0, abs=0.1)
    first = recording.table.filter(pl.col("vehicle") == 100)
    assert first["lon"].to_numpy() == pytest.approx(20 + 2.0 * np.arange(2, 40), abs=0.15)
    assert first["lat"].to_numpy() == pytest.approx(11 - 1.75, abs=0.05)
    # On the outer side of the left edge 1.75 m are 0.1 % longer.
    assert first["speed"].to_numpy() == pytest.approx(20.0, abs=0.05)
    assert first["heading"].to_numpy() == pytest.approx(0.0, abs=0.005)
    assert (first["length"][0], first["width"][0]) == (4.6, 1.9)
    second = recording.table.filter(pl.col("vehicle") == 101)
    assert second["lat"].to_numpy() == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("degrees", [30.0, 113.0, 190.0])
def test_bends_stay_bends(tmp_path: Path, degrees: float):
    path = tmp_path / "bent.xml"
    path.write_text(bent(degrees))
    recording = read_commonroad(path)[0].recording
    table, radius = recording.table, 200 / np.radians(degrees)
    assert np.degrees(recording.road.line.bend) == pytest.approx(degrees, rel=0.02)
    middle = table.filter(pl.col("lon").is_between(15, 185))
    assert recording.road.curvature(middle["lon"].to_numpy()) == pytest.approx(1 / radius, rel=0.05)
    assert table["speed"].to_numpy() == pytest.approx(20.0, rel=0.01)  # on the ground, outside of the line
    assert middle["heading"].to_numpy() == pytest.approx(0.0, abs=0.01)
    assert table["lat"].to_numpy() == pytest.approx(1.75, abs=0.3)
    assert np.abs(cut_segments([recording], SegmentSettings(horizon=1.0)).points[..., 0]).max() < 0.3  # rates of lon


def test_ramps_and_single_states_are_left_out_and_counted(bend: Path):
    recording = read_commonroad(bend)[0].recording
    assert recording.repairs == {"rows off the road": 20, "dropped tracks": 1}
    assert set(recording.table["vehicle"]) == {100, 101}


def test_kinds_are_kept_and_who_is_no_traffic_of_motorways_is_counted(tmp_path: Path):
    kinds = {100: "truck", 101: "motorcycle", 102: "taxi", 103: "bicycle", 104: "priorityVehicle"}
    vehicles = "".join(
        driving(number, 10.0 + 25 * k, -1.75, 10.0, 20).replace("<type>car", f"<type>{kind}")
        for k, (number, kind) in enumerate(kinds.items())
    )
    path = tmp_path / "mixed.xml"
    path.write_text(scenario(three_lanes(), vehicles))
    recording = read_commonroad(path)[0].recording
    found = dict(recording.table.select("vehicle", "kind").unique().iter_rows())
    assert {number: KINDS[kind] for number, kind in found.items()} == {
        100: "truck", 101: "motorcycle", 102: "car", 104: "unknown",
    }  # fmt: skip
    assert recording.repairs == {"rows of other road users": 20}


def test_both_carriageways_of_one_file_are_recordings(tmp_path: Path):
    real = truth(0.1, seconds=5.0)
    recordings = [reading.recording for reading in read_commonroad(write_commonroad(tmp_path, real))]
    name = "DEU_Generated-1_1_T-1"
    assert {each.name for each in recordings} == {name, f"{name} carriageway 2"} and recordings[0].name == name
    for table in real.tables:
        (recording,) = (each for each in recordings if each.table["vehicle"].min() == 1000 + table["vehicle"].min())
        assert recording.repairs == {} and recording.road.edges == pytest.approx(EDGES, abs=0.01)
        assert found_again(recording, table, shift=-0.0, first=1000)["lat"] < 0.05
    assert {group for each in read([tmp_path]) for group in each.table["group"]} == {0}


def test_too_little_for_a_carriageway_of_its_own_is_counted(tmp_path: Path):
    east, west = truth(0.1, seconds=5.0).tables
    blink = west.filter(pl.col("vehicle") == west["vehicle"][0], pl.col("frame") < 3)
    (reading,) = read_commonroad(write_commonroad(tmp_path, Truth((east, blink), 0.1)))
    assert reading.recording.repairs == {"rows off the road": 2}


def test_protobuf_is_said_to_be(tmp_path: Path):
    path = tmp_path / "a.pb"
    path.write_bytes(b"\n\x0e\n\x052020a")
    with pytest.raises(RecordingError, match=r"protobuf \(.pb\) are not read; write them as XML"):
        read_commonroad(path)


def test_stated_speeds_are_kept_to_find_the_same_vehicles(bend: Path):
    raw = read_commonroad(bend)[0].raw
    assert set(raw.speed[raw.vehicle == 100]) == {20.0}


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ("", "not a CommonRoad file: it is no XML"),
        ("lon,lat\n1,2\n", "not a CommonRoad file: it is no XML"),
        ("<html></html>", "expected the root element commonRoad, got html"),
        (scenario("", ""), "no lanes"),
        (scenario(three_lanes(), ""), "no recorded vehicles"),
        (scenario(three_lanes(), driving(100, 20.0, -1.75, 20.0, 5))[:-200], "row 1: not a CommonRoad.*cut or damaged"),
        (scenario(three_lanes(), "<dynamicObstacle/>"), "commonroad-io cannot read it"),
        (scenario(three_lanes(), driving(100, 20.0, -1.75, 20.0, 2)), "interactive scenario, or one of single states"),
        (
            scenario(three_lanes(), driving(100, 20.0, -1.75, 20.0, 5)).replace(
                "<rectangle><length>4.6</length><width>1.9</width></rectangle>", "<circle><radius>1</radius></circle>"
            ),
            "obstacle 100 has the shape Circle.*; expected a rectangle",
        ),
        *(
            (
                scenario(three_lanes(), driving(100, 20.0, -1.75, 20.0, 5)).replace(
                    "</width></rectangle>", f"</width>{shift}</rectangle>"
                ),
                r"row \d+: the body of a dynamicObstacle is beside its position, or turned against it",
            )
            for shift in (
                "<center><x>1.4</x><y>0.0</y></center>",
                "<orientation>1.5708</orientation><center><x>0.0</x><y>0.0</y></center>",
                "<originXShift>-1.4</originXShift>",
            )
        ),
        (
            scenario(three_lanes(), driving(100, 20.0, -1.75, 20.0, 5)).replace(
                "<velocity><exact>20.0</exact></velocity>",
                "<velocity><intervalStart>1</intervalStart><intervalEnd>2</intervalEnd></velocity>",
            ),
            "obstacle 100 has uncertain states",
        ),
    ],
)
def test_other_files_are_refused(tmp_path: Path, content: str, problem: str):
    path = tmp_path / "other.xml"
    path.write_text(content)
    with pytest.raises(RecordingError, match=problem):
        read_commonroad(path)


@pytest.mark.real_data
@pytest.mark.slow
def test_recorded_scenarios_are_plausible(us101: Path):
    files = sorted((us101 / "commonroad").glob("*.xml"))
    assert len(files) == 25
    rows = 0
    for file in files:
        (reading,) = read_commonroad(file)
        table, road = reading.recording.table, reading.recording.road
        rows += len(table)
        assert np.all((np.diff(road.edges) > 3.2) & (np.diff(road.edges) < 4.0)), file
        lon, lat, heading = (table[name].to_numpy() for name in ("lon", "lat", "heading"))
        edges, lane = road.edges_at(lon), road.lane_at(lon, lat)[:, None]
        centre = (np.take_along_axis(edges, lane, 1) + np.take_along_axis(edges, lane + 1, 1))[:, 0] / 2
        assert np.median(np.abs(lat - centre)) < 0.8, file
        assert road.lanes in (5, 6), file
        assert abs(np.median(heading)) < 0.01, file
        assert np.quantile(np.abs(heading), 0.95) < 0.1, file
        assert table["speed"].max() < 30, file
        stated = pl.DataFrame(
            {"vehicle": reading.raw.vehicle, "moment": reading.raw.moment, "stated": reading.raw.speed}
        )
        moment = (pl.col("time") / reading.recording.dt).round().cast(pl.Int64)
        both = (
            table.drop("stated")
            .with_columns(moment=moment)
            .join(stated, on=["vehicle", "moment"])
            .filter(pl.col("stated") > 2)
        )
        ratio = both["speed"].to_numpy() / both["stated"].to_numpy()
        assert np.median(ratio) == pytest.approx(1.0, abs=0.03), file
        assert np.median(np.abs(ratio - 1)) < 0.03, file
    assert rows > 45_000


@pytest.mark.real_data
def test_commonroad_io_is_read_without_warnings(us101: Path):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_commonroad(us101 / "commonroad" / "USA_US101-30_1_T-1.xml")
    assert [str(warning.message) for warning in caught] == []
