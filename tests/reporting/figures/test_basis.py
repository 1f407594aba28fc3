"""The figures of a basis, and of sizes against ε."""

from dataclasses import replace

import numpy as np
import pytest
from report_fakes import make_basis, marks_of

from coverdrive.errors import DataError
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.cover.basis_study import StudiedBasis
from coverdrive.reporting.figures.basis import MOST, basis_figure, farthest_inside, most_telling, size_figure, spread
from coverdrive.reporting.plotting import style
from coverdrive.reporting.plotting.drawing import draw, save
from coverdrive.reporting.plotting.figure import Band, Line, Panel, Shapes

pytestmark = pytest.mark.usefixtures("no_global_change")


def straight(*ends: tuple[float, float]) -> Basis:
    """Base trajectories that deviate evenly until they end at the given points."""
    points = np.linspace(0, 1, 7)[:, None] * np.array(ends)[:, None]
    return Basis(points, radius=0.5, aspect=4.0, growth=1.0, step=0.5)


def bases_of(panel: Panel) -> list[Line]:
    """The lines of the base trajectories, from the rarest."""
    return [line for line in marks_of(panel, Line) if line.colour == style.BLACK]


@pytest.mark.parametrize("size", [1, 160])
def test_every_base_is_a_line_and_one_has_an_ellipse_at_every_sample(size, tmp_path):
    basis = make_basis(size)
    share = np.random.default_rng(1).dirichlet(np.ones(size))
    figure = basis_figure(basis, share, basis.points)
    plane, along, across, shares = figure.panels
    for panel in (plane, along, across):
        assert len(bases_of(panel)) == size
    (ellipses,) = marks_of(plane, Shapes)
    base = most_telling(basis, share)
    np.testing.assert_allclose(np.mean(ellipses.outlines, axis=1), basis.points[base], atol=1e-9)
    half = basis.tolerance(0.5, 0.5 * np.arange(7))
    np.testing.assert_allclose(np.ptp(ellipses.outlines, axis=1), 2 * half)
    assert half[[0, -1]].tolist() == [[2, 0.5], [4, 1]]
    low, high = np.transpose([(scale.low, scale.high) for scale in plane.scales])
    assert (low <= basis.points[base] - half).all()
    assert (basis.points[base] + half <= high).all()
    np.testing.assert_allclose(shares.marks[0].height, 100 * np.sort(share)[::-1])
    png, pdf = save(figure, tmp_path / "basis")
    assert png.stat().st_size > 10_000
    assert pdf.read_bytes().startswith(b"%PDF-")


def test_a_cut_tube_is_drawn_as_boxes():
    basis = make_basis(3)
    share, base = np.array([0.2, 0.7, 0.1]), most_telling(basis, np.array([0.2, 0.7, 0.1]))
    cut = replace(basis, reach=0.6 * basis.tolerance(0.5, basis.times))
    half = 0.6 * basis.tolerance(0.5, basis.times)
    half[0] = 0
    figure = basis_figure(cut, share)
    plane, along, across, _ = figure.panels
    ellipses, boxes = marks_of(plane, Shapes)
    np.testing.assert_allclose(np.min(boxes.outlines, axis=1), cut.points[base] - half)
    np.testing.assert_allclose(np.max(boxes.outlines, axis=1), cut.points[base] + half)
    for component, panel in enumerate((along, across)):
        (band,) = marks_of(panel, Band)
        assert band.high[-1] - band.low[-1] == pytest.approx(2 * half[-1, component])
    assert ellipses.dashed and not ellipses.filled and boxes.filled and not boxes.dashed
    assert "boxes" in figure.caption
    whole = basis_figure(basis, share)
    (only,) = marks_of(whole.panels[0], Shapes)
    assert only.filled
    assert "ellipses" in whole.caption and "boxes" not in whole.caption


