from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from simulation_fakes import ConstantPlanner, FakeBasis, FakePredictor

from coverdrive.errors import DataError, StartError
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.road import LaneEdges, Road
from coverdrive.simulation.drives.episode import EpisodeSettings, run_episode
from coverdrive.simulation.drives.outcome import Fault, Kind
from coverdrive.simulation.roads.initial import EGO, InitialSettings
from coverdrive.simulation.traffic.replay import ReplaySettings, ReplayTraffic, cut_scenarios

TIMES = 0.1 * np.arange(101)


def recording(*tracks, group=0) -> Recording:
    """Vehicles of 4.8 m × 1.9 m: (first lon [m], lat [m], speed [m/s], last second)."""
    frames = []
    for number, (lon, lat, speed, last) in enumerate(tracks):
        time = TIMES[last + 1e-6 >= TIMES]
        columns = {
            "vehicle": number, "group": group, "time": time, "lon": lon + speed * time, "lat": lat, "speed": speed,
            "heading": 0.0, "length": 4.8, "width": 1.9,
        }  # fmt: skip
        columns = {name: np.broadcast_to(values, time.shape) for name, values in columns.items()}
        frames.append(pl.DataFrame(columns).cast(dict(SCHEMA)))
    return Recording("made", pl.concat(frames), 0.1, Road.straight(), {})


SCENARIOS = cut_scenarios([recording((0, 1.8, 20, 10), (40, 1.8, 15, 10), (10, 5.4, 22, 10), (90, 9.0, 18, 4))])


def begin(place, seed=0, scenarios=SCENARIOS, **settings):
    traffic = ReplayTraffic(scenarios, ReplaySettings(place=place, **settings))
    start = traffic.start(InitialSettings(), 5, np.random.default_rng(seed))
    traffic.reset(start.scene, start.road, np.random.default_rng(0))
    return traffic, start


def test_the_ego_takes_the_place_of_a_recorded_vehicle():
    places = set()
    for seed in range(30):
        _, start = begin("replace", seed)
        scenario, own = SCENARIOS[0], start.scene.states[EGO]
        moment, slot = np.argwhere(np.isclose(scenario.states, own).all(-1))[0]
        assert start.duration == pytest.approx(10 - 0.1 * moment)
        assert start.scene.vehicles == 4 - (moment > 40)  # the replaced one is gone, the ego is there
        assert not np.isclose(start.scene.states[1:], own).all(-1).any()
        places.add(int(slot))
    assert places == {0, 1, 2}  # the last one leaves too early


def test_between_two_vehicles_is_in_the_middle_of_the_gap():
    for seed in range(10):
        _, start = begin("between", seed)
        scene = start.scene
        own, follower, leader = (scene.states[slot] for slot in (EGO, 1, 2))
        assert own[0] == pytest.approx((follower[0] + leader[0]) / 2)
        assert own[2] == pytest.approx(17.5)
        assert (own[1], own[3]) == (1.8, 0.0)
        assert scene.lon[2] - scene.lon[1] - 4.8 * 2 >= 8.0  # 4 m to each


def test_between_two_vehicles_is_in_the_lane_as_it_is_there():
    plain = recording((0, 5.4, 20, 10), (40, 5.4, 20, 10))
    along = np.array([0.0, 400.0])
    narrower = LaneEdges(along, np.array([[0.0, 3.6, 7.2, 10.8], [2.4, 4.4, 7.2, 10.8]]))
    road = replace(plain.road, changing=narrower)
    for seed in range(5):
        _, start = begin("between", seed, cut_scenarios([replace(plain, road=road)]))
        right, left = road.edges_at(start.scene.lon[EGO])[1:3]
        assert start.scene.lat[EGO] == pytest.approx((right + left) / 2)
        assert start.road is road


def test_either_gives_both():
    vehicles = {begin("either", seed)[1].scene.valid.sum() for seed in range(20)}
    assert len(vehicles) > 1


