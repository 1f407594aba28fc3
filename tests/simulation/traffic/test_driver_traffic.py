from dataclasses import replace

import numpy as np
import pytest
from simulation_fakes import make_scene

from coverdrive.road import Road
from coverdrive.simulation.drivers.idm_mobil import follow
from coverdrive.simulation.drives.outcome import contacts
from coverdrive.simulation.roads.initial import EGO, InitialSettings
from coverdrive.simulation.traffic.driver_traffic import AggressiveTrafficSettings, DriverTraffic, DriverTrafficSettings
from coverdrive.simulation.traffic.model import Starting, Traffic
from coverdrive.simulation.traffic.motion import with_states

ROAD = Road.straight()
CALM = DriverTrafficSettings(moody_share=0.0, wander=0.0)
GOLDEN = {
    DriverTrafficSettings(): [
        [206.77985395111435, 5.38132596465603, 18.512437378074992],
        [300.1178920145867, 9.103658100906548, 22.9882018762505],
        [221.55333112442938, 8.987052939390049, 19.003920015092948],
    ],
    AggressiveTrafficSettings(): [
        [167.66983933691364, 5.433833644201773, 11.103849045803138],
        [305.65946829645145, 5.498518868180365, 23.15348270204554],
        [172.66434842300822, 8.960192843825379, 12.405893679012474],
    ],
}


def drive(traffic, scene, seed, steps, acceleration=0.0, dt=0.1):
    """Step the traffic while the ego keeps its lane."""
    traffic.reset(scene, ROAD, np.random.default_rng(seed))
    scenes = [scene]
    for _ in range(steps):
        states = traffic.step(scenes[-1], dt).scene.states
        assert np.array_equal(states[EGO], scenes[-1].states[EGO])
        states[EGO, 0] += dt * states[EGO, 2]
        states[EGO, 2] = max(0.0, states[EGO, 2] + dt * acceleration)
        scenes.append(with_states(scenes[-1], states))
    return scenes


def start(settings, vehicles, seed):
    return DriverTraffic(settings).start(InitialSettings(), vehicles, np.random.default_rng(seed)).scene


def test_it_is_a_traffic_model_with_its_own_start():
    traffic = DriverTraffic()
    assert isinstance(traffic, Traffic) and isinstance(traffic, Starting)
    scene = start(DriverTrafficSettings(), 7, 0)
    assert scene.vehicles == 8
    assert scene.lon.min() < -10 and scene.lon.max() > 30  # wider than the paper's


def test_a_follower_drives_as_the_intelligent_driver_model_says():
    traffic = DriverTraffic(CALM)
    scene = make_scene([30.0, 0.0], [1.8, 1.8], speed=[18.0, 20.0])
    traffic.reset(scene, Road.straight(1), np.random.default_rng(0))
    drivers = traffic._freeway.drivers
    expected = follow(drivers, np.array([[18.0, 20.0]]), np.array([[1e6, 30 - 4.8]]), np.array([[0.0, 18.0]]))[0, 1]
    after = traffic.step(scene, 0.1).scene
    assert after.speed[1] == pytest.approx(20.0 + 0.1 * expected)
    assert after.lon[1] == pytest.approx(0.1 * (20.0 + after.speed[1]) / 2)


def test_drivers_react_to_the_ego():
    """A follower alone in its lane brakes behind the ego and does not touch it, even if that one brakes hard."""
    scene = make_scene([40.0, 0.0], [1.8, 1.8])
    traffic = DriverTraffic(CALM)
    traffic.reset(scene, Road.straight(1), np.random.default_rng(0))
    for _ in range(100):
        states = traffic.step(scene, 0.1).scene.states
        states[EGO, 0] += 0.1 * states[EGO, 2]
        states[EGO, 2] = max(0.0, states[EGO, 2] - 0.4)
        scene = with_states(scene, states)
        assert not contacts(scene).any()
    assert scene.speed[1] < 1.0
    free = drive(DriverTraffic(CALM), make_scene([-500.0, 0.0], [9.0, 1.8]), 0, 100)
    assert free[-1].speed[1] > 20.0


def test_a_car_between_two_lanes_is_in_both():
    beside, between = make_scene([20.0, 0.0], [9.0, 5.4]), make_scene([20.0, 0.0], [7.2, 5.4])
    for scene, brakes in ((beside, False), (between, True)):
        traffic = DriverTraffic(CALM)
        scene = with_states(scene, np.array([[20.0, scene.lat[0], 10.0, 0.0], [0.0, 5.4, 20.0, 0.0]]))
        traffic.reset(scene, ROAD, np.random.default_rng(0))
        assert (traffic.step(scene, 0.1).scene.speed[1] < 19.9) == brakes


