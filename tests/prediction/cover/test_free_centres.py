"""Covers by any trajectories: fewer than by segments, verified in double precision."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from prediction_fakes import segments_of

from coverdrive.prediction.cover import free_centres as module
from coverdrive.prediction.cover.basis import Basis, BasisSettings, make_basis
from coverdrive.prediction.cover.free_centres import free_centres
from coverdrive.prediction.cover.greedy import MIRROR, greedy_cover


def distances(points: np.ndarray, centres: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, None] - centres[None], axis=-1).max(-1)


def corners() -> np.ndarray:
    """Three points, none within 1 of another, and all in one disc of radius 1."""
    angle = 2 * np.pi * np.arange(3) / 3
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None]


def scattered(count: int, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    return random.normal(size=(count, 1, 2)) * np.linspace(0, 1, 4)[:, None] + random.normal(0, 0.1, (count, 4, 2))


def test_one_centre_between_takes_the_place_of_three_segments() -> None:
    points = corners()
    assert len(greedy_cover(points, 1.001)) == 3
    centres = free_centres(points, points, 1.001)
    assert centres == pytest.approx(np.zeros((1, 1, 2)), abs=1e-3)


def test_nothing_is_gained_where_segments_are_far_apart() -> None:
    points = np.array([0.0, 2.1, 4.2])[:, None, None] * np.array([1.0, 0.0])
    assert np.array_equal(free_centres(points, points, 1.0), points)


def test_a_pair_of_mirror_images_becomes_one_straight_base() -> None:
    points = np.array([[[0.0, 0.4]], [[1.0, 0.0]]])
    centres = free_centres(points, points, 0.7, symmetric=True)
    assert centres.shape == (1, 1, 2) and centres[0, 0, 1] == 0
    assert (distances(points, centres) <= 0.7).all()


@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("first", [20, 20_000])
def test_cover_is_smaller_and_holds_in_double_precision(symmetric: bool, first: int, monkeypatch) -> None:
    """Even if the search knows only few segments at first."""
    monkeypatch.setattr(module, "_FIRST", first)
    points = scattered(150, seed=1)
    chosen = points[greedy_cover(points, 0.6, symmetric=symmetric)]
    centres = free_centres(points, chosen, 0.6, symmetric=symmetric)
    everything = np.concatenate([centres, centres * MIRROR]) if symmetric else centres
    assert (distances(points, everything).min(1) <= 0.6).all()
    assert len(centres) < 0.8 * len(chosen)
    assert np.array_equal(centres, free_centres(points, chosen, 0.6, symmetric=symmetric))


def test_the_order_is_that_of_greedy_choice() -> None:
    points = scattered(150, seed=2)
    centres = free_centres(points, points[greedy_cover(points, 0.6)], 0.6)
    covers = distances(points, centres) <= 0.6 * (1 - 1e-5)
    uncovered = np.ones(len(points), dtype=bool)
    for base in range(len(centres)):
        gains = (covers & uncovered[:, None]).sum(0)
        assert gains[base] == gains.max() > 0
        uncovered &= ~covers[:, base]


@settings(deadline=None, max_examples=10)
@given(st.sampled_from([1, 9, 50]), st.integers(0, 1000), st.sampled_from([0.3, 1.0, 3.0]), st.booleans())
def test_never_more_bases_than_with_segments(count: int, seed: int, epsilon: float, symmetric: bool) -> None:
    random = np.random.default_rng(seed)
    time = 0.5 * np.arange(7)
    points = np.stack([random.normal(size=(count, 1)) * time**2, random.normal(size=(count, 1)) * time], axis=-1)
    points[::3, :, 1] = 0
    segments = segments_of(points)
    of_segments = BasisSettings(radius=epsilon, symmetric=symmetric)
    free = make_basis(segments, of_segments.model_copy(update={"centres": "free"}), seed)
    assert len(free) <= len(make_basis(segments, of_segments, seed))
    assert (distances(free.scaled(points), free.scaled(free.points)).min(1) <= epsilon).all()
    assert (free.points[:, 0] == 0).all()
    if symmetric:
        assert {base.tobytes() for base in free.points + 0.0} == {base.tobytes() for base in free.points * MIRROR + 0.0}


def test_default_takes_segments() -> None:
    points = np.cumsum(np.random.default_rng(0).normal(size=(200, 7, 2)), axis=1)
    points[:, 0] = 0
    basis = make_basis(segments_of(points))
    assert isinstance(basis, Basis)
    assert all((base == points).all((1, 2)).any() for base in basis.points)