@pytest.mark.parametrize("size", [3, 160])
def test_lines_have_numbers_at_their_ends_unless_there_are_too_many(size):
    basis = make_basis(size)
    share = np.arange(1, size + 1) / np.arange(1, size + 1).sum()
    most_common = sorted(map(str, np.argsort(-share)[:MOST]))
    panels = basis_figure(basis, share).panels
    for panel in panels[:3]:
        assert sorted(panel.marks[-1].text) == most_common
    labels = panels[0].marks[-1]
    np.testing.assert_allclose([labels.x, labels.y], basis.points[[int(text) for text in labels.text], -1].T)


def test_labels_are_apart_in_order_and_stay_where_there_is_room():
    places = spread(np.array([5.0, 0.0, 0.1, 9.0]), 1.0)
    np.testing.assert_allclose(places, [5.0, -0.45, 0.55, 9.0])
    assert spread(np.empty(0), 1.0).shape == (0,)


def test_common_bases_are_darker_thicker_and_on_top():
    basis, share = make_basis(3), np.array([0.2, 0.7, 0.1])
    lines = bases_of(basis_figure(basis, share).panels[0])
    assert [line.hover.split("\n")[0] for line in lines] == ["base 2", "base 0", "base 1"]
    assert (np.diff([line.width for line in lines]) > 0).all()
    assert (np.diff([line.opacity for line in lines]) > 0).all()
    np.testing.assert_allclose([lines[-1].x[-1], lines[-1].y[-1]], basis.points[1, -1])
    assert lines[-1].hover == "base 1\n70 % of the training segments"


def test_equal_and_zero_shares_can_be_drawn():
    basis = make_basis(5)
    for share in (np.full(5, 0.2), np.array([0.0, 0.0, 0.5, 0.5, 0.0])):
        assert draw(basis_figure(basis, share)).axes


def test_the_most_common_base_that_moves_is_highlighted():
    basis = straight((0, 0), (8.1, 0), (0, 2.1), (7.9, 0))
    assert most_telling(basis, np.array([0.5, 0.1, 0.2, 0.2])) == 2
    assert most_telling(basis, np.array([0.5, 0.2, 0.1, 0.2])) == 1
    assert most_telling(straight((0, 0), (1, 0)), np.array([0.4, 0.6])) == 1


def test_the_example_is_the_farthest_covered_segment():
    basis = straight((4, 0))
    segments = straight((4, 0.5), (4, 0.9), (4, 1.1), (-9, 0)).points
    assert farthest_inside(basis, 0, segments) is not None
    np.testing.assert_array_equal(farthest_inside(basis, 0, segments), segments[1])
    assert farthest_inside(basis, 0, segments[2:]) is None


def test_the_example_is_explained_only_if_there_is_one():
    basis, share = straight((4, 0)), np.ones(1)
    entries = [len(basis_figure(basis, share, segments).named) for segments in (None, basis.points, basis.points + 9.0)]
    assert entries == [2, 3, 2]


def studied(size: int, epsilon: float) -> StudiedBasis:
    basis = Basis(make_basis(size).points, radius=epsilon, aspect=4.0, growth=1.0, step=0.5)
    share = np.random.default_rng(size).dirichlet(np.ones(size))
    return StudiedBasis(basis, share, 1.0, epsilon, size // 4, size // 2, 1.0, 1.0, "abc")


def test_sizes_bounds_and_masses_are_drawn(tmp_path) -> None:
    all_of_them = [studied(40, 0.5), studied(12, 1.0)]
    figure = size_figure(all_of_them)
    assert figure.panels[0].x.label.endswith("[m across the road]")
    size, mass = figure.panels
    assert [list(line.y) for line in marks_of(size, Line)] == [[40, 12], [20, 6], [10, 3]]
    assert list(marks_of(size, Line)[0].x) == [0.5, 1.0]
    for points, each in zip(mass.marks, all_of_them, strict=True):
        np.testing.assert_allclose(points.y, 100 * each.cumulative)
    png, pdf = save(figure, tmp_path / "size")
    assert png.stat().st_size > 10_000 and pdf.read_bytes().startswith(b"%PDF-")


def test_one_basis_can_be_drawn_and_none_is_refused() -> None:
    assert draw(size_figure([studied(8, 0.5)])).axes
    with pytest.raises(DataError, match="at least one basis"):
        size_figure([])