@pytest.mark.parametrize(
    "settings", [DriverTrafficSettings(), pytest.param(AggressiveTrafficSettings(), marks=pytest.mark.slow)]
)
def test_drivers_change_lanes_stay_on_the_road_and_do_not_touch_each_other(settings):
    changes = 0
    for seed in range(6):
        scenes = drive(DriverTraffic(settings), start(settings, 12, seed), seed, 200)
        lanes = np.stack([np.asarray(ROAD.lane_of(scene.lat[1:])) for scene in scenes])
        changes += np.count_nonzero(np.diff(lanes, axis=0))
        for scene in scenes:
            assert not contacts(scene)[1:, 1:].any()
            assert (scene.lat > 0.9).all() and (scene.lat < 9.9).all()
            assert (scene.speed >= 0).all()
    assert changes > 3


@pytest.mark.slow
def test_aggressive_drivers_brake_harder_and_change_lanes_more_often():
    def braking_and_changes(settings):
        hardest, changes = 0.0, 0
        for seed in range(6):
            scenes = drive(DriverTraffic(settings), start(settings, 8, seed), seed, 200)
            hardest = max(hardest, -10 * np.diff([scene.speed[1:] for scene in scenes], axis=0).min())
            lanes = np.stack([np.asarray(ROAD.lane_of(scene.lat[1:])) for scene in scenes])
            changes += np.count_nonzero(np.diff(lanes, axis=0))
        return hardest, changes

    usual, aggressive = braking_and_changes(DriverTrafficSettings()), braking_and_changes(AggressiveTrafficSettings())
    assert aggressive[0] > usual[0] and aggressive[0] > 4.0
    assert aggressive[1] > usual[1]


def test_same_seed_same_traffic_and_slots_of_other_models_stay():
    scene = start(DriverTrafficSettings(), 6, 1)
    first, second = (drive(DriverTraffic(), scene, 4, 50)[-1] for _ in range(2))
    assert np.array_equal(first.states, second.states)
    assert not np.array_equal(first.states, drive(DriverTraffic(), scene, 5, 50)[-1].states)
    traffic, controlled = DriverTraffic(), np.arange(7) > 3
    traffic.reset(scene, ROAD, np.random.default_rng(0), controlled)
    moved = traffic.step(scene, 0.1).scene
    assert np.array_equal(moved.states[:4], scene.states[:4])
    assert (moved.lon[4:] != scene.lon[4:]).all()


def test_straight_roads_have_the_traffic_that_they_always_had():
    """Lon, lat and speed of three drivers after 10 s, as they were before roads could bend and lanes could end."""
    for settings, expected in GOLDEN.items():
        scene = start(settings, 6, 3)
        after = drive(DriverTraffic(settings), scene, 3, 100)[-1].states[[1, 3, 6], :3]
        assert after == pytest.approx(np.array(expected), rel=1e-12)


def test_drivers_want_the_speed_of_the_road_and_start_as_near_as_it_is_slow():
    traffic, slow = DriverTraffic(CALM), InitialSettings(traffic_speed=10.0, desired_speed=12.0)
    begun = traffic.start(slow, 12, np.random.default_rng(0))
    traffic.reset(begun.scene, begun.road, np.random.default_rng(0))
    assert np.median(traffic._freeway.usual_speed) == pytest.approx(12.0, rel=0.15)
    for lat in begun.road.centres:
        lon = np.sort(begun.scene.lon[begun.scene.lat == lat])
        assert np.diff(lon, prepend=-1e3).min() > 6.0 + 4.8 * 0.95


def test_trucks_want_less_speed():
    scene = start(CALM, 6, 0)
    lengths = scene.length.copy()
    lengths[[2, 4]] = 8.0, 16.0
    wanted = []
    for each in (scene, replace(scene, length=lengths)):
        traffic = DriverTraffic(CALM)
        traffic.reset(each, ROAD, np.random.default_rng(0))
        wanted.append(traffic._freeway.usual_speed[0])
    np.testing.assert_allclose(wanted[1] / wanted[0], [1, 1, 0.8, 1, 0.8, 1, 1])
