"""The environment: Gymnasium's own checks, our simulation's episodes, and what agents are told and rewarded for."""

import pickle
import time
from copy import deepcopy

import gymnasium
import numpy as np
import pytest
from driving_fakes import PREDICTOR, SETTINGS, told
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from simulation_fakes import FakePredictor, make_scene

import coverdrive.bridges.gymnasium as bridge
import coverdrive.simulation.drives.episode as episode
from coverdrive.bridges.gymnasium import ACTION, NAME, Motorway, RewardSettings
from coverdrive.bridges.observations import observation_of
from coverdrive.driving.driver import Driver
from coverdrive.errors import SettingError
from coverdrive.planning.problem.vehicle import VehicleSettings
from coverdrive.prediction.learning.affordance import FEATURES, affordance
from coverdrive.road import Road
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.drives.outcome import Kind
from coverdrive.simulation.measures.misses import find_windows
from coverdrive.simulation.measures.trial import measure
from coverdrive.simulation.roads.initial import InitialSettings
from coverdrive.simulation.studies.study import simulate
from coverdrive.simulation.traffic.set_sampling import SetSamplingTraffic
from shape_checks import unchecked

SHORT = EpisodeSettings(duration=1.0)


@pytest.mark.parametrize(
    ("traffic", "observation", "action"),
    [
        ("drivers", "affordance", "continuous"),
        ("aggressive", "scene", "discrete"),
        ("set-sampling", "scene", "continuous"),
        ("mixed", "affordance", "discrete"),
    ],
)
def test_gymnasium_finds_nothing_wrong(traffic: str, observation: str, action: str) -> None:
    """Warnings are errors here."""
    given = {"traffic": traffic, "observation": observation, "action": action, "predictor": PREDICTOR}
    check_env(gymnasium.make(NAME, vehicles=(3, 5), episode=SHORT, **given).unwrapped)


def drive(env: gymnasium.Env, seed: int | None, actions: list) -> list:
    """Everything that is told in an episode."""
    result = [env.reset(seed=seed)]
    for action in actions:
        result.append(env.step(action))
        if result[-1][2] or result[-1][3]:
            break
    return result


def same(one: list, other: list) -> bool:
    return len(one) == len(other) and all(
        np.array_equal(a[0], b[0]) and a[1:] == b[1:] for a, b in zip(one, other, strict=True)
    )


def test_seeds_reproduce_and_others_differ() -> None:
    env = gymnasium.make(NAME, episode=SHORT, vehicles=(3, 4, 5))
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(10)]
    first, second, other, unseeded = (drive(env, seed, actions) for seed in (5, 5, 6, None))
    assert same(first, second)
    assert not same(first, other) and not same(other, unseeded)
    env.reset(seed=5)
    later = [drive(env, None, actions)]
    env.reset(seed=5)
    assert same(later[0], drive(env, None, actions))


@pytest.mark.parametrize("mode", ["sync", pytest.param("async", marks=pytest.mark.slow)])
@pytest.mark.parametrize("observation", ["affordance", "scene"])
def test_many_at_once_are_as_each_alone(mode: str, observation: str) -> None:
    how, given = {"context": "spawn"} if mode == "async" else None, {"observation": observation, "episode": SHORT}
    envs = gymnasium.make_vec(NAME, num_envs=2, vectorization_mode=mode, vector_kwargs=how, **given)
    actions = np.random.default_rng(0).uniform(-0.5, 0.5, (10, 2, 2)).astype(np.float32)
    seen = [envs.reset(seed=[3, 8])[0], *(envs.step(each)[0] for each in actions)]
    envs.close()
    for index, seed in enumerate((3, 8)):
        alone = drive(gymnasium.make(NAME, **given), seed, list(actions[:, index]))
        assert len(alone) == len(seen)
        assert all(equal(of(many, index), each[0]) for many, each in zip(seen, alone, strict=True))


def of(seen: np.ndarray | dict, index: int) -> np.ndarray | dict:
    """What one of several is shown."""
    return {name: each[index] for name, each in seen.items()} if isinstance(seen, dict) else seen[index]


