"""The Dubins car against a hand computation, and its limits.

m plans, K steps, P = K + 1 states.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from planning_scenes import CAR, CONSTANTS, DT, STRAIGHT, drive, rollout

from coverdrive.planning.problem.vehicle import step, within_limits

LIMITS, L = CONSTANTS.vehicle, 2.579


def test_step_by_hand() -> None:
    got, half = step(np.array([1.0, 2.0, 10.0, np.pi / 6]), np.array([2.0, -0.4]), 0.25), 0.125
    after = np.pi / 6 - 0.1
    lon = 1 + half * (10 * np.sqrt(3) / 2 + 10.5 * np.cos(after))
    np.testing.assert_allclose(got, [lon, 2 + half * (10 * 0.5 + 10.5 * np.sin(after)), 10.5, after])


def test_rollout_by_hand() -> None:
    states = rollout(np.array([0.0, 0.0, 20.0, 0.0]), np.array([[4.0, 0.0], [-8.0, 0.0]]), 0.5)
    np.testing.assert_allclose(states, [[0, 0, 20, 0], [10.5, 0, 22, 0], [20.5, 0, 18, 0]])


@pytest.mark.parametrize(
    ("state", "wanted", "before", "expected"),
    [
        ([0.0, 0, 20, 0], [-1, 0.1], [0, 0], [-1, 0.1]),
        ([0, 0, 20, 0], [-2000, 1], [0, 0.2], [-8, 0.2]),  # 4 m/s² at 20 m/s is 0.2 rad/s
        ([0, 0, 40, 0], [3, 0], [0, 0], [84.1 / 40, 0]),
        ([0, 0, 1, 0], [-8, 0], [0, 0], [-4, 0]),  # stops, and does not drive backwards
        ([0, 0, 45, 0], [3, 0], [0, 0], [0, 0]),
        ([0, 0, 2, 0.35], [0, 0.5], [0, 0], [0, 0]),
        ([0, 0, 2, 0.5], [0, 0.5], [0, 0], [0, 0]),  # already turned too far
        ([0, 0, -0.1, 0], [-8, 0], [0, 0], [0, 0]),
        ([0, 0, 0, 0], [0, 0.5], [0, 0], [0, 0]),  # a standing car does not turn
        ([0, 0, 2, 0], [0, 9], [0, 0], [0, 2 * 0.1 / L]),  # the wheels, by 0.1 rad in 0.25 s
        ([0, 0, 2, 0], [0, 9], [-4, 0.3], [0, 2 * (0.3 / 2.5 + 0.1 / L)]),  # at 2.5 m/s, in the mean, before
        ([0, 0, 2, 0], [-8, 9], [0, 0], [-8, 0.1 / L]),  # at 1 m/s in the mean
        ([0, 0, 1, -1.5], [0, 9], [0, 0.7], [0, np.tan(1.066) / L]),  # no wheel turns further
        ([0, 0, 2, 0.35], [0, 0.5], [0, 0.5], [0, 0.5 - 2 * 0.1 / L]),  # nor back at once
    ],
)
def test_limits_by_hand(state: list[float], wanted: list[float], before: list[float], expected: list[float]) -> None:
    for side in (1, -1):
        mirror = np.array([1, side])
        at, wish, last = (
            np.array(each, dtype=float) for each in (state * np.tile(mirror, 2), wanted * mirror, before * mirror)
        )
        got = within_limits(tuple(at), tuple(wish), tuple(last), 0.25, 0.25, STRAIGHT, LIMITS)
        np.testing.assert_allclose(got, expected * mirror, atol=1e-12)


@given(st.floats(0, 45), st.floats(-0.35, 0.35), st.integers(0, 2**32 - 1))
def test_limits_are_kept_step_by_step(speed: float, heading: float, seed: int) -> None:
    """The angle of the wheels from the curvature of each step; they are straight before."""
    wishes = np.random.default_rng(seed).normal(0, [5, 1], (5, 12, 2))
    states, inputs = drive(np.array([0.0, 0.0, speed, heading]), wishes)
    acceleration, yaw_rate = inputs[..., 0], inputs[..., 1]
    assert (acceleration >= -CAR.max_deceleration).all() and (acceleration <= CAR.max_acceleration).all()
    assert (acceleration * states[:, :-1, 2] <= CAR.max_power * (1 + 1e-9)).all()
    assert (states[..., 2] >= -1e-9).all() and (states[..., 2] <= CAR.max_speed + 1e-9).all()
    mean = (states[:, :-1, 2] + states[:, 1:, 2]) / 2
    assert (yaw_rate[mean <= 0] == 0).all()
    angle = np.arctan(CAR.wheelbase * yaw_rate / np.maximum(mean, 1e-12))
    assert np.abs(angle).max() <= CAR.max_steering + 1e-9
    assert np.abs(np.diff(angle))[mean[:, 1:] > 1e-9].max(initial=0.0) <= CAR.max_steering_rate * DT + 1e-9


@given(st.floats(0, 45), st.floats(-0.35, 0.35), st.booleans())
def test_a_turn_ends_at_the_largest_heading(speed: float, heading: float, left: bool) -> None:
    """At an even speed: the wheels are straight in time."""
    states, _ = drive(np.array([0.0, 0.0, speed, heading]), np.tile([0.0, 9.0 if left else -9.0], (1, 60, 1)))
    assert np.abs(states[..., 3]).max() <= CAR.max_heading + 1e-9
    assert speed < 1 or abs(states[0, -1, 3]) > 0.9 * CAR.max_heading


@given(st.floats(0, 45), st.floats(-0.3, 0.3), st.floats(-8, 3), st.floats(-0.5, 0.5))
def test_a_step_is_nearly_that_of_the_exact_motion(speed: float, heading: float, faster: float, turn: float) -> None:
    """Off by less than dt³/12·|f''| of the velocity f, and exact straight ahead."""
    state, dt, parts = np.array([0.0, 0.0, speed, heading]), 0.25, 1000
    inputs = np.array(within_limits(tuple(state), (faster, turn), (0.0, turn), dt, dt, STRAIGHT, LIMITS))
    exact = state
    for _ in range(parts):
        exact = step(exact, inputs, dt / parts)
    got, fastest = step(state, inputs, dt), max(speed, exact[2])
    bound = dt**3 / 12 * (2 * abs(inputs[0] * inputs[1]) + fastest * inputs[1] ** 2)
    assert np.abs(got - exact).max() <= bound * (1 + 1e-5) + 1e-9
