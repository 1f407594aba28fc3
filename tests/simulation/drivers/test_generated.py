"""Generated traffic obeys physics, is mixed, and repeats."""

from dataclasses import replace
from typing import Any

import numpy as np
import polars as pl
import pytest

from coverdrive.errors import SettingError
from coverdrive.progress import heard_by, stage
from coverdrive.recordings.checks import ENOUGH, LANE_WIDTHS, TIME_STEPS
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.settings import checked
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate


@pytest.fixture(scope="module")
def recordings() -> tuple[Recording, ...]:
    return generate(seed=3)


def overlaps(recording: Recording) -> int:
    """Number of pairs of vehicles, over all frames, whose boxes overlap; headings are small and left aside."""
    scene = recording.frames().scene
    along = np.abs(scene.lon[:, :, None] - scene.lon[:, None]) < (scene.length[:, :, None] + scene.length[:, None]) / 2
    across = np.abs(scene.lat[:, :, None] - scene.lat[:, None]) < (scene.width[:, :, None] + scene.width[:, None]) / 2
    pairs = along & across & scene.valid[:, :, None] & scene.valid[:, None]
    return int(pairs.sum() - scene.valid.sum()) // 2


def test_vehicles_never_overlap(recordings):
    assert [overlaps(recording) for recording in recordings] == [0] * 48


def test_overlaps_would_be_seen(recordings):
    first = recordings[0]
    few = first.table.select(SCHEMA.names()).filter(pl.col("vehicle") < ENOUGH - 1)  # more are refused
    shifted = few.with_columns(pl.col("lon") - pl.col("lon").first().over("vehicle"))
    assert overlaps(Recording("", shifted, first.dt, first.road, {})) > 0


def test_speeds_and_accelerations_are_physical(recordings):
    for recording in recordings:
        table = recording.table
        acceleration = table.select(pl.col("speed").diff().over("vehicle") / recording.dt)["speed"].drop_nulls()
        assert acceleration.min() >= -8
        assert acceleration.max() <= 4
        assert table["speed"].min() >= 0
        assert table["speed"].max() < 45
        assert table["heading"].abs().max() < 0.25


def test_positions_agree_with_speeds_and_headings(recordings):
    table, dt = recordings[0].table, recordings[0].dt
    for name, factor in (("lon", pl.col("heading").cos()), ("lat", pl.col("heading").sin())):
        rate = pl.col("speed") * factor
        moved = table.select(
            moved=pl.col(name).diff().over("vehicle") / dt, mean=(rate + rate.shift(1).over("vehicle")) / 2
        ).drop_nulls()
        assert (moved["moved"] - moved["mean"]).abs().max() < 0.1


def test_traffic_is_mixed(recordings):
    tables = pl.concat([recording.table for recording in recordings])
    means = np.array([recording.table["speed"].mean() for recording in recordings])
    assert means.min() < 17
    assert means.max() > 22
    assert tables["speed"].min() < 8
    assert (tables["length"] > 8).any()
    acceleration = tables.select(pl.col("speed").diff().over("vehicle") * 10)["speed"].drop_nulls()
    assert (acceleration < -2).mean() > 0.001
    lanes = np.concatenate([recording.road.lane_of(recording.table["lat"].to_numpy()) for recording in recordings])
    changes = (np.diff(lanes) != 0) & (np.diff(tables["vehicle"].to_numpy()) == 0)
    assert changes.sum() > 200
    assert all(np.mean(lanes == lane) > 0.15 for lane in range(3))


def test_defaults_are_scenes_of_their_own(recordings):
    assert len(recordings) == 48
    assert [recording.table["group"].unique().to_list() for recording in recordings] == [[n] for n in range(48)]
    vehicles = [set(recording.table["vehicle"]) for recording in recordings]
    assert sum(map(len, vehicles)) == len(set().union(*vehicles))
    for recording in recordings:
        assert recording.dt == 0.1
        assert 20 <= recording.table["vehicle"].n_unique() <= 30
        assert recording.table["time"].max() == pytest.approx(20.0)
        assert recording.table["lon"].min() > 0
        assert recording.table["lon"].max() < recording.road.length
        assert recording.table["lat"].is_between(0.9, 10.8 - 0.9).all()