def equal(one: np.ndarray | dict, other: np.ndarray | dict) -> bool:
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(np.array_equal(one[name], other[name]) for name in one)
    return np.array_equal(one, other)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_many_reset_themselves_and_go_on_as_each_would(mode: AutoresetMode) -> None:
    given = {"observation": "scene", "vehicles": (3, 6), "slots": 5, "episode": EpisodeSettings(duration=0.3)}
    envs, stay = gymnasium.make_vec(NAME, num_envs=3, vector_kwargs={"autoreset_mode": mode}, **given), np.zeros((3, 2))
    assert {name: each.shape for name, each in envs.observation_space.items()} == {
        "vehicles": (3, 5, 6), "mask": (3, 5), "road": (3, 4)
    }  # fmt: skip
    seen, _ = envs.reset(seed=4)  # one after another: 4, 5, 6
    alone = [gymnasium.make(NAME, **given) for _ in range(3)]
    ours = [env.reset(seed=4 + index)[0] for index, env in enumerate(alone)]
    assert seen in envs.observation_space
    assert len({tuple(each["mask"]) for each in ours}) > 1
    for _ in range(3):
        assert all(equal(of(seen, index), each) for index, each in enumerate(ours))
        seen, _, ended, late, info = envs.step(stay)
        ours = [env.step(np.zeros(2))[0] for env in alone]
    assert late.all() and not ended.any()
    last = info["final_obs"] if mode is AutoresetMode.SAME_STEP else [of(seen, index) for index in range(3)]
    assert all(map(equal, last, ours))
    if mode is AutoresetMode.NEXT_STEP:
        seen, rewards, ended, late, _ = envs.step(stay)
        assert not (rewards.any() or ended.any() or late.any())
    ours = [env.reset()[0] for env in alone]
    assert all(equal(of(seen, index), each) for index, each in enumerate(ours))
    seen, ours = envs.step(stay)[0], [env.step(np.zeros(2))[0] for env in alone]
    assert all(equal(of(seen, index), each) for index, each in enumerate(ours))


@pytest.mark.parametrize("seed", [1, 4])
def test_our_driver_in_it_drives_as_in_our_simulation(seed: int) -> None:
    own = simulate(PREDICTOR, traffic="drivers", vehicles=5, seed=seed, episode=SETTINGS)
    env, driver = Motorway(episode=SETTINGS), Driver(PREDICTOR)
    env.reset(seed=seed)
    over, steps, info = False, 0, {}
    while not over:
        command = driver.step(*told(env.scene), env.road)
        _, _, ended, late, info = env.step(np.array([command.acceleration, command.yaw_rate]) / ACTION)
        over, steps = ended or late, steps + 1
    assert steps == len(own)
    assert info["collision"] == ("" if own.outcome.kind is Kind.FINISHED else own.outcome.kind.value)
    assert env.scene.states == pytest.approx(own.scene.states[-1], abs=1e-9)


def test_predicted_sets_and_misses_are_told_and_drives_can_be_measured() -> None:
    env = Motorway("aggressive", 6, predictor=PREDICTOR, sets=True, episode=EpisodeSettings(duration=5.0))
    _, info = env.reset(seed=2)
    assert set(info["sets"].vehicle.tolist()) == {1, 2, 3, 4, 5, 6}
    told = drive(env, 2, [np.zeros(2)] * 60)
    assert "misses" not in told[-2][-1]
    windows, trace = find_windows(env.trace()), env.trace()
    last = told[-1][-1]
    assert (last["windows"], last["misses"]) == (windows.seen.sum(), windows.missed.sum())
    assert last["windows"] > 0
    assert measure(trace, 2, 0)["distance"] == pytest.approx(trace.scene.lon[-1, 0] - trace.scene.lon[0, 0])
    with pytest.raises(SettingError, match="sets=True"):
        Motorway().trace()


def test_recordings_are_replayed_until_they_end() -> None:
    recordings = generate(GeneratedSettings(scenes=2, duration=8.0, lanes=2, vehicles=(6, 8)))
    env = gymnasium.make(
        NAME, traffic="replay", recordings=recordings, observation="scene", action="discrete"
    ).unwrapped
    check_env(env)
    for seed in range(4):
        told = drive(env, seed, [4] * 100)
        assert told[-1][2] or told[-1][3]
        assert 2 <= len(told) <= 81
        assert env.road.lanes == 2


def test_other_traffic_drives_on_a_road_like_the_recorded_one() -> None:
    recordings = generate(GeneratedSettings(scenes=3, duration=8.0, lanes=2, vehicles=(6, 8)))
    env = Motorway("drivers", 6, recordings=recordings)
    env.reset(seed=3)
    begun = simulate(PREDICTOR, traffic="drivers", vehicles=6, seed=3, recordings=recordings).scene.states[0]
    assert env.road.lanes == 2 and np.array_equal(env.scene.states, begun)


