import time
from dataclasses import replace

import numpy as np
import pytest
from simulation_fakes import ConstantPlanner, FakeBasis, FakePredictor, make_scene

import coverdrive.simulation.drives.episode as episode
from coverdrive.errors import DataError
from coverdrive.plan import Plan, Status
from coverdrive.planning.problem.vehicle import step as vehicle_step
from coverdrive.simulation.drives.episode import EpisodeSettings, run_episode
from coverdrive.simulation.drives.outcome import Fault, Kind, contacts
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.trial import measure
from coverdrive.simulation.roads.initial import EGO, InitialSettings
from coverdrive.simulation.traffic.set_sampling import SetSamplingTraffic
from shape_checks import unchecked

PREDICTOR = FakePredictor(FakeBasis.make())
SCENE_FIELDS = ("lon", "lat", "speed", "heading", "length", "width", "valid")


def run(seed, planner=None, duration=2.0, vehicles=4) -> Trace:
    return run_episode(
        PREDICTOR,
        planner or ConstantPlanner(),
        SetSamplingTraffic(PREDICTOR),
        EpisodeSettings(duration=duration),
        vehicles,
        seed,
    )


def run_from(monkeypatch, scene, planner, predictor=PREDICTOR, **settings) -> Trace:
    monkeypatch.setattr(episode, "initial_scene", lambda *_: scene)
    return run_episode(
        predictor, planner, SetSamplingTraffic(predictor), EpisodeSettings(**settings), scene.vehicles - 1, 0
    )


def same_drive(first, second) -> bool:
    return all(np.array_equal(getattr(first.scene, name), getattr(second.scene, name)) for name in SCENE_FIELDS)


def test_same_seed_same_trace_also_with_used_participants():
    planner, traffic = ConstantPlanner(), SetSamplingTraffic(PREDICTOR)
    settings = EpisodeSettings(duration=2.0)
    seed = np.random.SeedSequence(5, spawn_key=(3,))
    first, second = (run_episode(PREDICTOR, planner, traffic, settings, 5, seed) for _ in range(2))
    assert same_drive(first, second)
    assert np.array_equal(first.base, second.base)
    assert first.outcome == second.outcome
    assert planner.resets == 2


def test_another_seed_is_another_drive():
    assert not same_drive(run(1), run(2))


def test_start_and_traffic_have_different_random_numbers(monkeypatch):
    drawn = []

    def start(initial, vehicles, rng):
        drawn.append(rng.random())
        return make_scene([0, -200], [1.8, 9.0])

    class Traffic(SetSamplingTraffic):
        def reset(self, scene, road, rng):
            drawn.append(rng.random())
            super().reset(scene, road, rng)

    monkeypatch.setattr(episode, "initial_scene", start)
    run_episode(PREDICTOR, ConstantPlanner(), Traffic(PREDICTOR), EpisodeSettings(duration=0.1), 1, 7)
    assert len(set(drawn)) == 2


def test_the_start_does_not_depend_on_the_planner():
    assert np.array_equal(run(1).scene.lon[0], run(1, ConstantPlanner(acceleration=1.0)).scene.lon[0])


def test_the_ego_moves_by_the_first_input_of_every_plan():
    trace = run(0, ConstantPlanner(acceleration=-1.0, yaw_rate=0.01))
    own = trace.scene.states[:, EGO]
    for k, plan in enumerate(trace.plans):
        assert own[k + 1] == pytest.approx(vehicle_step(own[k], plan.inputs[0], 0.1))


def test_every_plan_starts_from_the_state_and_paths_of_its_moment(monkeypatch):
    trace = run_from(
        monkeypatch, make_scene([-200, 0, 0, 0, 30], [1.8, 1.8, 5.4, 9, 1.8]), ConstantPlanner(), duration=2.0
    )
    assert len(trace) == len(trace.paths) == 20
    assert trace.time == pytest.approx(0.1 * np.arange(21))
    for k in range(len(trace)):
        assert np.array_equal(trace.plans[k].states[0], trace.scene.states[k, EGO])
        first = trace.paths[k]
        assert first.points.shape[1] == 13
        assert first.dt == 0.25
        assert set(first.vehicle.tolist()) == {1, 2, 3, 4}
        assert np.array_equal(first.points[:, 0, 0], trace.scene.lon[k, first.vehicle])


