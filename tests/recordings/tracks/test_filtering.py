"""What is seen of vehicles comes from the past alone, and is the best estimate of the model that it rests on."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from recordings_fakes import straight

from coverdrive.recordings.read import read
from coverdrive.recordings.recording import SCHEMA
from coverdrive.recordings.tracks.filtering import seen, update
from coverdrive.recordings.tracks.reading import make_reading, regular_table
from coverdrive.recordings.tracks.repair import RawTracks
from coverdrive.recordings.tracks.smoothing import SmoothingSettings
from coverdrive.road import Road

NOISES = (0.1, 4.0)

ROAD = Road.straight()


def by_least_squares(values: np.ndarray, measured: np.ndarray, dt: float) -> np.ndarray:
    """Position and velocity at the last moment that fit all measured positions and the changes of velocity best."""
    count, (position_noise, acceleration_noise) = len(values), NOISES
    spread = acceleration_noise**2 * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    root = np.linalg.inv(np.linalg.cholesky(spread))
    rows, wanted = [], []
    for k in range(count):
        if measured[k]:
            rows.append(np.zeros(2 * count))
            rows[-1][2 * k] = 1 / position_noise
            wanted.append(values[k] / position_noise)
    for k in range(count - 1):
        moved = np.zeros((2, 2 * count))
        moved[:, 2 * k : 2 * k + 2], moved[:, 2 * k + 2 : 2 * k + 4] = -np.array([[1, dt], [0, 1]]), np.eye(2)
        rows.extend(root @ moved)
        wanted.extend([0.0, 0.0])
    rows.append(np.zeros(2 * count))
    rows[-1][1] = 1 / 60.0
    wanted.append(0.0)
    return np.linalg.lstsq(np.array(rows), np.array(wanted), rcond=None)[0][-2:]


def test_it_is_the_least_squares_estimate_from_the_past():
    values = 15 * 0.1 * np.arange(12) + np.random.default_rng(0).normal(0, 0.1, 12)
    measured = np.arange(12) != 5
    positions, velocities = seen(values, measured, np.array([0]), 0.1, NOISES)
    for last in (1, 4, 5, 6, 11):
        expected = by_least_squares(values[: last + 1], measured[: last + 1], 0.1)
        assert (positions[last], velocities[last]) == pytest.approx(expected, abs=1e-6)


def test_every_track_begins_anew():
    values = np.concatenate([np.arange(10.0), 500 - np.arange(8.0)])
    together = seen(values, np.ones(18, dtype=bool), np.array([0, 10]), 0.1, NOISES)
    alone = seen(values[10:], np.ones(8, dtype=bool), np.array([0]), 0.1, NOISES)
    assert np.array_equal(np.array(together)[:, 10:], np.array(alone))
    assert together[1][9] == pytest.approx(10, abs=0.1) and alone[1][-1] == pytest.approx(-10, abs=0.1)


def test_one_measurement_after_the_other_gives_the_same() -> None:
    values, state = np.cumsum(np.random.default_rng(0).normal(1, 0.3, 20)), np.full(5, np.nan)
    positions, velocities = seen(values, np.arange(20) != 7, np.array([0]), 0.1, NOISES)
    for moment in range(20):
        update(state, values[moment] if moment != 7 else np.nan, 0.1, *NOISES)
        assert (state[0], state[1]) == (positions[moment], velocities[moment])


def driven(extra: float = 0.0) -> RawTracks:
    """Two vehicles of 60 moments; from the 40th on, ``extra`` [m] further with every moment."""
    moment = np.tile(np.arange(60), 2)
    vehicle = np.repeat([1, 2], 60)
    lon = 20.0 + 2 * moment + np.random.default_rng(0).normal(0, 0.05, 120) + extra * np.maximum(moment - 39, 0)
    size = np.full(120, 4.5)
    return RawTracks(vehicle, moment, lon, 1.8 * vehicle, size, 0.4 * size, 20.0 + 0 * lon, 0 * moment)


def test_another_future_changes_nothing_that_is_seen(tmp_path: Path):
    road, settings = Road.straight(), SmoothingSettings()
    one, other = (
        make_reading(tmp_path, "any", driven(extra), 0.1, road, settings, Counter(), {}).recording
        for extra in (0.0, 0.8)
    )
    for moment in range(2, 40):
        scenes = [each.scene_at(0.1 * moment) for each in (one, other)]
        assert all(np.array_equal(getattr(scenes[0], name), values) for name, values in vars(scenes[1]).items())
    assert not np.array_equal(one.scene_at(4.0).speed, other.scene_at(4.0).speed)
    before = [each.table.filter(each.table["time"] < 3.95)["speed"].to_numpy() for each in (one, other)]
    assert not np.array_equal(*before)  # what they did is smoothed both ways
    assert np.array_equal(one.frames().scene.speed[:38], other.frames().scene.speed[:38])


def test_a_vehicle_is_seen_from_its_third_position_on_and_gaps_add_nothing_that_comes_later():
    raw = driven()
    left_out = raw.take((raw.moment != 30) & (raw.moment != 31))
    repairs: Counter[str] = Counter()
    table = regular_table(left_out, 0.1, SmoothingSettings(), repairs, ROAD)
    assert table.group_by("vehicle").agg(pl.col("time").min())["time"].to_list() == pytest.approx([0.2, 0.2])
    assert +repairs == {"interpolated rows": 4}
    moved = replace(left_out, lon=left_out.lon + 5 * (left_out.moment > 31))
    again = regular_table(moved, 0.1, SmoothingSettings(), Counter(), ROAD)
    early = table["time"].to_numpy() < 3.15
    assert np.array_equal(table["seen_lon"].to_numpy()[early], again["seen_lon"].to_numpy()[early])
    assert not np.array_equal(table["lon"].to_numpy()[early], again["lon"].to_numpy()[early])


def test_own_tables_are_seen_as_they_are(tmp_path: Path):
    (tmp_path / "scene.xml").write_text(straight())
    (recording,) = read(tmp_path)
    exact = replace(recording, table=recording.table.select(pl.col(SCHEMA.names())))
    assert exact.scene_at(1.0).speed == pytest.approx(recording.rates.filter(time=1.0)["speed"].to_numpy())


@pytest.mark.real_data
@pytest.mark.slow
def test_speeds_of_recorded_vehicles_differ_little_from_those_that_know_the_future(us101: Path):
    errors = []
    for recording in read(us101 / "tracks"):
        table = recording.table
        polar = [(table[f"{kind}speed"], table[f"{kind}heading"]) for kind in ("", "seen_")]
        velocity = [[speed * heading.cos(), speed * heading.sin()] for speed, heading in polar]
        errors.append(np.array(velocity[1]) - np.array(velocity[0]))
    along, across = np.sqrt(np.mean(np.concatenate(errors, axis=1) ** 2, axis=1))
    assert along < 0.26 and across < 0.13