def test_environments_share_neither_traffic_nor_what_was_learned() -> None:
    class Counting(SetSamplingTraffic):
        steps = 0

        def step(self, scene, dt):
            self.steps += 1
            return super().step(scene, dt)

    class Learning(FakePredictor):
        period, begun = 0.1, 0

        def anew(self):
            Learning.begun += 1
            return self

    traffic = Counting(PREDICTOR)
    one = Motorway(traffic, predictor=Learning(PREDICTOR.basis), sets=True)
    for _ in range(2):
        drive(one, 5, [np.zeros(2)] * 3)
    assert traffic.steps == 0 and Learning.begun == 2
    assert pickle.loads(pickle.dumps(Motorway("drivers"))).reset(seed=1)[0].shape == one.reset(seed=1)[0].shape


def env_of(monkeypatch: pytest.MonkeyPatch, scene, **given) -> Motorway:
    """An environment that begins with a scene."""
    monkeypatch.setattr(episode, "initial_scene", lambda *_: scene)
    env = Motorway("set-sampling", predictor=PREDICTOR, **given)
    env.reset(seed=0)
    return env


def test_a_contact_ends_it_and_says_whose_fault_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    env = env_of(monkeypatch, make_scene([0, 12.0], [1.8, 1.8], speed=[30.0, 15.0]))
    rewards, ended, info = [], False, {}
    while not ended:
        _, reward, ended, late, info = env.step(np.zeros(2))
        rewards.append(reward)
    assert not late
    assert info["collision"] == "frontal" and info["at_fault"] == "ego" and info["partner"] == 1
    assert rewards[0] == pytest.approx(0.1)  # 30 m/s, no discomfort
    assert rewards[-1] == pytest.approx(0.1 - RewardSettings().contact)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(np.zeros(2))


def test_leaving_the_road_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    env = env_of(monkeypatch, make_scene([0, -200.0], [1.0, 9.0], speed=[15.0, 20.0], heading=[-0.3, 0.0]))
    ended, info = False, {}
    while not ended:
        assert info.get("off_road") in (None, False)
        _, _, ended, _, info = env.step(np.array([0.0, 0.0]))
    assert info["off_road"] and info["collision"] == ""
    assert env.scene.lat[0] < 0


def test_the_time_ends_it_without_a_loss(monkeypatch: pytest.MonkeyPatch) -> None:
    env = env_of(monkeypatch, make_scene([0, -200.0], [1.8, 9.0], speed=[15.0, 20.0]), episode=SHORT)
    told = [env.step(np.array([0.25, 0.0])) for _ in range(10)]
    assert [each[3] for each in told] == [False] * 9 + [True]
    assert not any(each[2] for each in told)
    expected = 0.1 * ((15.0 + 10 * 0.2) / 30.0 - 0.02 * 4.0)
    assert told[-1][1] == pytest.approx(expected)


def test_nobody_drives_beyond_the_limits_of_the_car(monkeypatch: pytest.MonkeyPatch) -> None:
    env = env_of(monkeypatch, make_scene([0, -200.0], [5.4, 9.0], speed=[20.0, 20.0]))
    for _ in range(3):
        before = env.scene.states[0]
        env.step(np.array([1.0, 1.0]))
        assert env.scene.states[0][2] - before[2] == pytest.approx(0.1 * VehicleSettings().max_acceleration)
    assert 20 * (env.scene.states[0][3] - before[3]) / 0.1 <= VehicleSettings().max_lateral_acceleration + 1e-9


@pytest.mark.parametrize(("action", "lane", "speed"), [(7, 2, 20.0), (1, 0, 20.0), (5, 1, 40.0), (3, 1, 0.0)])
def test_discrete_actions_choose_lane_and_speed(
    monkeypatch: pytest.MonkeyPatch, action: int, lane: int, speed: float
) -> None:
    scene = make_scene([0, -500.0], [5.4, 9.0], speed=[20.0, 20.0])
    env = env_of(monkeypatch, scene, action="discrete", episode=EpisodeSettings(duration=10.0))
    late, ended = False, False
    while not late:
        lane_now = int(env.road.lane_of(env.scene.lat[0]))
        _, _, ended, late, _ = env.step(action if lane_now == 1 else 4 if action in (1, 7) else action)
        assert not ended
    assert env.scene.lat[0] == pytest.approx(env.road.centres[lane], abs=0.1)
    assert env.scene.speed[0] == pytest.approx(speed, abs=0.01)


