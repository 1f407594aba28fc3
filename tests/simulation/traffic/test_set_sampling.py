import numpy as np
import pytest
from simulation_fakes import FakeBasis, FakePredictor, make_scene

from coverdrive.errors import SettingError
from coverdrive.road import Road
from coverdrive.simulation.drives.outcome import contacts
from coverdrive.simulation.roads.initial import EGO, InitialSettings, initial_scene
from coverdrive.simulation.traffic.motion import with_states
from coverdrive.simulation.traffic.set_sampling import SetSamplingTraffic

ROAD = Road.straight()


def drive(traffic, scene, seed, steps, dt=0.1):
    """Step the traffic while the ego keeps its speed, come what may."""
    traffic.reset(scene, ROAD, np.random.default_rng(seed))
    taken = []
    for _ in range(steps):
        step = traffic.step(scene, dt)
        states = step.scene.states
        states[EGO, 0] += dt * states[EGO, 2]
        scene = with_states(step.scene, states)
        taken.append(step)
    return taken


def test_never_chooses_outside_the_set_while_a_member_passes():
    predictor = FakePredictor(FakeBasis.make(), impossible=(0, 4, 7))
    for seed in range(20):
        scene = initial_scene(InitialSettings(), 6, np.random.default_rng(seed))
        steps = drive(SetSamplingTraffic(predictor), scene, seed, 60)
        chosen = np.stack([step.base[1:] for step in steps])
        assert not np.isin(chosen, predictor.impossible).any()
        assert not np.any([step.missed for step in steps])
        assert all(step.base[EGO] == -1 for step in steps)


def test_uncontrolled_vehicles_never_overlap_each_other():
    predictor = FakePredictor(FakeBasis.make())
    never_stuck = 0
    for seed in range(30):
        scene = initial_scene(InitialSettings(), 3 + seed % 5, np.random.default_rng(seed))
        scene.lon[EGO] -= 1000.0
        steps = drive(SetSamplingTraffic(predictor), scene, seed, 100)
        if not np.any([step.stuck for step in steps]):
            never_stuck += 1
            assert not any(contacts(step.scene)[1:, 1:].any() for step in steps)
    assert never_stuck >= 15


def test_without_a_collision_check_they_would_overlap(monkeypatch):
    monkeypatch.setattr(
        "coverdrive.simulation.traffic.set_sampling.clearance", lambda paths, *_: np.full(len(paths), np.inf)
    )
    predictor = FakePredictor(FakeBasis.make())
    scene = initial_scene(InitialSettings(), 7, np.random.default_rng(0))
    steps = drive(SetSamplingTraffic(predictor), scene, 0, 100)
    assert any(contacts(step.scene)[1:, 1:].any() for step in steps)


def test_vehicles_stay_on_the_road_and_never_go_backwards():
    predictor = FakePredictor(FakeBasis.make(accelerations=(-3.0, -6.0, 0.0)))
    scene = initial_scene(InitialSettings(traffic_speed=4.0), 5, np.random.default_rng(0))
    steps = drive(SetSamplingTraffic(predictor), scene, 0, 150)
    lon = np.stack([step.scene.lon[1:] for step in steps])
    lat = np.stack([step.scene.lat[1:] for step in steps])
    assert (np.diff(lon, axis=0) >= 0).all()
    assert (np.stack([step.scene.speed[1:] for step in steps]) >= 0).all()
    assert lat.min() >= 0.9
    assert lat.max() <= 10.8 - 0.9


def test_choices_last_for_the_interval_and_are_uniform_over_what_passes():
    predictor = FakePredictor(FakeBasis.make(accelerations=(-1.0, 0.0, 1.0), shifts=(0.0,)), impossible=(2,))
    scene = make_scene([-500, 0], [1.8, 5.4])
    steps = drive(SetSamplingTraffic(predictor), scene, 0, 600)
    base = np.array([step.base[1] for step in steps]).reshape(-1, 3)
    assert (base == base[:, :1]).all()
    share = (base[:, 0] == 0).mean()
    assert abs(share - 0.5) < 4 * 0.5 / np.sqrt(len(base))
    assert set(base[:, 0].tolist()) == {0, 1}


