"""Cutting tracks into deviations from constant velocity."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from coverdrive.errors import DataError, SettingError
from coverdrive.prediction.data.segments import SegmentSettings, cut_segments
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.road import Road


def track(lon: np.ndarray, lat: np.ndarray | float, speed: np.ndarray | float, vehicle: int = 7) -> Recording:
    rows = len(lon)
    columns = {
        "vehicle": [vehicle] * rows,
        "group": [3] * rows,
        "time": 0.1 * np.arange(rows),
        "lon": lon,
        "lat": np.broadcast_to(lat, rows),
        "speed": np.broadcast_to(speed, rows),
        "heading": np.zeros(rows),
        "length": np.full(rows, 4.8),
        "width": np.full(rows, 1.9),
    }
    return Recording(
        "track", pl.DataFrame(columns).cast({"vehicle": pl.Int64, "group": pl.Int64}), 0.1, Road.straight(), {}
    )


def test_braking_deviates_by_half_a_t_squared() -> None:
    time = 0.1 * np.arange(31)
    segments = cut_segments([track(20 * time - time**2, 5.4 + 0.1 * time, 20 - 2 * time)])
    assert segments.points.shape == (1, 7, 2)
    points = 0.5 * np.arange(7)
    assert segments.points[0, :, 0] == pytest.approx(-(points**2))
    assert segments.points[0, :, 1] == pytest.approx(0.1 * points)
    assert (segments.speed[0], segments.group[0], segments.row[0]) == (20, 3, 0)


def test_heading_turns_the_speed_into_the_road() -> None:
    recording = track(np.zeros(31), 0.0, 1.0)
    turned = recording.table.with_columns(seen_heading=pl.lit(np.pi / 3))
    segments = cut_segments([Recording("turned", turned, 0.1, recording.road, {})])
    assert segments.speed[0] == pytest.approx(0.5)


@pytest.mark.parametrize(("rows", "stride", "expected"), [(30, 0.1, 0), (31, 0.1, 1), (40, 0.1, 10), (51, 0.5, 5)])
def test_number_of_segments(rows: int, stride: float, expected: int) -> None:
    recording = track(np.zeros(rows), 0.0, 0.0)
    long_enough = track(np.zeros(31), 0.0, 0.0)
    segments = cut_segments([recording, long_enough], SegmentSettings(stride=stride))
    assert (segments.recording == 0).sum() == expected


def test_segments_never_mix_vehicles() -> None:
    table = pl.concat([track(np.zeros(35), 1.8 * v, 0.0, vehicle=v).table for v in (1, 3)])
    segments = cut_segments([Recording("two", table, 0.1, Road.straight(), {})], SegmentSettings(stride=0.1))
    assert segments.row.tolist() == [*range(5), *range(35, 40)]
    assert len(np.unique(segments.vehicle)) == 2


def test_keys_tell_recordings_apart_and_are_stable() -> None:
    first, second = track(np.zeros(31), 0.0, 0.0), track(np.zeros(31), 0.0, 0.0)
    other = Recording("other", second.table.select(SCHEMA.names()), 0.1, second.road, {})
    assert len(np.unique(cut_segments([first, other]).vehicle)) == 2
    assert cut_segments([other, first]).vehicle.tolist() == cut_segments([first, other]).vehicle[::-1].tolist()
    same = replace(other, table=other.table.with_columns(first.table["identity"]))
    assert len(np.unique(cut_segments([first, same]).vehicle)) == 1


def test_segments_begin_where_the_vehicle_is_seen_and_lead_to_where_it_went() -> None:
    recording = track(20 * 0.1 * np.arange(31), 5.4, 20.0)
    seen = {"seen_lon": pl.col("lon") + 0.3, "seen_lat": pl.col("lat") - 0.1, "seen_speed": pl.lit(21.0)}
    off = recording.table.with_columns(**seen)
    segments = cut_segments([replace(recording, table=off)])
    after = 0.5 * np.arange(1, 7)
    assert segments.speed.tolist() == [21.0]
    assert segments.points[0, 0].tolist() == [0.0, 0.0]
    assert segments.points[0, 1:, 0] == pytest.approx(-0.3 - after)
    assert segments.points[0, 1:, 1] == pytest.approx(0.1)


def test_short_tracks_and_odd_steps_are_refused() -> None:
    with pytest.raises(DataError, match=r"seen for 3\.0 s without a gap"):
        cut_segments([track(np.zeros(30), 0.0, 0.0)])
    with pytest.raises(SettingError, match="multiple of the time step"):
        cut_segments([track(np.zeros(31), 0.0, 0.0)], SegmentSettings(stride=0.25))
