"""Lanelet2 maps, as an independent writer draws them, and UTM coordinates."""

from pathlib import Path

import numpy as np
import pytest
from published_formats import EDGES, found_again, truth, write_exid, write_lanelets, write_mona

from coverdrive.errors import RecordingError
from coverdrive.recordings.files.lanelet2 import utm
from coverdrive.recordings.read import read

REAL = truth(0.04, seconds=5.0)


@pytest.mark.parametrize(
    ("latitude", "longitude", "zone", "east", "north"),
    [
        (0.0, 0.0, 31, 166_021.443, 0.0),  # the origin of INTERACTION's maps
        (50.0, 9.0, 32, 500_000.0, 5_538_630.703),
        (0.0, 9.0, 32, 500_000.0, 0.0),
    ],
)
def test_coordinates_of_known_places(latitude: float, longitude: float, zone: int, east: float, north: float):
    found = utm(latitude, longitude, zone)
    assert (float(found[0]), float(found[1])) == pytest.approx((east, north), abs=0.001)


def test_west_and_east_of_the_meridian_are_alike():
    left, right = utm(48.0, 8.0, 32), utm(48.0, 10.0, 32)
    assert left[0] + right[0] == pytest.approx(1_000_000.0) and left[1] == pytest.approx(right[1])


def test_lanes_come_from_the_map(tmp_path: Path):
    write_exid(tmp_path, REAL)
    recordings = read([tmp_path], map=write_lanelets(tmp_path))
    for table in REAL.tables:
        (recording,) = (each for each in recordings if each.table["vehicle"].min() == table["vehicle"].min() + 1)
        assert recording.notes["lanes"] == "map" and recording.repairs == {}
        assert recording.notes["traffic"] == "keeps right"
        assert recording.road.edges == pytest.approx(EDGES, abs=0.01)
        assert float(recording.road.length) == pytest.approx(820.0, abs=0.5)
        worst = found_again(recording, table, shift=0.0)
        assert worst["lat"] < 0.05 and worst["lon"] < 0.1 and worst["heading"] < 0.01


@pytest.mark.parametrize("radius", [400.0, -350.0])
def test_with_a_map_roads_may_bend_by_any_angle(radius: float, tmp_path: Path):
    """By 115° and 131°."""
    tracks = write_exid(tmp_path, REAL, curvature=1 / radius)
    with pytest.raises(RecordingError, match=r"vehicles drive at more than 30° to the others.* no map shows its bends"):
        read([tracks])
    recordings = read([tracks], map=write_lanelets(tmp_path, pieces=20, curvature=1 / radius))
    for table in REAL.tables:
        (recording,) = (each for each in recordings if each.table["vehicle"].min() == table["vehicle"].min() + 1)
        assert recording.notes["traffic"] == "keeps right" and recording.repairs == {}
        assert recording.table["vehicle"].n_unique() == table["vehicle"].n_unique()
        assert found_again(recording, table, shift=0.0)["lat"] < 0.1


def test_maps_of_other_places_are_refused(tmp_path: Path):
    write_exid(tmp_path, REAL)
    with pytest.raises(RecordingError, match=r"only \d+ of \d+ rows are on the 3 lanes"):
        read([tmp_path], map=write_lanelets(tmp_path, north=300.0))
    with pytest.raises(RecordingError, match="where its tracks are on a map is not known"):
        read([write_mona(tmp_path, REAL)], map=tmp_path / "lanelets.osm")


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("</osm>", "", r"lanelets\.osm: not a Lanelet2 map, or damaged"),
        ("osm", "OpenDRIVE", r"an OpenDRIVE map, which is not read; name the Lanelet2 map \(\.osm\) beside it"),
        ('lat="', 'latitude="', "KeyError: 'lat'"),
        ('lon="9', 'lon="999', "ValueError: a node has no geographic coordinates"),
        ('lat="0.000', 'lat="3.000', "a lane is .* m long; expected up to"),
        ('role="left"', 'role="middle"', "KeyError: 'left'"),
        ('v="lanelet"', 'v="multipolygon"', "no lanelets that vehicles drive on"),
        ('<nd ref="5"/>', '<nd ref="99999"/>', "not a Lanelet2 map, or damaged"),
    ],
)
def test_damaged_maps_are_refused(old: str, new: str, problem: str, tmp_path: Path):
    tracks, path = write_exid(tmp_path, REAL), write_lanelets(tmp_path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(RecordingError, match=problem):
        read([tracks], map=path)
    assert np.isfinite(read([tracks])[0].table["lon"].to_numpy()).all()


NODES = (
    ("0.00000903483", "0.00000897435"),
    ("0.00000903484", "0.00090640957"),
    ("0.00003613932", "0.00000897435"),
    ("0.00003613935", "0.00090640957"),
    ("0.00006324382", "0.00000897435"),
    ("0.00006324382", "0.00090640957"),
)
"""Of the map of INTERACTION's own test scenario, github.com/interaction-dataset/interaction-dataset (BSD-3-Clause)"""


def test_the_test_scenario_of_interaction_itself(tmp_path: Path):
    """Two lanes of 3 m and 100 m, driven in opposite directions; a vehicle in the middle of each."""
    tracks = ["track_id,frame_id,timestamp_ms,agent_type,x,y,vx,vy,psi_rad,length,width"]
    tracks += [f"1,{k},{100 * k},car,{k},2.5,10,0,0,4,1.8" for k in range(1, 101)]
    tracks += [f"2,{k},{100 * k},car,{131 - k},5.5,10,0,3.1415,4,1.8" for k in range(31, 101)]
    (tmp_path / "vehicle_tracks_000.csv").write_text("\n".join(tracks) + "\n")
    places = [f'<node id="{number}" lat="{lat}" lon="{lon}"/>' for number, (lat, lon) in enumerate(NODES, 1)]
    ways = [f'<way id="{10 + k}"><nd ref="{2 * k + 1}"/><nd ref="{2 * k + 2}"/></way>' for k in range(3)]
    kind = '<tag k="subtype" v="road"/><tag k="type" v="lanelet"/>'
    lanelets = [
        f'<relation id="{number}"><member type="way" ref="11" role="left"/>'
        f'<member type="way" ref="{right}" role="right"/>{kind}</relation>'
        for number, right in ((20, 10), (21, 12))
    ]
    (tmp_path / "map.osm").write_text(f'<osm version="0.6">{"".join([*places, *ways, *lanelets])}</osm>')
    forth, back = read([tmp_path], map=tmp_path / "map.osm")
    for recording, lon in ((forth, (2.0, 99.0)), (back, (3.0, 70.0))):
        assert recording.notes["lanes"] == "map" and recording.road.side == "right"
        assert recording.road.edges == pytest.approx([0, 3], abs=1e-4)
        assert float(recording.road.length) == pytest.approx(100.0, abs=1e-4)
        assert recording.table["lat"].to_numpy() == pytest.approx(1.5, abs=1e-4)
        assert (recording.table["lon"].min(), recording.table["lon"].max()) == pytest.approx(lon, abs=1e-4)
