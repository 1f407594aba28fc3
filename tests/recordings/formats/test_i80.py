"""NGSIM I-80 with its ramp, written by the published format alone: the ramp is a lane that ends, and nobody is lost."""

from pathlib import Path
from typing import Literal

import numpy as np
import polars as pl
import pytest
from published_i80 import JOINS, LANE, LAST, RAMP, i80, write_i80
from recordings_fakes import FOOT

from coverdrive.recordings.formats.ngsim import read_ngsim
from coverdrive.recordings.formats.parquet import write_parquet
from coverdrive.recordings.map_tracks import MapTracks, readings_from_map
from coverdrive.recordings.read import read
from coverdrive.recordings.recording import Recording
from coverdrive.recordings.tracks.smoothing import SmoothingSettings
from coverdrive.scene import Scene

TABLE = i80()
FEW = TABLE.filter((pl.col("Vehicle_ID") < 100 * RAMP) | (pl.col("Vehicle_ID") % 100 < 5))
"""Of the vehicles of the ramp only so many that they have less than 2 % of the rows"""


def lanes_driven(recording: Recording) -> pl.DataFrame:
    """The lane of every row, by the road."""
    table = recording.table
    lane = recording.road.lane_at(table["lon"].to_numpy(), table["lat"].to_numpy())
    return table.with_columns(lane=pl.Series(lane))


def check_ramp(recording: Recording, written: pl.DataFrame, end: float) -> None:
    """Seven lanes of which the rightmost ends at a place [m]; whoever comes from the ramp is seen to change lanes."""
    road = recording.road
    assert road.lanes == RAMP
    there = road.has_lane(np.array([60.0, end - 2.0, end + 30.0, 450.0]))
    assert there[:, 0].tolist() == [True, True, False, False] and there[:, 1:].all()
    merged = written.filter(pl.col("Vehicle_ID") >= 100 * RAMP)["Vehicle_ID"].n_unique()
    ways = lanes_driven(recording).group_by("vehicle", maintain_order=True).agg("lane", "lon")
    ramp = ways.filter(pl.col("lane").list.first() == 0)
    assert len(ramp) == merged and (ramp["lane"].list.last() == 1).all()
    assert (ramp["lane"].list.eval(pl.element().diff().abs().sum()).list.first() == 1).all()  # one change each
    assert (ramp["lon"].list.first() < 50).all() and (ramp["lon"].list.last() > 490).all()


@pytest.mark.parametrize(("form", "written"), [("csv", TABLE), ("txt", FEW)], ids=["frequent", "rare"])
def test_the_ramp_is_a_lane_that_ends(form: Literal["csv", "txt"], written: pl.DataFrame, tmp_path: Path):
    (recording,) = read([write_i80(tmp_path, written, form)], location="i-80" if form == "csv" else None)
    assert recording.notes["lanes"] == "lane numbers; begin or end on the right: 1"
    last = written.filter(pl.col("Lane_ID") == RAMP)["Local_Y"].max()
    check_ramp(recording, written, last * FOOT - 15 * FOOT / 2)
    beside = written.filter(pl.col("Local_X") > LANE * (RAMP + 0.5) + 1)  # 1.8 m beside the ramp, where it comes
    off = recording.repairs.pop("rows off the road")
    assert recording.repairs == {} and beside.filter(pl.col("Local_Y") > JOINS[1]).is_empty()
    assert off == pytest.approx(len(beside), abs=0.1 * len(beside) + 5)
    assert len(recording.table) == len(written) - off - 2 * written["Vehicle_ID"].n_unique()
    moment = (10 * pl.col("time")).round().cast(pl.Int64)
    found = recording.table.with_columns(moment=moment).join(
        written.select(
            vehicle=pl.col("Vehicle_ID").cast(pl.Int64),
            moment=pl.col("Frame_ID") - written["Frame_ID"].min(),
            front=pl.col("Local_Y") * FOOT,
            left=(LANE * LAST - pl.col("Local_X")) * FOOT,
            named="Lane_ID",
        ),
        on=["vehicle", "moment"],
    )
    assert len(found) == len(recording.table)
    assert found["lon"].to_numpy() == pytest.approx(found["front"].to_numpy() - 7.5 * FOOT, abs=0.1)
    beyond = found["lat"].to_numpy() - recording.road.edges[1]
    assert beyond == pytest.approx(found["left"].to_numpy(), abs=0.25)
    agree = lanes_driven(recording)["lane"].to_numpy() == RAMP - found["named"].to_numpy()
    assert agree.mean() > 0.98


def test_vehicles_of_the_ramp_are_in_scenes_and_kept_in_own_files(tmp_path: Path):
    (recording,) = read([write_i80(tmp_path, TABLE, "txt")])
    row = lanes_driven(recording).filter((pl.col("lane") == 0) & (pl.col("lon") > 100)).row(0, named=True)
    scene = recording.scene_at(row["time"])
    assert isinstance(scene, Scene) and np.any(np.isclose(scene.lon, row["seen_lon"]))
    write_parquet([recording], tmp_path / "own.parquet")
    (again,) = read([tmp_path / "own.parquet"])
    assert again.road.changing is not None and recording.road.changing is not None
    assert np.array_equal(again.road.changing.lat, recording.road.changing.lat)
    assert again.table.drop("identity").equals(recording.table.drop("identity"))


def test_in_several_periods_it_is_the_same_road(tmp_path: Path):
    later = i80(phase=9.0, start=1_113_434_035_300)
    readings = read_ngsim(write_i80(tmp_path, pl.concat([TABLE, later]), "csv"))
    assert [each.recording.name[-8:] for each in readings] == ["period 1", "period 2"]
    for each in readings:
        check_ramp(each.recording, TABLE, 190.0)


@pytest.mark.parametrize(("radius", "named"), [(np.inf, True), (-900.0, False)])
def test_tracks_on_a_map_have_it_too(radius: float, named: bool, tmp_path: Path):
    """In a frame whose x is turned by 30° to the road, and on one that bends to the right; with and without numbers."""
    way = (pl.col("Local_Y") - 7.5) * FOOT
    along, left = (TABLE.select(each).to_series().to_numpy() for each in (way, -pl.col("Local_X") * FOOT))
    place = (
        along + 1j * left
        if np.isinf(radius)
        else radius * 1j + (left / radius - 1) * radius * 1j * np.exp(1j * along / radius)
    )
    place *= np.exp(1j * np.radians(30))
    table = TABLE.select(
        vehicle="Vehicle_ID",
        time=pl.col("Frame_ID") / 10,
        x=pl.Series(place.real),
        y=pl.Series(place.imag),
        length=15 * FOOT,
        width=6 * FOOT,
        **({"lane": "Lane_ID"} if named else {}),
    )
    tracks = MapTracks("i80", table, dt=0.1)
    (reading,) = readings_from_map(tmp_path / "i80.csv", tracks, SmoothingSettings())
    known = "lane numbers, growing to the right" if named else "estimated (tracks)"
    assert reading.recording.notes["lanes"] == f"{known}; begin or end on the right: 1"
    check_ramp(reading.recording, TABLE, 190.0)
