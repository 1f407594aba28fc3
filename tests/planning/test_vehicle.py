"""The Dubins car against a hand computation, and its limits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coverdrive.planning.vehicle import VehicleSettings, feasible_inputs, rollout, step

CAR = VehicleSettings()


def test_step_by_hand() -> None:
    got, half = step(np.array([1.0, 2.0, 10.0, np.pi / 6]), np.array([2.0, -0.4]), 0.25), 0.125
    after = np.pi / 6 - 0.1
    lon = 1 + half * (10 * np.sqrt(3) / 2 + 10.5 * np.cos(after))
    np.testing.assert_allclose(got, [lon, 2 + half * (10 * 0.5 + 10.5 * np.sin(after)), 10.5, after])


def test_rollout_by_hand() -> None:
    states = rollout(np.array([0.0, 0.0, 20.0, 0.0]), np.array([[4.0, 0.0], [-8.0, 0.0]]), 0.5)
    np.testing.assert_allclose(states, [[0, 0, 20, 0], [10.5, 0, 22, 0], [20.5, 0, 18, 0]])


def test_rollout_of_many_is_the_rollout_of_each() -> None:
    rng = np.random.default_rng(1)
    states, inputs = rng.normal(size=(5, 4)), rng.normal(size=(5, 3, 2))
    together = rollout(states, inputs, 0.25)
    for i in range(5):
        np.testing.assert_array_equal(together[i], rollout(states[i], inputs[i], 0.25))


@pytest.mark.parametrize(
    ("state", "wanted", "expected"),
    [
        ([0, 0, 20, 0], [-1, 0.1], [-1, 0.1]),
        ([0, 0, 20, 0], [-2000, 1], [-8, 0.2]),  # 4 m/s² at 20 m/s is 0.2 rad/s
        ([0, 0, 1, 0], [-8, 0], [-4, 0]),  # stops, and does not drive backwards
        ([0, 0, 45, 0], [3, 0], [0, 0]),
        ([0, 0, 2, 0.34], [0, 0.5], [0, 0.04]),
        ([0, 0, 2, 0.5], [0, 0.5], [0, 0]),  # already turned too far
        ([0, 0, -0.1, 0], [-8, 0], [0, 0]),
    ],
)
def test_feasible_inputs_by_hand(state: list[float], wanted: list[float], expected: list[float]) -> None:
    got = feasible_inputs(np.array(state, dtype=float), np.array(wanted, dtype=float), 0.25, CAR)
    np.testing.assert_allclose(got, expected, atol=1e-12)


@given(st.floats(0, 45), st.floats(-0.35, 0.35), st.floats(-100, 100), st.floats(-100, 100))
def test_feasible_inputs_keep_the_limits(speed: float, heading: float, wish: float, turn: float) -> None:
    state = np.array([0.0, 0.0, speed, heading])
    inputs = feasible_inputs(state, np.array([wish, turn]), 0.25, CAR)
    after = step(state, inputs, 0.25)
    assert -CAR.max_deceleration <= inputs[0] <= CAR.max_acceleration
    assert abs(inputs[1]) <= CAR.max_yaw_rate
    assert abs(speed * inputs[1]) <= CAR.max_lateral_acceleration + 1e-9
    assert -1e-9 <= after[2] <= CAR.max_speed + 1e-9
    assert abs(after[3]) <= CAR.max_heading + 1e-9


@given(st.floats(0, 45), st.floats(-0.3, 0.3), st.floats(-8, 3), st.floats(-0.5, 0.5))
def test_a_step_is_nearly_that_of_the_exact_motion(speed: float, heading: float, faster: float, turn: float) -> None:
    """Off by less than dt³/12·|f''| of the velocity f, and exact straight ahead."""
    state, dt, parts = np.array([0.0, 0.0, speed, heading]), 0.25, 1000
    inputs = feasible_inputs(state, np.array([faster, turn]), dt, CAR)
    exact = state
    for _ in range(parts):
        exact = step(exact, inputs, dt / parts)
    got, fastest = step(state, inputs, dt), max(speed, exact[2])
    bound = dt**3 / 12 * (2 * abs(inputs[0] * inputs[1]) + fastest * inputs[1] ** 2)
    assert np.abs(got - exact).max() <= bound * (1 + 1e-5) + 1e-9