def test_planning_time_includes_the_prediction():
    trace = run(0)
    assert (trace.planning_seconds >= trace.prediction_seconds).all()
    assert (trace.prediction_seconds > 0).all()


class WaitingPlanner(ConstantPlanner):
    """Waits for something else than the processor."""

    def plan(self, state, paths, road):
        time.sleep(0.1)
        return super().plan(state, paths, road)


def test_waiting_takes_wall_time_but_no_processor_time():
    trace = run(0, WaitingPlanner(), duration=0.3)
    assert (trace.wall_seconds >= 0.1).all()
    assert np.median(trace.planning_seconds) < 0.1


def test_without_contact_the_episode_lasts_its_duration(monkeypatch):
    trace = run_from(monkeypatch, make_scene([0, -200], [1.8, 9.0]), ConstantPlanner(), duration=3.0)
    assert trace.outcome.kind is Kind.FINISHED
    assert trace.outcome.time == pytest.approx(3.0)
    assert trace.outcome.partner is None


def test_episode_ends_at_the_first_collision(monkeypatch):
    straight = FakePredictor(FakeBasis.make(accelerations=(0.0,), shifts=(0.0,)))
    scene = make_scene([0, 15.0], [1.8, 1.8], speed=[30.0, 20.0])
    trace = run_from(monkeypatch, scene, ConstantPlanner(), straight, duration=5.0)
    assert trace.outcome.kind is Kind.FRONTAL
    assert trace.outcome.at_fault is Fault.EGO
    assert trace.outcome.partner == 1
    assert trace.outcome.time == pytest.approx(1.1)  # 10.2 m between the bumpers at 10 m/s
    assert trace.time[-1] == pytest.approx(trace.outcome.time)
    touching = contacts(trace.scene)[:, EGO].any(-1)
    assert touching.tolist() == [False] * len(trace) + [True]


def test_the_ego_hit_from_behind(monkeypatch):
    straight = FakePredictor(FakeBasis.make(accelerations=(0.0,), shifts=(0.0,)))
    scene = make_scene([0, -15.0], [1.8, 1.8], speed=[10.0, 20.0])
    trace = run_from(monkeypatch, scene, ConstantPlanner(), straight, duration=5.0)
    assert (trace.outcome.kind, trace.outcome.at_fault) == (Kind.REAR_END, Fault.OTHER)
    assert trace.stuck[0, 1]


def test_the_ego_cuts_in_and_is_hit_from_behind(monkeypatch):
    """The bodies overlap across the road after 1.2 s, 10 m ahead of a vehicle that is 10 m/s faster and needs 20 m."""
    straight = FakePredictor(FakeBasis.make(accelerations=(0.0,), shifts=(0.0,)))
    scene = make_scene([0, -26.8], [1.8, 5.4], speed=[20.0, 30.0])
    trace = run_from(monkeypatch, scene, ConstantPlanner(yaw_rate=0.1), straight, duration=5.0)
    assert (trace.outcome.kind, trace.outcome.at_fault) == (Kind.REAR_END, Fault.EGO)


def test_the_ego_swerves_into_its_neighbour(monkeypatch):
    straight = FakePredictor(FakeBasis.make(accelerations=(0.0,), shifts=(0.0,)))
    trace = run_from(
        monkeypatch, make_scene([0, 0.0], [1.8, 5.4]), ConstantPlanner(yaw_rate=0.1), straight, duration=5.0
    )
    assert (trace.outcome.kind, trace.outcome.at_fault) == (Kind.SIDE, Fault.EGO)


