"""Summaries for people."""

import numpy as np
import polars as pl
import pytest

from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.recordings.summary import accelerations, following, summarise
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import Road


def test_summary_counts_what_is_there():
    columns = {
        "vehicle": [1, 1, 4],
        "group": [2, 3, 2],
        "time": [0.0, 90.0, 30.0],  # a vehicle may come back in another group
        "lon": [0.0] * 3,
        "lat": [0.0] * 3,
        "speed": [10.0, 20.0, 30.0],
        "heading": [0.0] * 3,
        "length": [4.0] * 3,
        "width": [2.0] * 3,
    }
    recording = Recording("test", pl.DataFrame(columns, schema=SCHEMA), 0.1, Road.straight(4), {"split tracks": 1})
    (summary,) = summarise([recording])
    assert (summary.name, summary.groups, summary.vehicles, summary.rows) == ("test", (2, 3), 2, 3)
    assert (summary.lanes, summary.dt, summary.repairs) == (4, 0.1, {"split tracks": 1})
    assert (summary.minutes, summary.mean_speed, summary.max_speed) == pytest.approx((1.5, 20.0, 30.0))


def driving(speeds: list[float], lat: list[float], lon: list[float], steps: int = 5) -> pl.DataFrame:
    """Vehicles at even speeds [m/s], 4 m long."""
    rows = [
        (vehicle, 0, 0.1 * step, start + speed * 0.1 * step, side, speed, 0.0, 4.0, 2.0)
        for vehicle, (speed, side, start) in enumerate(zip(speeds, lat, lon, strict=True))
        for step in range(steps)
    ]
    return pl.DataFrame(rows, schema=SCHEMA, orient="row")


def test_gaps_are_those_to_the_next_vehicle_of_the_lane():
    table = driving([10.0, 12.0, 10.0, 10.0], [1.8, 1.8, 5.4, 1.8], [0.0, 20.0, 5.0, 60.0])
    found = following(Recording("test", table, 0.1, Road.straight(2), {}))["gap"].to_numpy()
    assert sorted(found) == pytest.approx(
        sorted([16 + 0.2 * step for step in range(5)] + [36 - 0.2 * step for step in range(5)])
    )


def test_gaps_are_measured_on_the_ground():
    line = ReferenceLine(np.zeros(2), 0.0, np.full(301, 1 / 100), 300.0)
    table = driving([0.0, 0.0], [2.0, 2.0], [0.0, 50.0], steps=1)
    found = following(Recording("test", table, 0.1, Road(np.array([0.0, 3.5]), 300.0, line), {}))["gap"].to_numpy()
    assert found == pytest.approx([50 * 0.98 - 4])


def test_accelerations_stay_within_tracks():
    table = driving([10.0, 30.0], [1.8, 5.4], [0.0, 0.0]).with_columns(
        speed=pl.col("speed") + pl.when(pl.col("vehicle") == 0).then(2 * pl.col("time")).otherwise(0)
    )
    found = accelerations(Recording("test", table, 0.1, Road.straight(2), {}))
    assert found == pytest.approx([2.0] * 4 + [0.0] * 4)
