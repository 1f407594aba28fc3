import numpy as np
import pytest

from coverdrive.simulation.traffic.motion import constant_velocity


def test_constant_velocity_follows_the_heading():
    states = constant_velocity(np.array([[1.0, 2.0, 10.0, np.pi / 6]]), np.array([0.0, 2.0]))
    assert states[0, 0] == pytest.approx([1.0, 2.0, 10.0, np.pi / 6])
    assert states[0, 1] == pytest.approx([1.0 + 20.0 * np.cos(np.pi / 6), 12.0, 10.0, np.pi / 6])
