"""Summaries for people."""

import polars as pl
import pytest

from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.recordings.summary import summarise
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
