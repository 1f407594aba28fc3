"""Smallest enclosing balls by hand, against brute force, and under permutation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from coverdrive.prediction.cover.enclosing import enclosing_ball


def ball_of(*points: tuple[float, float]) -> tuple[list[float], float]:
    centre, radius = enclosing_ball(np.array(points)[:, None])
    return centre[0].tolist(), radius


def test_discs_by_hand() -> None:
    assert ball_of((3.0, 4.0)) == ([3.0, 4.0], 0.0)
    assert ball_of((0.0, 0.0), (2.0, 0.0)) == ([1.0, 0.0], 1.0)
    centre, radius = ball_of((0.0, 0.0), (6.0, 0.0), (3.0, 1.0))  # obtuse: two points decide
    assert (centre, radius) == ([3.0, 0.0], 3.0)
    centre, radius = ball_of((1.0, 0.0), (-1.0, 0.0), (0.0, np.sqrt(3)), (0.0, 0.5))
    assert centre == pytest.approx([0.0, 1 / np.sqrt(3)]) and radius == pytest.approx(2 / np.sqrt(3))


def test_collinear_and_equal_points() -> None:
    assert ball_of((0.0, 0.0), (1.0, 1.0), (4.0, 4.0), (2.0, 2.0)) == ([2.0, 2.0], pytest.approx(2 * np.sqrt(2)))
    assert ball_of((1.0, 2.0), (1.0, 2.0), (1.0, 2.0)) == ([1.0, 2.0], 0.0)


def test_each_time_has_its_own_disc_and_the_largest_counts() -> None:
    points = np.array([[[0.0, 0.0], [0.0, 0.0]], [[0.0, 2.0], [6.0, 0.0]]])
    centre, radius = enclosing_ball(points)
    assert centre.tolist() == [[0.0, 1.0], [3.0, 0.0]] and radius == 3.0


@settings(deadline=None, max_examples=15)
@given(st.integers(1, 40), st.integers(0, 10_000))
def test_no_other_centre_is_better(count: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    points = random.normal(size=(count, 3, 2)) * random.uniform(0.1, 10, (3, 1))
    centre, radius = enclosing_ball(points)
    away = np.linalg.norm(points - centre, axis=-1)
    assert radius == pytest.approx(away.max())
    for time in range(3):

        def reach(at: np.ndarray, time: int = time) -> float:
            return float(np.linalg.norm(points[:, time] - at, axis=-1).max())

        best = minimize(reach, points[:, time].mean(0), method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-9})
        assert reach(centre[time]) <= best.fun * (1 + 1e-6) + 1e-9


def test_a_ball_that_is_too_large_is_told_early_and_truly() -> None:
    points = np.random.default_rng(0).normal(size=(500, 7, 2))
    smallest = enclosing_ball(points)[1]
    assert enclosing_ball(points, smallest * 0.5)[1] > smallest * 0.5
    assert enclosing_ball(points, smallest * 1.01)[1] == pytest.approx(smallest)
