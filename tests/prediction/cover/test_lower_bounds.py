"""Lower bounds on covers: never above the true optimum, which small instances have found by trying everything."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coverdrive.prediction.cover.greedy import greedy_cover
from coverdrive.prediction.cover.lower_bounds import fractional_bound, packing


def distances(points: np.ndarray, centres: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, None] - centres[None], axis=-1).max(-1)


def smallest_cover(points: np.ndarray, centres: np.ndarray, epsilon: float) -> int:
    """Size of the smallest cover with the given centres, by trying all sets of them."""
    near = distances(points, centres) <= epsilon
    return next(
        size
        for size in range(1, len(centres) + 1)
        if any(near[:, list(chosen)].any(1).all() for chosen in combinations(range(len(centres)), size))
    )


def on_a_line(*places: float) -> np.ndarray:
    points = np.zeros((len(places), 2, 2))
    points[:, 1, 0] = places
    return points


@settings(deadline=None, max_examples=20)
@given(st.sampled_from([1, 10]), st.integers(0, 10_000), st.sampled_from([0.3, 0.6, 1.0]))
def test_bounds_never_exceed_the_optimum(count: int, seed: int, epsilon: float) -> None:
    points = np.random.default_rng(seed).normal(size=(count, 3, 2))
    optimum = smallest_cover(points, points, epsilon)
    apart = packing(points, epsilon)
    assert (distances(points[apart], points[apart])[~np.eye(len(apart), dtype=bool)] > 2 * epsilon).all()
    bound = fractional_bound(points, epsilon)
    assert len(apart) <= np.ceil(bound.value) <= optimum <= len(greedy_cover(points, epsilon))
    assert bound.value == pytest.approx(bound.weights.sum())


@settings(deadline=None, max_examples=10)
@given(st.just(5), st.integers(0, 10_000))
def test_the_packing_holds_for_centres_anywhere(count: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    points = random.normal(size=(count, 2, 2))
    between = (points[:, None] + points[None]).reshape(-1, 2, 2) / 2  # holds the points themselves
    assert len(packing(points, 0.6)) <= smallest_cover(points, between, 0.6)


@settings(deadline=None, max_examples=10)
@given(st.just(40), st.integers(0, 10_000))
def test_the_weights_are_a_proof(count: int, seed: int) -> None:
    points = np.random.default_rng(seed).normal(size=(count, 3, 2))
    bound = fractional_bound(points, 0.8)
    assert (bound.weights >= 0).all()
    held = (distances(points[bound.rows], points) <= 0.8).T @ bound.weights
    assert held.max() <= 1


def test_centres_are_among_the_points() -> None:
    assert np.ceil(fractional_bound(on_a_line(0, 1.5, 3), 1.0).value) == 3
    assert np.ceil(fractional_bound(on_a_line(0, 0.75, 1.5, 3), 1.0).value) == 2


def test_the_fraction_is_tighter_than_the_packing() -> None:
    around = np.zeros((5, 1, 2))  # five points in a circle, each within ε of both neighbours: 5/3 balls, hence 2
    angle = 2 * np.pi * np.arange(5) / 5
    around[:, 0] = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    bound = fractional_bound(around, 1.2)
    assert bound.value == pytest.approx(5 / 3, rel=1e-3)
    assert len(packing(around, 1.2)) == 1
    assert smallest_cover(around, around, 1.2) == 2


@pytest.mark.parametrize("rounds", [1, 3])
def test_every_round_proves_a_bound(rounds: int) -> None:
    points = np.random.default_rng(1).normal(size=(320, 3, 2))
    bound = fractional_bound(points, 0.7, rounds=rounds)
    held = (distances(points[bound.rows], points) <= 0.7).T @ bound.weights
    assert held.max() <= 1
    assert bound.value > 1


def test_same_seed_same_bound() -> None:
    points = np.random.default_rng(2).normal(size=(320, 3, 2))
    first, second = (fractional_bound(points, 0.7, rounds=2, seed=3) for _ in range(2))
    assert np.array_equal(first.weights, second.weights)
    assert np.array_equal(packing(points, 0.3, seed=1), packing(points, 0.3, seed=1))
