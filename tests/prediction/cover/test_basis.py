"""The norm, the greedy cover and the interpolation."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from prediction_fakes import segments_of
from safetensors import safe_open

from coverdrive.errors import DataError
from coverdrive.prediction.cover.basis import Basis, BasisSettings, make_basis
from coverdrive.prediction.cover.greedy import greedy_cover
from coverdrive.prediction.data.segments import MIRROR, Segments
from coverdrive.prediction.storage import save_arrays


def random_segments(count: int, seed: int, scale: float = 1.0) -> Segments:
    """Smooth manoeuvres: constant acceleration and a lateral move."""
    random = np.random.default_rng(seed)
    time = 0.5 * np.arange(7)
    lon = random.normal(0, scale, (count, 1)) * time**2
    lat = random.normal(0, scale / 2, (count, 1)) * (1 - np.cos(np.pi * time / 3))
    return segments_of(np.stack([lon, lat], axis=-1))


def basis_of(points: np.ndarray, radius: float = 0.5) -> Basis:
    return Basis(points, radius=radius, aspect=4.0, growth=1.0, step=0.5)


def test_papers_tolerance() -> None:
    basis = basis_of(np.zeros((1, 7, 2)))
    assert basis.tolerance(0.5, np.array([0.0, 3.0])) == pytest.approx(np.array([[2.0, 0.5], [4.0, 1.0]]))


def test_distance_by_hand() -> None:
    point = np.zeros((3, 7, 2))
    point[0, 6] = [4.0, 0.0]  # at the end the tolerance of 0.5 is 4 m × 1 m
    point[1, 6] = [0.0, 2.0]
    point[2, 3] = [3.0, 0.75]  # half-way s = 6/9; (3/4, 0.75)·2/3 = (0.5, 0.5)
    assert basis_of(np.zeros((1, 7, 2))).distance(point)[:, 0] == pytest.approx([0.5, 1.0, np.sqrt(0.5)])


def test_distance_agrees_with_the_formula_of_the_paper() -> None:
    first, second = random_segments(5, 1).points, random_segments(4, 2).points
    expected = np.empty((5, 4))
    for i in range(5):
        for j in range(4):
            s = [6 / (6 + t) for t in range(7)]
            apart = first[i] - second[j]
            expected[i, j] = max(np.hypot(apart[t, 0] * s[t] / 4, apart[t, 1] * s[t]) for t in range(7))
    assert basis_of(second).distance(first) == pytest.approx(expected, rel=1e-5)


def test_a_cut_tube_by_hand() -> None:
    reach = np.tile([6.0, 2.0], (7, 1))
    reach[1] = [0.35, 0.5]  # at 0.5 s the ellipse of ε = 0.5 is 7/3 m × 7/12 m
    basis = replace(basis_of(np.zeros((1, 7, 2))), reach=reach)
    halves = 0.5 * basis.tube(np.array([0.0, 0.25, 0.5, 3.0]))
    assert halves == pytest.approx(np.array([[0, 0], [0.175, 0.25], [0.35, 0.5], [4.0, 1.0]]))
    point = np.zeros((3, 7, 2))
    point[0, 1] = [0.7, 0.0]
    point[1, 1] = [0.0, 0.25]
    point[2, 6] = [4.0, 0.0]
    assert basis.distance(point)[:, 0] == pytest.approx([1.0, 0.25, 0.5])


@pytest.mark.parametrize("seed", range(2))
def test_a_cut_tube_covers_the_same_segments(seed: int) -> None:
    segments = random_segments(400, seed, scale=2.0)
    cut, whole = (make_basis(segments, BasisSettings(cut=cut)) for cut in (True, False))
    assert np.array_equal(cut.points, whole.points)
    for points in (segments.points, segments.points * MIRROR):
        assert np.array_equal(cut.distance(points) <= 0.75, whole.distance(points) <= 0.75)
    early = np.array([0.5])
    assert (cut.tube(early) < 0.5 * whole.tube(early)).all()
    new, radius = random_segments(400, seed + 100, scale=2.0).points, 0.6
    inside = cut.distance(new) <= radius
    apart = np.abs(new[:, None] - cut.points)
    assert inside.any() and not inside.all()
    assert (apart[inside] <= radius * cut.tube(cut.times) * (1 + 1e-5)).all()


def test_segments_that_are_all_alike_leave_some_tube() -> None:
    basis = make_basis(segments_of(np.zeros((3, 7, 2))))
    assert (basis.tube(np.array([0.5, 3.0])) > 0).all()


@settings(deadline=None, max_examples=10)
@given(st.sampled_from([1, 64]), st.integers(0, 1000), st.sampled_from([0.2, 0.5, 1.0]), st.sampled_from([16, 64]))
def test_every_segment_is_covered(count: int, seed: int, epsilon: float, candidates: int) -> None:
    segments = random_segments(count, seed, scale=2.0)
    basis = make_basis(segments, BasisSettings(radius=epsilon, candidates=candidates), seed)
    assert (basis.distance(segments.points).min(1) <= epsilon).all()
    assert len(basis) <= count


def test_the_cover_equals_the_plain_algorithm() -> None:
    segments = random_segments(200, seed=0)
    basis = basis_of(segments.points)
    near = basis.distance(segments.points) <= 0.5
    uncovered, expected = np.ones(200, dtype=bool), []
    while uncovered.any():
        expected.append(int((near & uncovered[:, None]).sum(0).argmax()))
        uncovered &= ~near[:, expected[-1]]
    greedy = len(expected)
    for base in expected[::-1]:
        others = [other for other in expected if other != base]
        if near[:, others].any(1).all():
            expected = others
    assert greedy_cover(basis.scaled(segments.points), 0.5).tolist() == expected
    assert len(expected) < greedy


def test_no_base_can_be_left_out() -> None:
    segments = random_segments(640, seed=2)
    scaled = basis_of(segments.points).scaled(segments.points)
    chosen = greedy_cover(scaled, 0.5, candidates=100)
    basis = basis_of(segments.points[chosen])
    covers = basis.distance(segments.points) <= 0.5
    assert covers.any(1).all()
    assert all((covers.sum(1)[covers[:, base]] == 1).any() for base in range(len(basis)))


def test_same_seed_same_basis() -> None:
    segments = random_segments(64, seed=1)
    few = BasisSettings(candidates=16)
    assert np.array_equal(make_basis(segments, few, seed=4).points, make_basis(segments, few, seed=4).points)


def test_rollout_goes_through_the_points_and_starts_at_the_own_speed() -> None:
    time = 0.5 * np.arange(7)
    points = np.stack([-(time**2), 0.3 * time], axis=-1)[None]
    deviation, rate = basis_of(points).rollout(time)
    assert deviation == pytest.approx(points, abs=1e-9)
    assert rate[0, 0] == pytest.approx([0.0, 0.3], abs=1e-9)
    between, slope = basis_of(points).rollout(np.array([1.25]))
    assert between[0, 0] == pytest.approx([-(1.25**2), 0.375], abs=0.02)
    assert slope[0, 0] == pytest.approx([-2.5, 0.3], abs=0.05)


def test_nothing_or_nonsense_is_refused() -> None:
    with pytest.raises(DataError, match="got 0 segments"):
        make_basis(segments_of(np.zeros((0, 7, 2))))
    with pytest.raises(DataError, match="finite"):
        make_basis(segments_of(np.full((2, 7, 2), np.nan)))


def test_a_saved_basis_is_the_same_basis(tmp_path: Path) -> None:
    basis = basis_of(random_segments(5, 1).points, radius=0.75)
    basis.save(tmp_path / "basis.safetensors", source="abc")
    loaded = Basis.load(tmp_path / "basis.safetensors")
    assert np.array_equal(loaded.points, basis.points) and loaded.tolerances == basis.tolerances
    assert np.array_equal(loaded.reach, basis.reach)
    with safe_open(tmp_path / "basis.safetensors", framework="numpy") as file:
        assert {name: value for name, value in file.metadata().items() if name != "fingerprint"} == {
            "format": "coverdrive basis 4", "radius": "0.75", "aspect": "4.0", "growth": "1.0", "step": "0.5",
            "source": '"abc"',
        }  # fmt: skip


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="not a basis file"):
        Basis.load(tmp_path / "missing.safetensors")
    save_arrays(tmp_path / "other", "predictor", {}, {"points": np.zeros(1)})
    with pytest.raises(DataError, match=r"expected the format 'coverdrive basis 4', got 'coverdrive predictor 4'"):
        Basis.load(tmp_path / "other")