def test_the_same_seed_gives_the_same_traffic():
    settings = GeneratedSettings(scenes=2, duration=5.0)
    first, again, other = generate(settings, 1), generate(settings, 1), generate(settings, 2)
    assert all(left.table.equals(right.table) for left, right in zip(first, again, strict=True))
    assert not first[0].table.equals(other[0].table)


def test_noise_is_smoothed_like_measured_positions():
    exact = generate(GeneratedSettings(scenes=2, duration=20.0))
    noisy = generate(GeneratedSettings(scenes=2, duration=20.0, noise=0.1))
    for left, right in zip(exact, noisy, strict=True):
        left = replace(left, table=left.table.filter(pl.col("time") > 0.15))  # the noisy ones are seen 0.2 s later
        assert left.table.select("vehicle", "group", "time").equals(right.table.select("vehicle", "group", "time"))
        assert left.table["seen_speed"].equals(left.table["speed"], check_names=False)
        error = right.table["lon"].to_numpy() - left.table["lon"].to_numpy()
        assert 0.01 < error.std() < 0.08
        assert (right.table["speed"] - left.table["speed"]).std() < 0.5
        assert 0.1 < (right.table["seen_speed"] - left.table["speed"]).std() < 1.5


def test_other_roads_and_numbers():
    settings = GeneratedSettings(scenes=30, duration=1.0, lanes=1, vehicles=(1, 4), truck_share=1.0)
    seen: list[float] = []
    with heard_by(lambda _, share: seen.append(share)), stage("generating"):
        recordings = generate(settings)
    assert len(recordings) == 30
    assert seen == [0.0, 24 / 30, 1.0, 1.0]
    assert all(recording.road.lanes == 1 and overlaps(recording) == 0 for recording in recordings)
    assert {recording.table["vehicle"].n_unique() for recording in recordings} == {1, 2, 3, 4}
    assert all(recording.table["length"].min() >= 8 for recording in recordings)


def test_nobody_begins_where_a_ramp_has_nearly_ended():
    """Dense traffic beside a short ramp: those who could not stop on it are left out, the others merge."""
    settings = GeneratedSettings(scenes=4, duration=20.0, lanes=1, ramp=300.0, vehicles=(20, 20))
    for recording in generate(settings, seed=1):
        table, road = recording.table, recording.road
        assert table["vehicle"].n_unique() < 20
        edges = road.edges_at(table["lon"].to_numpy())
        assert (table["lat"].to_numpy() - table["width"].to_numpy() / 2 > edges[:, 0]).all()
        assert overlaps(recording) == 0


def test_shared_names_of_groups_rise_with_the_scenes():
    recordings = generate(GeneratedSettings(scenes=26, duration=1.0, vehicles=(2, 3)))
    assert [recording.table["group"][0] for recording in recordings] == list(range(26))
    assert len({recording.name for recording in recordings}) == 26


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"dt": 0.01}, "dt: Input should be greater than or equal to 0.02, got 0.01"),
        ({"lane_width": 8}, "lane_width: Input should be less than or equal to 7.5, got 8"),
        ({"speed_limit": 95}, "a limit of 95 m/s is more than 90 m/s; 120 is none"),
        ({"speed": (100, 110)}, r"up to 120 m/s, which is more than 90 m/s; lower speed, drivers\.desired_speed or"),
        ({"drivers": {"desired_speed": 80}}, r"up to 99\.2 m/s, which is more than 90 m/s"),
    ],
)
def test_what_no_recording_may_be_is_refused_with_the_settings(changes: dict[str, Any], problem: str):
    with pytest.raises(SettingError, match=problem):
        checked(GeneratedSettings, changes)


def test_settings_at_the_limits_of_recordings_generate():
    few: dict[str, Any] = {"scenes": 1, "duration": 20.0, "vehicles": (2, 3), "speed": (80, 81), "dt": TIME_STEPS[0]}
    (recording,) = generate(GeneratedSettings(lane_width=LANE_WIDTHS[1], **few))
    assert recording.table["speed"].to_numpy().max() > 40
    assert generate(GeneratedSettings(speed=(100, 110), speed_limit=80, scenes=1, duration=1.0, vehicles=(2, 3)))
