import jax
import numpy as np
import pytest
from simulation_fakes import FakeBasis, make_scene

from coverdrive.certificates.rule import Thresholds
from coverdrive.geometry import turned_half_extents
from coverdrive.prediction.basis import Basis
from coverdrive.prediction.network import Network
from coverdrive.prediction.predictor import Predictor
from coverdrive.road import Road
from coverdrive.simulation.motion import constant_velocity, follow

TIMES = np.linspace(0.0, 3.0, 31)


def test_constant_velocity_follows_the_heading():
    states = constant_velocity(np.array([[1.0, 2.0, 10.0, np.pi / 6]]), np.array([0.0, 2.0]))
    assert states[0, 0] == pytest.approx([1.0, 2.0, 10.0, np.pi / 6])
    assert states[0, 1] == pytest.approx([1.0 + 20.0 * np.cos(np.pi / 6), 12.0, 10.0, np.pi / 6])


def test_base_is_put_on_position_and_longitudinal_speed():
    deviation, rate = FakeBasis.make(accelerations=(2.0,), shifts=(0.0,)).rollout(TIMES)
    path = follow(np.array([5.0, 1.8, 20.0, 0.1]), TIMES, deviation, rate)[0]
    start = 20.0 * np.cos(0.1)
    assert path[-1] == pytest.approx([5.0 + 3 * start + 9.0, 1.8, start + 6.0, 0.0])


def test_speed_and_heading_are_the_derivative_of_the_position():
    deviation, rate = FakeBasis.make().rollout(TIMES)
    paths = follow(np.array([0.0, 0.0, 20.0, 0.0]), TIMES, deviation, rate)
    lon, lat, speed, heading = np.moveaxis(paths, -1, 0)
    middle = np.s_[:, 1:-1]
    assert (speed * np.cos(heading))[middle] == pytest.approx(np.gradient(lon, TIMES, axis=1)[middle], abs=1e-9)
    assert (speed * np.sin(heading))[middle] == pytest.approx(np.gradient(lat, TIMES, axis=1)[middle], abs=0.01)


def test_a_vehicle_that_would_go_backwards_stands_still():
    deviation, rate = FakeBasis.make(accelerations=(-3.0,), shifts=(0.0,)).rollout(TIMES)
    path = follow(np.array([0.0, 0.0, 3.0, 0.0]), TIMES, deviation, rate)[0]
    stopped = TIMES > 1.0 + 1e-9
    assert path[stopped, 0] == pytest.approx(1.5)
    assert (path[stopped, 2] == 0).all()
    assert path[5, 2] == pytest.approx(1.5)


def test_a_standing_vehicle_can_start_again():
    deviation, rate = FakeBasis.make(accelerations=(1.0,), shifts=(0.0,)).rollout(TIMES)
    path = follow(np.zeros(4), TIMES, deviation, rate)[0]
    assert path[-1, [0, 2]] == pytest.approx([4.5, 3.0])


@pytest.mark.parametrize("speed", [0.0, 2.0, 20.0])
def test_the_motion_is_the_one_that_the_predictor_predicts(speed):
    deviation, _ = FakeBasis.make(accelerations=(1.0, 0.0, -1.0), shifts=(0.0, 3.6)).rollout(np.arange(7) / 2)
    basis = Basis(deviation, epsilon=0.5, aspect=4.0, growth=1.0, step=0.5)
    everything_possible = Predictor(
        basis,
        Network.create(np.zeros((2, 21)), (4,), len(basis), jax.random.key(0)),
        Thresholds(np.zeros(len(basis)), np.zeros(len(basis))),
        certificate=None,
        trained_on=np.zeros(0, dtype=int),
    )
    scene = make_scene([0, 50], [1.8, 1.8], [20, speed])
    predicted = everything_possible.predict(scene, Road.straight(), 0, 0.1, 30)
    followed = follow(np.array([50, 1.8, speed, 0.0]), TIMES, *basis.rollout(TIMES))
    assert followed[..., :2] == pytest.approx(predicted.points)
    assert turned_half_extents(np.array([2.4, 0.95]), followed[..., 3]) == pytest.approx(predicted.half_sizes)