@pytest.mark.parametrize(("own_lon", "heeded"), [(10.0, True), (-10.0, False)])
def test_the_ego_is_heeded_only_if_directly_in_front(own_lon, heeded):
    predictor = FakePredictor(FakeBasis.make(accelerations=(0.0,), shifts=(0.0,)))
    scene = make_scene([own_lon, 0.0], [1.8, 1.8], speed=[0.0 if heeded else 40.0, 20.0])
    traffic = SetSamplingTraffic(predictor)
    traffic.reset(scene, ROAD, np.random.default_rng(0))
    assert traffic.step(scene, 0.1).stuck[1] == heeded


def test_the_ego_hidden_behind_another_vehicle_is_not_heeded():
    predictor = FakePredictor(FakeBasis.make(accelerations=(0.0,), shifts=(0.0,)))
    scene = make_scene([20.0, 0.0, 10.0], [1.8, 1.8, 1.8], speed=[10.0, 20.0, 20.0])
    traffic = SetSamplingTraffic(predictor)
    traffic.reset(scene, ROAD, np.random.default_rng(0))
    assert traffic.step(scene, 0.1).stuck.tolist() == [False, False, True]


def test_stuck_vehicle_takes_the_possible_base_of_largest_clearance():
    predictor = FakePredictor(FakeBasis.make(accelerations=(-6.0, -2.0, 0.0), shifts=(0.0,)), impossible=(0,))
    scene = make_scene([10.0, 0.0], [1.8, 1.8], speed=[0.0, 20.0])
    traffic = SetSamplingTraffic(predictor)
    traffic.reset(scene, ROAD, np.random.default_rng(0))
    step = traffic.step(scene, 0.1)
    assert step.stuck[1]
    assert not step.missed[1]
    assert step.base[1] == 1


def test_empty_set_means_hardest_braking_and_is_a_miss():
    predictor = FakePredictor(FakeBasis.make(accelerations=(0.0, -6.0, -2.0), shifts=(0.0,)), impossible=(0, 1, 2))
    scene = make_scene([-100.0, 0.0], [1.8, 1.8])
    traffic = SetSamplingTraffic(predictor)
    traffic.reset(scene, ROAD, np.random.default_rng(0))
    step = traffic.step(scene, 0.1)
    assert (step.base[1], bool(step.stuck[1]), bool(step.missed[1])) == (1, True, True)


def test_slots_without_a_vehicle_are_left_alone():
    predictor = FakePredictor(FakeBasis.make())
    scene = make_scene([-100.0, 0.0, 0.0], [1.8, 1.8, 1.8])
    scene.valid[2] = False
    step = drive(SetSamplingTraffic(predictor), scene, 0, 4)[-1]
    assert step.base[1] >= 0
    assert step.base[2] == -1
    assert not step.stuck.any()


def test_a_step_that_does_not_divide_the_interval_is_refused():
    scene = make_scene([-100.0, 0.0], [1.8, 1.8])
    traffic = SetSamplingTraffic(FakePredictor(FakeBasis.make()))
    traffic.reset(scene, ROAD, np.random.default_rng(0))
    with pytest.raises(SettingError, match=r"every 0.3 s.*step of 0.2 s"):
        traffic.step(scene, 0.2)


def test_lanes_that_end_are_none_to_set_sampling_vehicles():
    """Beside a ramp nobody drives a member of its set that leads onto it, though all are possible."""
    settings = InitialSettings(ramp=300.0, lanes=2)
    onto = FakePredictor(FakeBasis.make(accelerations=(0.0,), shifts=(0.0, -3.6)))
    road = settings.road()
    for seed in range(3):
        scene = initial_scene(settings, 3, np.random.default_rng(seed))
        traffic = SetSamplingTraffic(onto)
        traffic.reset(scene, road, np.random.default_rng(seed))
        for _ in range(40):
            scene = traffic.step(scene, 0.1).scene
            assert (scene.lat > 3.6 + 0.9).all()
