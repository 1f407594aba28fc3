"""Recorded vehicles drive as they were recorded, but for those in whose way the ego is: they stay behind it."""

from dataclasses import replace

import numpy as np
import pytest
import test_replay
from simulation_fakes import ConstantPlanner, FakeBasis, FakePredictor
from test_replay import SCENARIOS, recording

from coverdrive.planning.problem.vehicle import step
from coverdrive.scene import Scene
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate
from coverdrive.simulation.drives.episode import EpisodeSettings, run_episode
from coverdrive.simulation.drives.fault import collision_at
from coverdrive.simulation.drives.outcome import Fault, Kind
from coverdrive.simulation.roads.initial import EGO, InitialSettings
from coverdrive.simulation.traffic.motion import with_states
from coverdrive.simulation.traffic.reactive_replay import ReactiveReplaySettings, ReactiveReplayTraffic
from coverdrive.simulation.traffic.replay import ReplayTraffic, Scenario, cut_scenarios

PREDICTOR = FakePredictor(FakeBasis.make((0.0,), (0.0,)))


class Braking(ConstantPlanner):
    """Brakes as hard as it is told to, until it stands."""

    def plan(self, state, paths, road):
        self.inputs[0] = max(self.inputs[1, 0], -state[2] / 0.1), 0.0
        return super().plan(state, paths, road)


BEHIND = cut_scenarios([recording((0, 1.8, 20, 10), (60, 1.8, 20, 10))])
"""two vehicles, between which there is room for the ego"""


def both(scenarios, seed: int = 0, place: str = "between") -> tuple[ReplayTraffic, ReactiveReplayTraffic, Scene]:
    """Traffic that does not react, traffic that does, and the start of both."""
    settings = ReactiveReplaySettings(place=place)
    traffics = ReplayTraffic(scenarios, settings), ReactiveReplayTraffic(scenarios, settings)
    for traffic in traffics:
        start = traffic.start(InitialSettings(), 5, np.random.default_rng(seed))
        traffic.reset(start.scene, start.road, np.random.default_rng(seed))
    return *traffics, start.scene


def driven(traffic: ReplayTraffic, scene: Scene, inputs, dt: float = 0.1) -> Scene:
    """The scenes, one after another, in which the ego drives inputs (acceleration [m/s²], yaw rate [rad/s])."""
    scenes = [scene]
    for each in inputs:
        after = traffic.step(scenes[-1], dt).scene
        states = after.states
        states[EGO] = step(scenes[-1].states[EGO], np.array(each, dtype=float), dt)
        scenes.append(with_states(after, states))
    return scenes


@pytest.mark.parametrize(("seed", "dt"), [(0, 0.1), (1, 0.05), (2, 0.13)])
def test_without_an_ego_in_the_way_all_is_as_recorded(seed: int, dt: float) -> None:
    busy = cut_scenarios(generate(GeneratedSettings(scenes=2, duration=9.0, vehicles=(12, 16)), seed))
    for place in ("between", "replace"):
        plain, reacting, scene = both(busy, seed, place)
        beside = scene.states
        beside[EGO, 1] = -50.0
        scene = with_states(scene, beside)
        for _ in range(int(4.5 / dt)):
            expected, found = plain.step(scene, dt), reacting.step(scene, dt)
            assert np.array_equal(expected.scene.states, found.scene.states)
            assert np.array_equal(expected.scene.valid, found.scene.valid)
            scene = found.scene


@pytest.mark.parametrize("deceleration", [1.0, 7.5])
def test_who_is_behind_a_braking_ego_does_not_hit_it(deceleration: float) -> None:
    """A replay that does not react does."""
    plain, reacting, _ = both(BEHIND)
    planner = Braking(-deceleration)
    hit = run_episode(PREDICTOR, planner, plain, EpisodeSettings(), 3, 0)
    assert (hit.outcome.kind, hit.outcome.at_fault) == (Kind.REAR_END, Fault.OTHER)
    trace = run_episode(PREDICTOR, planner, reacting, EpisodeSettings(), 3, 0)
    assert trace.outcome.kind is Kind.FINISHED
    gap = trace.scene.lon[:, EGO] - trace.scene.lon[:, 1] - 4.8
    assert gap.min() > 0.5
    speed = trace.scene.speed[:, 1]
    assert np.diff(speed).min() > -0.8 - 1e-9 and np.all(speed >= 0)
    assert np.diff(trace.scene.lon[:, 1]) == pytest.approx(0.1 * (speed[1:] + speed[:-1]) / 2, abs=0.02)


def test_a_queue_forms_behind_the_ego_and_nobody_in_it_collides() -> None:
    scenarios = cut_scenarios([recording(*((30.0 * k, 1.8, 20, 10) for k in range(4)), (95, 5.4, 22, 10))])
    _, reacting, scene = both(scenarios, 3)
    scenes = driven(reacting, scene, [(-4.0, 0.0)] * 50)
    behind = [slot for slot in range(1, scene.vehicles) if scene.lon[slot] < scene.lon[EGO] and scene.lat[slot] < 3]
    assert len(behind) >= 1
    for each in scenes:
        order = np.sort([each.lon[slot] for slot in (EGO, *behind)])
        assert (np.diff(order) > 4.8).all()
    speeds = [scenes[-1].speed[slot] for slot in sorted(behind, key=lambda slot: -scene.lon[slot])]
    assert speeds[0] < 6 and max(speeds) < 19 and speeds == sorted(speeds)
    free = [slot for slot in range(1, scene.vehicles) if slot not in behind]
    assert scenes[-1].speed[free] == pytest.approx(scene.speed[free])