@pytest.mark.parametrize("dt", [0.1, 0.05])
def test_recorded_vehicles_drive_as_recorded_and_go_when_they_went(dt):
    traffic, start = begin("between", seed=2)
    first = round((10 - start.duration) / 0.1)
    scene = start.scene
    for k in range(1, round(start.duration / dt) + 1):
        scene = traffic.step(scene, dt).scene
        time = first * 0.1 + k * dt
        assert np.array_equal(scene.states[EGO], start.scene.states[EGO])
        assert scene.lon[1:4] == pytest.approx(np.array([0, 40, 10]) + np.array([20, 15, 22]) * time)
        assert scene.valid[:4].all()
        if scene.vehicles == 5:
            assert scene.valid[4] == (time < 4 + 1e-6)


def test_a_follower_that_runs_into_the_ego_is_at_fault():
    scenarios = cut_scenarios([recording((0, 1.8, 20, 10), (60, 1.8, 20, 10))])
    predictor = FakePredictor(FakeBasis.make((0.0,), (0.0,)))
    traffic = ReplayTraffic(scenarios, ReplaySettings(place="between"))
    trace = run_episode(predictor, ConstantPlanner(-5.0), traffic, EpisodeSettings(), 3, 0)
    assert (trace.outcome.kind, trace.outcome.at_fault) == (Kind.REAR_END, Fault.OTHER)


def test_an_episode_ends_with_its_recording():
    predictor = FakePredictor(FakeBasis.make((0.0,), (0.0,)))
    apart = cut_scenarios([recording((0, 1.8, 20, 10), (40, 1.8, 20, 10), (10, 5.4, 20, 10))])
    trace = run_episode(predictor, ConstantPlanner(), ReplayTraffic(apart, ReplaySettings()), EpisodeSettings(), 3, 1)
    assert trace.outcome.kind is Kind.FINISHED
    assert trace.outcome.time == pytest.approx(0.1 * len(trace)) and 5 <= trace.outcome.time <= 10


def test_groups_of_a_recording_are_scenarios_of_their_own():
    two = recording((0, 1.8, 20, 10), (40, 1.8, 15, 10))
    group = (pl.col("time") > 5.05).cast(pl.Int64)
    both = Recording("made", two.table.with_columns(group=group), 0.1, two.road, {})
    assert [len(scenario.states) for scenario in cut_scenarios([both])] == [51, 50]


def test_moments_without_a_vehicle_are_passed_over():
    early = recording((0, 1.8, 20, 5), (40, 1.8, 20, 5))
    late = early.table.with_columns(vehicle=pl.col("vehicle") + 2, time=pl.col("time") + 20.0)
    scenarios = cut_scenarios([Recording("made", pl.concat([early.table, late]), 0.1, early.road, {})])
    for seed in range(20):
        _, start = begin("between", seed, scenarios, shortest=3.0)
        assert start.scene.valid.sum() == 3


def test_scenes_that_are_too_short_or_too_full_are_refused():
    with pytest.raises(DataError, match=r"none of the 1 recorded scenes lasts 12.0 s"):
        ReplayTraffic(SCENARIOS, ReplaySettings(shortest=12.0))
    full = cut_scenarios([recording((0, 1.8, 20, 10), (9, 1.8, 20, 10))])
    with pytest.raises(StartError, match="fits nowhere"):
        begin("between", scenarios=full)


def test_a_vehicle_that_would_appear_on_the_ego_comes_when_there_is_room():
    late = recording((0, 1.8, 20, 10), (40, 1.8, 20, 10), (20, 1.8, 20, 10))
    table = late.table.filter((pl.col("vehicle") != 2) | (pl.col("time") >= 1.95))
    (scenario,) = cut_scenarios([replace(late, table=table)])
    traffic = ReplayTraffic([scenario], ReplaySettings(place="between", shortest=9.9))
    start = traffic.start(InitialSettings(), 3, np.random.default_rng(0))
    traffic.reset(start.scene, start.road, np.random.default_rng(0))
    scene, own = start.scene, start.scene.states[EGO].copy()
    assert own[0] == pytest.approx(20.0, abs=2.5)
    came = None
    for k in range(1, 90):
        own[0] += 0.1 * (20.0 if k < 30 else 14.0)
        own[2] = 20.0 if k < 30 else 14.0
        scene.lon[EGO], scene.speed[EGO] = own[0] - 0.1 * own[2], own[2]
        scene = traffic.step(scene, 0.1).scene
        if scene.valid[3] and came is None:
            came = scene.lon[3] - own[0] - 4.8
    assert came is not None and 4.0 <= came < 5.0
