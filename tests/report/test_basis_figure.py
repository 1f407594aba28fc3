"""The basis figure, for few and many base trajectories."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import EllipseCollection, FillBetweenPolyCollection, LineCollection, PolyCollection
from report_fakes import make_basis, make_contents

from coverdrive.errors import DataError
from coverdrive.prediction.cover.basis import Basis
from coverdrive.report.basis_figure import basis_figure, farthest_inside, most_telling
from coverdrive.report.labels import MOST, spread
from coverdrive.report.page.basis import basis_plots
from coverdrive.report.style import save

pytestmark = pytest.mark.usefixtures("no_global_change")


def straight(*ends: tuple[float, float]) -> Basis:
    """Base trajectories that deviate evenly until they end at the given points."""
    points = np.linspace(0, 1, 7)[:, None] * np.array(ends)[:, None]
    return Basis(points, radius=0.5, aspect=4.0, growth=1.0, step=0.5)


@pytest.mark.parametrize("size", [1, 5, 160])
def test_every_base_is_a_line_and_one_has_an_ellipse_at_every_sample(size, tmp_path):
    basis = make_basis(size)
    share = np.random.default_rng(1).dirichlet(np.ones(size))
    figure = basis_figure(basis, share, basis.points)
    plane, along, across = figure.axes[:3]
    for axes in (plane, along, across):
        (lines,) = (each for each in axes.collections if isinstance(each, LineCollection))
        assert len(lines.get_paths()) == size
    (ellipses,) = (each for each in plane.collections if isinstance(each, EllipseCollection))
    base = most_telling(basis, share)
    np.testing.assert_allclose(ellipses.get_offsets(), basis.points[base])
    half = basis.tolerance(0.5, 0.5 * np.arange(7))
    np.testing.assert_allclose(np.stack([ellipses.get_widths(), ellipses.get_heights()], -1), 2 * half)
    assert half[[0, -1]].tolist() == [[2, 0.5], [4, 1]]
    low, high = np.transpose([plane.get_xlim(), plane.get_ylim()])
    assert (low <= basis.points[base] - half).all()
    assert (basis.points[base] + half <= high).all()
    png, pdf = save(figure, tmp_path / "basis")
    assert png.stat().st_size > 10_000
    assert pdf.read_bytes().startswith(b"%PDF-")


def test_a_cut_tube_is_drawn_as_boxes_in_figure_and_page():
    basis = make_basis(3)
    share, base = np.array([0.2, 0.7, 0.1]), most_telling(basis, np.array([0.2, 0.7, 0.1]))
    cut = replace(basis, reach=0.6 * basis.tolerance(0.5, basis.times))
    half = 0.6 * basis.tolerance(0.5, basis.times)
    half[0] = 0
    plane, along, across = basis_figure(cut, share, highlighted=base).axes[:3]
    (boxes,) = (each for each in plane.collections if isinstance(each, PolyCollection))
    low = [path.vertices.min(0) for path in boxes.get_paths()]
    high = [path.vertices.max(0) for path in boxes.get_paths()]
    np.testing.assert_allclose(low, cut.points[base] - half)
    np.testing.assert_allclose(high, cut.points[base] + half)
    for component, axes in enumerate((along, across)):
        (band,) = (each for each in axes.collections if isinstance(each, FillBetweenPolyCollection))
        edges = band.get_paths()[0].vertices
        assert np.ptp(edges[edges[:, 0] == basis.horizon, 1]) == pytest.approx(2 * half[-1, component])
    learned = replace(make_contents(bases=3).learned, base_share=share)
    ellipses, drawn = basis_plots(cut, learned)[0].figure.data[:2]
    last = np.stack([drawn.x, drawn.y], axis=-1)[-6:-1]
    np.testing.assert_allclose(np.ptp(last, axis=0), 2 * half[-1], atol=0.002)
    assert ellipses.fill is None and ellipses.line.dash and drawn.fill == "toself"
    assert "boxes" in basis_plots(cut, learned)[0].caption
    (only, line, *_) = basis_plots(basis, learned)[0].figure.data
    assert only.fill == "toself" and line.name == "base 0"
    assert (
        "ellipses" in basis_plots(basis, learned)[0].caption and "boxes" not in basis_plots(basis, learned)[0].caption
    )


@pytest.mark.parametrize("size", [3, 160])
def test_lines_have_numbers_at_their_ends_unless_there_are_too_many(size):
    basis, learned = make_basis(size), make_contents(bases=size).learned
    share = learned.base_share
    most_common = sorted(map(str, np.argsort(-share)[:MOST]))
    for axes in basis_figure(basis, share).axes[:3]:
        assert sorted(text.get_text() for text in axes.texts) == most_common
    for each in basis_plots(basis, learned)[:3]:
        labels = each.figure.data[-1]
        assert sorted(text.strip() for text in labels.text) == most_common
    plane = basis_plots(basis, learned)[0].figure.data[-1]
    np.testing.assert_allclose([plane.x, plane.y], basis.points[[int(text) for text in plane.text], -1].T, atol=0.001)


def test_labels_are_apart_in_order_and_stay_where_there_is_room():
    places = spread(np.array([5.0, 0.0, 0.1, 9.0]), 1.0)
    np.testing.assert_allclose(places, [5.0, -0.45, 0.55, 9.0])
    assert spread(np.empty(0), 1.0).shape == (0,)


def test_common_bases_are_darker_thicker_and_on_top():
    basis, share = make_basis(3), np.array([0.2, 0.7, 0.1])
    lines = next(each for each in basis_figure(basis, share).axes[0].collections if isinstance(each, LineCollection))
    assert np.asarray(lines.get_array()).tolist() == [0.1, 0.2, 0.7]
    assert (np.diff(lines.get_linewidths()) > 0).all()
    np.testing.assert_allclose(lines.get_segments()[-1][-1], basis.points[1, -1])


def test_equal_and_zero_shares_can_be_drawn(tmp_path):
    basis = make_basis(5)
    for number, share in enumerate([np.full(5, 0.2), np.array([0.0, 0.0, 0.5, 0.5, 0.0])]):
        save(basis_figure(basis, share), tmp_path / str(number))


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
    entries = [
        len(basis_figure(basis, share, segments).legends[0].get_texts())
        for segments in (None, basis.points, basis.points + 9.0)
    ]
    assert entries == [2, 3, 2]


@pytest.mark.parametrize(("share", "base"), [(np.ones(2), 0), (np.ones(3), 3), (np.ones(3), -1)])
def test_what_does_not_belong_to_the_basis_is_refused(share, base):
    with pytest.raises(DataError, match="3 trajectories"):
        basis_figure(make_basis(3), share, highlighted=base)