def test_it_goes_back_to_where_it_was_recorded_once_the_way_is_free(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(test_replay, "TIMES", 0.1 * np.arange(401))
    plain, reacting, scene = both(cut_scenarios([recording((0, 1.8, 20, 40), (60, 1.8, 20, 40))]), 2)
    inputs = [(-3.0, 0.0)] * 20 + [(0.0, -0.5)] * 10 + [(0.0, 0.0)] * 190
    expected, found = driven(plain, scene, inputs), driven(reacting, scene, inputs)
    late = np.array([one.lon[1] - other.lon[1] for one, other in zip(expected, found, strict=True)])
    assert late.max() > 10 and np.all(late > -1e-9)
    assert np.array_equal(expected[-1].states[1:], found[-1].states[1:])
    speed = np.array([each.speed[1] for each in found])
    assert np.abs(np.diff(speed)).max() < 0.8 and speed.max() < 30


def test_nobody_brakes_harder_than_it_may_to_be_where_it_was_recorded() -> None:
    """Who is late, and just about back, as the recording brakes at 7.5 m/s²."""
    time = np.arange(0, 16.05, 0.1)
    speed = np.where(time < 8, 20.0, np.maximum(20 - 7.5 * (time - 8), 10.0))
    lon = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * 0.1)])
    states = np.stack([[lon + at, np.full(len(lon), 1.8), speed, 0 * lon] for at in (0.0, 60.0)], axis=1)
    scenario = cut_scenarios([recording((0, 1.8, 20, 10), (60, 1.8, 20, 10))])[0]
    scenario = replace(scenario, states=states.T, valid=np.ones((len(lon), 2), bool), dt=0.1)
    hardest = 0.0
    for braked in (2, 4, 6, 8, 10):
        _, traffic, scene = both([scenario])
        inputs = [(-3.0, 0.0)] * braked + [(0.0, 0.0)] * 10 + [(3.0, 0.0)] * 60 + [(0.0, 0.0)] * 50
        speeds = np.array([each.speed for each in driven(traffic, scene, inputs)])[:, 1:]
        hardest = max(hardest, float(-np.diff(speeds, axis=0).min() / 0.1))
    assert 7.0 < hardest <= 8.0 + 1e-6


def test_a_late_vehicle_goes_where_its_recording_ends() -> None:
    scenarios = cut_scenarios([recording((0, 1.8, 20, 7), (60, 1.8, 20, 10))])
    _, reacting, scene = both(scenarios)
    scenes = driven(reacting, scene, [(-2.0, 0.0)] * 10 + [(0.0, 0.0)] * 80)
    last = max(each.lon[1] for each in scenes if each.valid[1])
    assert not scenes[-1].valid[1] and last == pytest.approx(140.0, abs=2.5)


def test_who_followed_closely_when_it_was_recorded_does_not_brake_at_the_start() -> None:
    close = cut_scenarios([recording((0, 1.8, 20, 10), (10, 1.8, 20, 10))])  # 0.26 s
    for seed in range(20):
        plain, reacting, scene = both(close, seed, "replace")
        if scene.lon[1] < scene.lon[EGO]:
            for one, other in zip(*(driven(each, scene, [(0.0, 0.0)] * 40) for each in (plain, reacting)), strict=True):
                assert one.states == pytest.approx(other.states, abs=0.02)
            return
    pytest.fail("the ego never replaced the first")


def test_many_random_drives_end_without_anybody_running_into_an_ego_that_keeps_its_lane() -> None:
    busy = cut_scenarios(generate(GeneratedSettings(scenes=3, duration=10.0, vehicles=(14, 18)), 5))
    hit = {ReplayTraffic: 0, ReactiveReplayTraffic: 0}
    for seed in range(25):
        plain, reacting, scene = both(busy, seed, "either")
        for traffic in (plain, reacting):
            scenes = driven(traffic, scene, [(-2.5, 0.0)] * 50)
            found = [collision_at(k, scenes[: k + 1], 0.1, SCENARIOS[0].road) for k in range(1, len(scenes))]
            hit[type(traffic)] += any(each is not None and each.kind is Kind.REAR_END for each in found)
    assert hit[ReplayTraffic] > 5 and hit[ReactiveReplayTraffic] == 0


def test_the_same_seed_gives_the_same_drive() -> None:
    scenario: Scenario = SCENARIOS[0]
    first, second = (
        run_episode(PREDICTOR, ConstantPlanner(-3.0), traffic, EpisodeSettings(), 3, 4)
        for traffic in (ReactiveReplayTraffic([scenario], ReactiveReplaySettings()) for _ in range(2))
    )
    assert np.array_equal(first.scene.states, second.scene.states)