def test_braking_ends_at_rest():
    trace = run(1, ConstantPlanner(acceleration=-8.0), duration=6.0)
    assert trace.scene.speed[-1, EGO] == 0 and (trace.scene.speed[:, EGO] >= 0).all()
    found = measure(trace, 0, 0)
    assert found["hardest_braking"] == 8.0 and found["jerk_longitudinal"] > 0  # at rest nothing brakes


@pytest.mark.parametrize(
    "changes",
    [
        {"vehicle": lambda each: each + 100},
        {"vehicle": lambda each: each * 0},
        {"vehicle": lambda each: each.astype(float)},
        {
            "points": lambda each: np.dstack([each, each[..., :1]]),
            "half_sizes": lambda each: np.dstack([each, each[..., :1]]),
        },
        {"weight": lambda each: np.ones(99)},
        {"ellipses": lambda each: np.ones((1, 2, 3))},
    ],
    ids=["nobody", "the ego", "no numbers of slots", "three coordinates", "more weights", "other ellipses"],
)
def test_a_belief_that_foretells_what_nobody_can_use_is_named(changes):
    class Odd(FakePredictor):
        def predict(self, *args):
            paths = super().predict(*args)
            return replace(paths, **{name: change(getattr(paths, name)) for name, change in changes.items()})

    with unchecked(), pytest.raises(ValueError) as caught:
        run_episode(Odd(FakeBasis.make()), ConstantPlanner(), SetSamplingTraffic(PREDICTOR), EpisodeSettings(), 4, 0)
    assert "expected" in str(caught.value) and "predictor" in " ".join(caught.value.__notes__)


@pytest.mark.parametrize("inputs", [(np.nan, 0.0), (1e4, 0.0), (0.0, -50.0)])
def test_a_planner_that_asks_for_what_no_car_can_do_is_named(inputs):
    planner = ConstantPlanner()
    planner.inputs = np.tile(inputs, (12, 1))
    planner.plan = lambda *_: replace(ConstantPlanner().plan(np.zeros(4), None, None), inputs=planner.inputs)
    with pytest.raises(DataError, match=r"planner ConstantPlanner asks for .* at most 30 m/s² and .* 5 rad/s"):
        run(1, planner)


@pytest.mark.parametrize(
    ("inputs", "slack", "complaint"),
    [
        (np.zeros((0, 2)), np.zeros(0), r"asks for \[\]; expected rows of an acceleration"),
        (np.zeros((12, 2)), None, "slack of the plan: expected an array, got None"),
        (np.zeros((12, 2)), np.zeros(3), r"expected slack of the plan of the shape \(12,\), got \(3,\)"),
    ],
)
def test_plans_that_nobody_can_measure_are_named_at_once(inputs, slack, complaint):
    planner = ConstantPlanner()
    planner.plan = lambda *_: Plan(np.zeros((len(inputs) + 1, 4)), inputs, slack, Status.SOLVED, 0.0, 0.0, planner.dt)
    with unchecked(), pytest.raises((DataError, TypeError, ValueError), match=complaint):
        run(1, planner)


def test_traffic_that_loses_somebody_is_named(monkeypatch):
    class Losing(SetSamplingTraffic):
        def step(self, scene, dt):
            moved = super().step(scene, dt)
            moved.scene.lon[2] = np.nan
            return moved

    with pytest.raises(DataError, match=r"Losing moved vehicle 2 to the state \[nan"):
        run_episode(PREDICTOR, ConstantPlanner(), Losing(PREDICTOR), EpisodeSettings(duration=1.0), 4, 0)


def test_settings_reach_the_start():
    settings = EpisodeSettings(duration=0.3, initial=InitialSettings(lanes=4, ego_speed=15.0))
    trace = run_episode(PREDICTOR, ConstantPlanner(), SetSamplingTraffic(PREDICTOR), settings, 3, 0)
    assert trace.road.lanes == 4
    assert trace.scene.speed[0, EGO] == 15.0