def test_roads_bend_and_lanes_end() -> None:
    bent = InitialSettings(curvature=((0.0, 0.0), (100.0, 0.005)), ramp=60.0)
    env = Motorway(vehicles=3, action="discrete", episode=EpisodeSettings(initial=bent, duration=12.0))
    for action in (7, 1):  # to the left, and back to where there is no lane any more
        env.reset(seed=3)
        told = [env.step(action) for _ in range(120)]
        assert told[-1][3] and not any(each[2] for each in told)
        edges = env.road.edges_at(env.scene.lon[:1])[0]
        lane = 3 if action == 7 else 1
        assert env.scene.lat[0] == pytest.approx(edges[lane : lane + 2].mean(), abs=0.2)


def test_the_scene_is_shown_from_the_ego() -> None:
    scene, road = (
        make_scene([100.0, 160.0, 90.0, 400.0], [1.8, 5.4, 9.0, 1.8], speed=[20.0, 15, 25, 30]),
        Road.straight(),
    )
    _, shown = observation_of("scene", 3)
    seen = shown(scene, road)
    expected = [[0, 0, 20, 0, 4.8, 1.9], [-10, 7.2, 25, 0, 4.8, 1.9], [60, 3.6, 15, 0, 4.8, 1.9]]
    assert seen["vehicles"] == pytest.approx(np.array(expected))
    assert seen["mask"].tolist() == [1, 1, 1]
    assert seen["road"] == pytest.approx([1.8, 9.0, 0.0, 3.6])
    space, more = observation_of("scene", 6)
    seen = more(scene, road)
    assert seen["mask"].tolist() == [1, 1, 1, 1, 0, 0]
    assert not seen["vehicles"][4:].any() and seen in space


def test_the_affordance_is_that_of_the_predictor() -> None:
    scene, road = make_scene([100.0, 130.0, 90.0], [1.9, 1.8, 5.4], speed=[20.0, 15, 25]), Road.straight()
    space, shown = observation_of("affordance", 16)
    seen = shown(scene, road)
    assert seen[: len(FEATURES)] == pytest.approx(np.asarray(affordance(scene, road.edges))[0])
    assert seen in space


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({"vehicles": -1}, "vehicles: expected a whole number from 0 to 100, got -1"),
        ({"vehicles": ()}, "vehicles: expected at least one whole number"),
        ({"vehicles": 10**6}, "vehicles: expected a whole number from 0 to 100, got 1000000"),
        ({"vehicles": (3, 1000)}, "vehicles: expected a whole number from 0 to 100, got 1000"),
        ({"vehicles": 2.5}, "vehicles: expected a whole number"),
        ({"vehicles": "five"}, "vehicles: expected a whole number"),
        ({"observation": "pixels"}, "observation: Input should be 'affordance' or 'scene', got 'pixels'"),
        ({"observation": None}, "observation: Input should be"),
        ({"action": "steering"}, "action: Input should be 'continuous' or 'discrete', got 'steering'"),
        ({"action": 9}, "action: Input should be"),
        ({"slots": 0}, "slots: Input should be greater than or equal to 1"),
        ({"slots": 10**6}, "slots: Input should be less than or equal to 1000"),
        ({"render_mode": "ansi"}, "render_mode: Input should be 'human' or 'rgb_array', got 'ansi'"),
        ({"episode": 5}, "episode: Input should be a valid dictionary or instance of EpisodeSettings"),
        ({"reward": "high"}, "reward: Input should be"),
        ({"predictor": "predictor.safetensors"}, "predictor: expected a predictor"),
        ({"recordings": ["us101.csv"], "traffic": "replay"}, "recordings: expected recordings"),
        ({"traffic": 5}, "traffic: expected a name, settings, a traffic model"),
    ],
)
def test_options_that_make_no_sense_are_refused(given: dict, complaint: str) -> None:
    with unchecked(), pytest.raises(SettingError, match=complaint):
        Motorway(**given)


ODD_ACTIONS = {
    "continuous": [
        0, 0.5, [0.0], [0.0] * 3, [[0.0, 0.0]], np.zeros((2, 1)), [np.nan, 0], [0, np.inf], None, "ab", ["0", "1"],
        [[1], [1, 2]], [10**400, 0], [1j, 0], {}, object(),
    ],
    "discrete": [9, -1, 1.5, 4.0, np.nan, [4], np.zeros(2), None, "4", 10**400, {}],
}  # fmt: skip


