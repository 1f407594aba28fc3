"""Beliefs of baselines: constant velocity by hand, and the future as it comes."""

import numpy as np
import pytest
from simulation_fakes import ConstantPlanner, make_scene

from coverdrive.errors import DataError
from coverdrive.league.beliefs import ConstantVelocity, KnownFuture
from coverdrive.road import Road
from coverdrive.simulation.drives.episode import EpisodeSettings, run_episode
from coverdrive.simulation.measures.misses import find_windows
from coverdrive.simulation.traffic.replay import ReplaySettings, ReplayTraffic, Scenario

ROAD = Road.straight()


def scenario(seconds: float = 12.0, vehicles: int = 5) -> Scenario:
    """Vehicles behind one another that accelerate, and sway across the road, each in its own way."""
    time = 0.1 * np.arange(round(10 * seconds) + 1)[:, None]
    number = np.arange(vehicles)
    speed = 15 + number + 2 * np.sin(0.5 * time + number)
    lon = 30.0 * number + (15 + number) * time + 4 * (np.cos(number) - np.cos(0.5 * time + number))
    lat = 5.4 + 0.5 * np.sin(time + number)
    heading = np.arctan2(0.5 * np.cos(time + number), speed)
    states = np.stack(np.broadcast_arrays(lon, lat, np.hypot(speed, 0.5 * np.cos(time + number)), heading), axis=-1)
    valid = np.ones(states.shape[:2], dtype=bool)
    valid[60:, 1] = False
    return Scenario(states, np.tile([4.5, 1.8], (vehicles, 1)), valid, 0.1, ROAD)


def test_constant_velocity_goes_straight_on_within_its_box() -> None:
    scene = make_scene([0, 30], [1.8, 5.4], speed=[20, 10], heading=[0, 0.1])
    box = ConstantVelocity(np.array([[1.0, 0.2], [3.0, 0.4]]), 1.0)
    paths = box.predict(scene, ROAD, 0, 0.5, 4)
    assert paths.vehicle.tolist() == [1]
    along = 10 * np.cos(0.1)
    assert paths.points[0] == pytest.approx(np.array([(30 + along * t, 5.4) for t in (0, 0.5, 1, 1.5, 2)]))
    assert paths.half_sizes[0] - (2.4, 0.95) == pytest.approx(
        np.array([(0, 0), (0.5, 0.1), (1, 0.2), (2, 0.3), (3, 0.4)])
    )
    body = ConstantVelocity().predict(scene, ROAD, 0, 0.5, 4)
    assert np.array_equal(body.points, paths.points)
    assert np.ptp(body.half_sizes, axis=1) == pytest.approx(0.0)


def test_who_knows_the_future_of_a_replay_misses_nothing() -> None:
    recorded = [scenario()]
    missed = {}
    for belief in (KnownFuture(recorded), ConstantVelocity()):
        traffic = ReplayTraffic(recorded, ReplaySettings(place="replace"))
        trace = run_episode(belief, ConstantPlanner(), traffic, EpisodeSettings(duration=6.0), 3, seed=1)
        windows = find_windows(trace)
        assert windows.seen.sum() > 50
        missed[type(belief)] = int(windows.missed.sum())
    assert missed[KnownFuture] == 0 < missed[ConstantVelocity]


def test_beyond_its_last_moment_a_vehicle_keeps_its_velocity() -> None:
    recorded = scenario()
    lon, lat, speed, heading = np.concatenate([[[-100.0, 1.8, 20.0, 0.0]], recorded.states[50]]).T
    scene = make_scene(lon, lat, speed, heading)
    scene = type(scene)(lon, lat, speed, heading, np.full(6, 4.5), np.full(6, 1.8), np.ones(6, dtype=bool))
    paths = KnownFuture([recorded]).predict(scene, ROAD, 0, 0.5, 6)
    (gone,) = np.flatnonzero(paths.vehicle == 2)
    lon, lat, speed, heading = recorded.states[59, 1]
    expected = [lon + (t - 0.9) * speed * np.cos(heading) for t in (1.0, 2.0, 3.0)]
    assert paths.points[gone, [2, 4, 6], 0] == pytest.approx(expected)


def test_a_scene_that_was_not_recorded_has_no_known_future() -> None:
    with pytest.raises(DataError, match="only 0 of 1 vehicles"):
        KnownFuture([scenario()]).predict(make_scene([0, 30], [1.8, 5.4]), ROAD, 0, 0.5, 4)
