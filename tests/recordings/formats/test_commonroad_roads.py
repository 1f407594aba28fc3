"""CommonRoad scenarios with curves, ramps and merges are read as their files say."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from coverdrive.errors import RecordingError
from coverdrive.recordings.formats.commonroad import read_commonroad


@pytest.mark.real_data
@pytest.mark.slow
def test_vehicles_are_as_fast_as_the_files_say_and_follow_their_lanes(roads: Path):
    for file in sorted(roads.glob("*.xml")):
        try:
            recording, raw = read_commonroad(file)[0]
        except RecordingError:
            continue
        table, road = recording.table, recording.road
        stated = pl.DataFrame({"vehicle": raw.vehicle, "moment": raw.moment, "stated": raw.speed})
        moment = (pl.col("time") / recording.dt).round().cast(pl.Int64)
        both = (
            table.drop("stated")
            .with_columns(moment=moment)
            .join(stated, on=["vehicle", "moment"])
            .filter(pl.col("stated") > 2)
        )
        assert (both["speed"] / both["stated"]).median() == pytest.approx(1.0, abs=0.03), file.stem
        lon, lat = table["lon"].to_numpy(), table["lat"].to_numpy()
        edges = road.edges_at(lon)
        assert np.mean((lat > edges[:, 0]) & (lat < edges[:, -1])) > 0.9, file.stem
        assert np.median(np.abs(table["heading"].to_numpy())) < 0.05, file.stem
