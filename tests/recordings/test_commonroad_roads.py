"""The table of CommonRoad scenarios in the documentation says what is read of each."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from coverdrive.errors import DataError, RecordingError
from coverdrive.recordings.commonroad import read_commonroad

PAGE = Path(__file__).parents[2] / "docs" / "recordings.md"


def row_of(file: Path) -> str:
    """The line of the table for a file."""
    try:
        recording = read_commonroad(file).recording
    except RecordingError as error:
        return f"| {file.stem} | refused: {str(error).removeprefix(f'{file}: ')} | | | | | | | |"
    road, line = recording.road, recording.road.line
    assert line is not None
    shares = road.has_lane(np.linspace(0, road.length, 500)).mean(axis=0)
    lanes = " ".join("1" if share > 0.99 else f"{share:.2f}" for share in shares)
    radius = 1 / max(np.abs(line.curvature).max(), 1e-9)
    try:
        driven = f"{road.as_straight().lanes} lanes"
    except DataError:
        driven = "no"
    cells = (
        file.stem,
        lanes,
        f"{road.length:.0f}",
        f"{np.degrees(line.bend):.0f}",
        f"{radius:.0f}" if radius < 10_000 else "–",
        "–" if road.speed_limit is None else f"{road.speed_limit:.1f}",
        recording.table["vehicle"].n_unique(),
        recording.repairs.get("rows off the road", 0),
        driven,
    )
    return "| " + " | ".join(map(str, cells)) + " |"


@pytest.mark.real_data
@pytest.mark.slow
def test_the_table_in_the_documentation_is_what_is_read(roads: Path):
    page = PAGE.read_text(encoding="utf-8").splitlines()
    files = sorted(roads.glob("*.xml"))
    assert len(files) == 54
    missing = [row for row in map(row_of, files) if row not in page]
    assert missing == []


@pytest.mark.real_data
@pytest.mark.slow
def test_vehicles_are_as_fast_as_the_files_say_and_follow_their_lanes(roads: Path):
    for file in sorted(roads.glob("*.xml")):
        try:
            recording, raw = read_commonroad(file)
        except RecordingError:
            continue
        table, road = recording.table, recording.road
        stated = pl.DataFrame({"vehicle": raw.vehicle, "moment": raw.moment, "stated": raw.speed})
        moment = (pl.col("time") / recording.dt).round().cast(pl.Int64)
        both = table.with_columns(moment=moment).join(stated, on=["vehicle", "moment"]).filter(pl.col("stated") > 2)
        assert (both["speed"] / both["stated"]).median() == pytest.approx(1.0, abs=0.03), file.stem
        lon, lat = table["lon"].to_numpy(), table["lat"].to_numpy()
        edges = road.edges_at(lon)
        assert np.mean((lat > edges[:, 0]) & (lat < edges[:, -1])) > 0.9, file.stem
        assert np.median(np.abs(table["heading"].to_numpy())) < 0.05, file.stem
