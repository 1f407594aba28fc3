"""A recording's moments: single scenes and all frames at once, against a slow loop."""

from typing import Any

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coverdrive.errors import DataError, SettingError
from coverdrive.recordings.recording import MEASURES, SCHEMA, Recording
from coverdrive.road import Road
from shape_checks import unchecked


def recording_of(spans: list[tuple[int, int]], dt: float = 0.1) -> Recording:
    """Vehicle i is present from moment spans[i][0] for spans[i][1] moments; all measures are told apart.

    It drives 10 + i/100 m/s in its own place, a little to the left.
    """
    vehicle = np.concatenate([np.full(count, 10 * index) for index, (_, count) in enumerate(spans)])
    moment = np.concatenate([start + np.arange(count) for start, count in spans])
    speed, heading = 10 + vehicle / 1000, 0.001 + vehicle / 1e5
    values = {
        "lon": 2.0 * vehicle + dt * speed * np.cos(heading) * moment,
        "lat": 1.0 + vehicle / 50 + dt * speed * np.sin(heading) * moment,
        "speed": speed,
        "heading": heading,
        "length": 4.0 + vehicle / 100,
        "width": 1.5 + vehicle / 1000,
    }
    columns = {"vehicle": vehicle, "group": 0 * vehicle, "time": moment * dt} | values
    return Recording("test", pl.DataFrame(columns, schema=SCHEMA), dt, Road.straight(), {})


def test_scene_holds_the_vehicles_of_the_moment():
    recording = recording_of([(0, 5), (3, 4)])
    scene = recording.scene_at(0.3)
    assert scene.vehicles == 2
    assert scene.valid.all()
    assert scene.lon.tolist() == pytest.approx([3.0, 23.003], abs=1e-4)
    assert scene.width.tolist() == pytest.approx([1.5, 1.51])
    assert recording.scene_at(0.6).lon.tolist() == pytest.approx([26.006], abs=1e-4)
    assert recording.scene_at(0.58).lon.tolist() == pytest.approx([26.006], abs=1e-4)


def test_moments_without_vehicles_have_empty_scenes():
    assert recording_of([(0, 2), (5, 2)]).scene_at(0.3).vehicles == 0


@pytest.mark.parametrize(("pairs", "at_once"), [(1, [1, 1, 1]), (8, [2, 1]), (2**16, [3])])
def test_every_so_many_moments_are_given_some_at_a_time(
    pairs: int, at_once: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("coverdrive.recordings.recording._PAIRS", pairs)
    frames = recording_of([(0, 5), (3, 4)]).frames()
    parts = list(frames.every(3))
    assert [len(vehicle) for _, vehicle in parts] == at_once
    assert np.array_equal(np.concatenate([vehicle for _, vehicle in parts]), frames.vehicle[::3])
    for name in (*MEASURES, "valid"):
        values = np.concatenate([getattr(scene, name) for scene, _ in parts])
        assert np.array_equal(values, getattr(frames.scene, name)[::3])


@pytest.mark.parametrize("time", [-0.2, 0.7])
def test_times_outside_of_the_recording_are_refused(time: float):
    with pytest.raises(DataError, match=r"test lasts from 0 s to 0.6 s; got the time"):
        recording_of([(0, 5), (3, 4)]).scene_at(time)


@pytest.mark.parametrize("time", [float("nan"), float("inf"), -float("inf"), 10**400, "now", None])
def test_times_that_are_no_numbers_are_named(time: Any):
    with unchecked(), pytest.raises(SettingError, match="time: expected a number, got"):
        recording_of([(0, 5)]).scene_at(time)


def test_other_columns_are_refused():
    recording = recording_of([(0, 5)])
    with pytest.raises(DataError, match="the table of a recording has the columns"):
        Recording("test", recording.table.drop("width"), 0.1, recording.road, {})


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 20), st.integers(1, 15)), min_size=1, max_size=8))
def test_frames_agree_with_the_scenes(spans: list[tuple[int, int]]):
    recording = recording_of(spans)
    frames = recording.frames()
    table = recording.table
    assert frames.time.tolist() == sorted(set(table["time"]))
    assert frames.scene.vehicles == table.group_by("time").len()["len"].max()
    for index, time in enumerate(frames.time):
        valid = frames.scene.valid[index]
        present = table.filter((pl.col("time") - time).abs() < 1e-6)
        assert frames.vehicle[index][valid].tolist() == present["vehicle"].to_list()
        assert np.all(frames.vehicle[index][~valid] == -1)
        for name in MEASURES:
            values = getattr(frames.scene, name)[index]
            assert values.dtype == np.float32
            assert values[valid] == pytest.approx(present[name].to_numpy(), rel=1e-6)
            assert np.all(values[~valid] == 0)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 20), st.integers(1, 15)), min_size=1, max_size=8))
def test_rows_of_the_table_are_found_again(spans: list[tuple[int, int]]):
    recording = recording_of(spans)
    frames = recording.frames()
    table = recording.table
    assert np.array_equal(frames.vehicle[frames.frame, frames.slot], table["vehicle"].to_numpy())
    assert frames.time[frames.frame] == pytest.approx(table["time"].to_numpy())
    assert frames.scene.lat[frames.frame, frames.slot] == pytest.approx(table["lat"].to_numpy(), rel=1e-6)
