"""The motion as a function of its inputs, and its derivatives against finite differences."""

import numpy as np
import pytest

from coverdrive.planning.condensed import course_of, pull_back
from coverdrive.planning.vehicle import rollout

STATE = np.array([0.0, 2.0, 22.0, 0.04])
INPUTS = np.random.default_rng(1).normal(0, np.repeat([3.0, 0.1], 12))


def states(inputs: np.ndarray) -> np.ndarray:
    course = course_of(STATE, inputs, 0.25)
    return np.stack([course.lon, course.lat, course.speed, course.heading], axis=-1)


def test_course_is_the_rollout() -> None:
    np.testing.assert_allclose(states(INPUTS), rollout(STATE, INPUTS.reshape(2, 12).T, 0.25)[1:], atol=1e-12)


@pytest.mark.parametrize("step", [0, 5, 11])
@pytest.mark.parametrize("field", range(4))
def test_derivatives_of_the_states(step: int, field: int) -> None:
    small, got = 1e-5, np.full(24, np.nan)
    weights = np.eye(4)[field]
    pull_back(course_of(STATE, INPUTS, 0.25), step, tuple(weights), 0.25, got)
    for i, nudge in enumerate(small * np.eye(24)):
        change = (states(INPUTS + nudge) - states(INPUTS - nudge))[step, field] / (2 * small)
        assert got[i] == pytest.approx(change, abs=1e-7)
