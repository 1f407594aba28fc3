import numpy as np
from simulation_fakes import FakeBasis, FakePredictor

from coverdrive.road import Road
from coverdrive.simulation.roads.initial import EGO, InitialSettings
from coverdrive.simulation.traffic.mixed import MixedTraffic, MixedTrafficSettings
from coverdrive.simulation.traffic.motion import with_states

ROAD = Road.straight()
PREDICTOR = FakePredictor(FakeBasis.make())


def bases(share, seed=0, steps=20):
    """Which base every vehicle follows at every step; −1 for a driver."""
    traffic = MixedTraffic(PREDICTOR, MixedTrafficSettings(share=share))
    rng = np.random.default_rng(seed)
    scene = traffic.start(InitialSettings(), 7, rng).scene
    traffic.reset(scene, ROAD, rng)
    found = []
    for _ in range(steps):
        step = traffic.step(scene, 0.1)
        assert np.array_equal(step.scene.states[EGO], scene.states[EGO])
        assert (step.scene.lon[1:] > scene.lon[1:]).all()
        scene = with_states(step.scene, step.scene.states)
        found.append(step.base)
    return np.stack(found)


def test_share_says_how_many_are_drivers():
    assert (bases(0.0)[:, 1:] >= 0).all()
    assert (bases(1.0) == -1).all()
    drivers = [(bases(0.5, seed, steps=1)[0, 1:] == -1).mean() for seed in range(30)]
    assert 0.35 < np.mean(drivers) < 0.65


def test_a_vehicle_belongs_to_one_model_for_the_whole_episode():
    driven = bases(0.5, seed=3) == -1
    assert (driven == driven[0]).all()
    assert driven[0, 1:].any() and not driven[0, 1:].all()


def test_same_seed_same_traffic():
    assert np.array_equal(bases(0.5, seed=3), bases(0.5, seed=3))


def test_set_sampling_vehicles_keep_clear_of_drivers():
    """Behind a slower driver, a set-sampling vehicle chooses among the bases that do not reach it within 3 s."""
    road = Road.straight(1)
    states = np.array([[-200.0, 1.8, 20, 0], [0.0, 1.8, 20, 0], [25.0, 1.8, 12.0, 0]])
    chosen = set()
    for seed in range(20):
        traffic = MixedTraffic(PREDICTOR, MixedTrafficSettings(share=0.5))
        scene = with_states(traffic.start(InitialSettings(lanes=1), 2, np.random.default_rng(0)).scene, states)
        traffic.reset(scene, road, np.random.default_rng(seed))
        base = traffic.step(scene, 0.1).base
        if base[1] >= 0 and base[2] == -1:
            chosen.add(PREDICTOR.basis.acceleration[base[1]])
    assert chosen == {-1.0, -3.0}  # 8 m/s · 3 s − 1 m/s² · (3 s)²/2 is less than the gap of 20.2 m, 8 m/s · 3 s is not


def test_whoever_is_on_a_ramp_is_a_driver():
    settings = InitialSettings(lanes=1, ramp=400.0)
    on_ramp = 0
    for seed in range(5):
        traffic, random = MixedTraffic(PREDICTOR, MixedTrafficSettings(share=0.0)), np.random.default_rng(seed)
        begun = traffic.start(settings, 4, random)
        traffic.reset(begun.scene, begun.road, random)
        ending = begun.scene.lat < 3.6
        on_ramp += ending.sum()
        assert np.array_equal(traffic.step(begun.scene, 0.1).base[1:] == -1, ending[1:])
    assert on_ramp > 3
