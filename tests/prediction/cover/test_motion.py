"""Base trajectories put on a vehicle."""

import numpy as np
import pytest

from coverdrive.prediction.cover.motion import follow

TIMES = np.linspace(0.0, 3.0, 31)


def bases(*manoeuvres: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Deviation and rate of manoeuvres given as acceleration [m/s²] and lateral shift [m] over 3 s."""
    acceleration, shift = np.array(manoeuvres)[:, :, None].transpose(1, 0, 2)
    phase = np.pi * TIMES / 3
    deviation = np.stack([acceleration * TIMES**2 / 2, shift * (1 - np.cos(phase)) / 2], axis=-1)
    rate = np.stack([acceleration * TIMES, shift * np.sin(phase) * np.pi / 6], axis=-1)
    return deviation, rate


def test_base_is_put_on_position_and_longitudinal_speed():
    deviation, rate = bases((2.0, 0.0))
    path = follow(np.array([5.0, 1.8, 20.0, 0.1]), TIMES, deviation, rate)[0]
    start = 20.0 * np.cos(0.1)
    assert path[-1] == pytest.approx([5.0 + 3 * start + 9.0, 1.8, start + 6.0, 0.0])


def test_speed_and_heading_are_the_derivative_of_the_position():
    deviation, rate = bases((1.0, 0.0), (-1.0, 3.6), (0.0, -3.6))
    paths = follow(np.array([0.0, 0.0, 20.0, 0.0]), TIMES, deviation, rate)
    lon, lat, speed, heading = np.moveaxis(paths, -1, 0)
    middle = np.s_[:, 1:-1]
    assert (speed * np.cos(heading))[middle] == pytest.approx(np.gradient(lon, TIMES, axis=1)[middle], abs=1e-9)
    assert (speed * np.sin(heading))[middle] == pytest.approx(np.gradient(lat, TIMES, axis=1)[middle], abs=0.01)


def test_a_vehicle_that_would_go_backwards_stands_still():
    deviation, rate = bases((-3.0, 0.0))
    path = follow(np.array([0.0, 0.0, 3.0, 0.0]), TIMES, deviation, rate)[0]
    stopped = TIMES > 1.0 + 1e-9
    assert path[stopped, 0] == pytest.approx(1.5)
    assert (path[stopped, 2] == 0).all()
    assert path[5, 2] == pytest.approx(1.5)


def test_a_standing_vehicle_can_start_again():
    deviation, rate = bases((1.0, 0.0))
    path = follow(np.zeros(4), TIMES, deviation, rate)[0]
    assert path[-1, [0, 2]] == pytest.approx([4.5, 3.0])


def test_every_vehicle_follows_its_own_base() -> None:
    deviation, rate = bases((1.0, 0.0), (-1.0, 3.6))
    states = np.array([[0.0, 1.8, 20.0, 0.0], [50.0, 5.4, 10.0, 0.1]])
    together = follow(states, TIMES, deviation, rate)
    for vehicle in range(2):
        alone = follow(states[vehicle], TIMES, deviation[[vehicle]], rate[[vehicle]])[0]
        assert np.array_equal(together[vehicle], alone)