@pytest.mark.parametrize(("kind", "odd"), [(kind, odd) for kind, all_of in ODD_ACTIONS.items() for odd in all_of])
def test_actions_of_another_kind_are_refused_and_change_nothing(kind: str, odd: object) -> None:
    env = Motorway(vehicles=1, action=kind, episode=SHORT)
    env.reset(seed=1)
    before = env.scene
    with pytest.raises(SettingError, match=r"an action is .* got"):
        env.step(odd)
    assert env.scene is before
    assert env.step(4 if kind == "discrete" else [1e300, -1e300])[0] in env.observation_space


def test_an_environment_says_what_it_is_not_told() -> None:
    env = Motorway(episode=SHORT)
    for ask in (lambda: env.scene, lambda: env.road, lambda: env.step(np.zeros(2))):
        with pytest.raises(gymnasium.error.ResetNeeded):
            ask()
    with pytest.raises(SettingError, match=r"a reset has no options, got \{'vehicles': 3\}"):
        env.reset(options={"vehicles": 3})
    with pytest.raises(gymnasium.error.Error):
        env.reset(seed=-1)
    env.reset(seed=1, options={})
    with pytest.raises(SettingError, match="nothing is drawn"):
        env.render()
    sets = Motorway(predictor=PREDICTOR, sets=True)
    for _ in range(2):
        with pytest.raises(SettingError, match="a trace has at least one step"):
            sets.trace()
        sets.reset(seed=1)


@pytest.mark.parametrize("mode", ["rgb_array", "human"])
def test_gymnasium_finds_nothing_wrong_with_pictures(mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.make(NAME, render_mode=mode, vehicles=3, episode=EpisodeSettings(duration=0.3))
    check_env(env.unwrapped)
    env.close()


def test_a_picture_shows_the_road_the_vehicles_and_the_sets(monkeypatch: pytest.MonkeyPatch) -> None:
    env = env_of(monkeypatch, make_scene([0, 30.0], [1.8, 5.4]), render_mode="rgb_array", sets=True)
    picture = env.render()
    assert (picture.shape, picture.dtype) == ((240, 1200, 3), np.uint8)
    ego, other, paper = picture[120 + 29, 320], picture[120, 560], picture[5, 600]
    assert ego.tolist() == [0, 0x72, 0xB2] and other.tolist() == [0xD5, 0x5E, 0] and paper.tolist() == [255] * 3
    sets = (picture == [0xF8, 0xC7, 0x9F]).all(-1)
    assert sets[:, 580:].any() and not sets[:, :500].any()
    env.step(np.zeros(2))
    assert (env.render() != picture).any() and (picture[120 + 29, 320] == ego).all()  # the first one is as it was


@pytest.mark.parametrize("mode", ["rgb_array", "human"])
def test_one_that_is_drawn_can_be_copied(mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.make(NAME, render_mode=mode, vehicles=2)
    env.reset(seed=1)
    for copied in (deepcopy(env), pickle.loads(pickle.dumps(env))):
        assert np.array_equal(env.render(), copied.render()) if mode == "rgb_array" else copied.render() is None
        copied.step(np.ones(2))
        assert copied.unwrapped.scene.lon[0] > env.unwrapped.scene.lon[0] == 0
    env.close()


def test_a_window_shows_every_step_in_real_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env, begun = gymnasium.make(NAME, render_mode="human", vehicles=2, episode=SHORT), time.monotonic()
    drive(env, 1, [np.zeros(2)] * 4)
    assert time.monotonic() - begun > 0.35
    assert env.render() is None
    env.close()
    env.close()
    monkeypatch.setenv("SDL_VIDEODRIVER", "none such")
    with pytest.raises(SettingError, match="no window can be opened here"):
        Motorway(render_mode="human")


def test_what_is_missing_is_said() -> None:
    with pytest.raises(SettingError, match="predicted sets need a predictor"):
        Motorway(sets=True)
    with pytest.raises(SettingError, match="set-sampling traffic drives members of predicted sets; give a predictor"):
        Motorway("set-sampling")
    with pytest.raises(SettingError, match="no traffic is called 'rush hour'"):
        Motorway("rush hour")
    assert NAME in gymnasium.registry and bridge.NAME == NAME
