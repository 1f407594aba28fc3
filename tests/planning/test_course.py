"""The motion as a function of its inputs, and its derivatives against finite differences."""

import numpy as np

from coverdrive.planning.course import add_lat_curvature, add_pulled_back, changes_of, course_of
from coverdrive.planning.vehicle import rollout

STATE = np.array([0.0, 2.0, 22.0, 0.04])
INPUTS = np.random.default_rng(1).normal(0, np.repeat([3.0, 0.1], 12))
DT = 0.25


def derivatives() -> np.ndarray:
    """Of the states with respect to the inputs, by differences."""
    small = 1e-5
    columns = [
        (course_of(STATE, INPUTS + nudge, DT).states - course_of(STATE, INPUTS - nudge, DT).states) / (2 * small)
        for nudge in small * np.eye(24)
    ]
    return np.stack(columns, axis=-1)


def test_course_is_the_rollout() -> None:
    states = course_of(STATE, INPUTS, DT).states
    np.testing.assert_allclose(states, rollout(STATE, INPUTS.reshape(2, 12).T, DT)[1:], atol=1e-12)


def test_changes_of_the_states() -> None:
    change = np.random.default_rng(2).normal(size=24)
    got = changes_of(course_of(STATE, INPUTS, DT), change, DT)
    np.testing.assert_allclose(got, derivatives() @ change, atol=1e-6)


def test_derivatives_are_pulled_back() -> None:
    random = np.random.default_rng(3)
    by_state, before = random.normal(size=(12, 4)), random.normal(size=24)
    got = before.copy()
    add_pulled_back(course_of(STATE, INPUTS, DT), by_state, DT, got)
    np.testing.assert_allclose(got, before + np.einsum("kf,kfu->u", by_state, derivatives()), atol=1e-6)


def test_curvature_of_lat() -> None:
    weight, got = np.linspace(1, 3, 12), np.ones(24)
    add_lat_curvature(course_of(STATE, INPUTS, DT), weight, DT, got)
    np.testing.assert_allclose(got, 1 + weight @ derivatives()[:, 1] ** 2, rtol=1e-6)
