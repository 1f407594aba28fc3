"""The figure of size against ε."""

import numpy as np
import pytest
from report_fakes import make_basis

from coverdrive.errors import DataError
from coverdrive.prediction.cover.basis import Basis
from coverdrive.prediction.cover.basis_study import StudiedBasis
from coverdrive.reporting.drawing import save
from coverdrive.reporting.figure import Line, Panel
from coverdrive.reporting.size_figure import size_figure

pytestmark = pytest.mark.usefixtures("no_global_change")


def studied(size: int, epsilon: float) -> StudiedBasis:
    basis = Basis(make_basis(size).points, radius=epsilon, aspect=4.0, growth=1.0, step=0.5)
    share = np.random.default_rng(size).dirichlet(np.ones(size))
    return StudiedBasis(basis, share, 1.0, epsilon, size // 4, size // 2, 1.0, 1.0, "abc")


def lines_of(panel: Panel) -> list[Line]:
    return [mark for mark in panel.marks if isinstance(mark, Line)]


def test_sizes_bounds_and_masses_are_drawn(tmp_path) -> None:
    all_of_them = [studied(40, 0.5), studied(12, 1.0)]
    figure = size_figure(all_of_them)
    size, mass = figure.panels
    assert [list(line.y) for line in lines_of(size)] == [[40, 12], [20, 6], [10, 3]]
    assert list(lines_of(size)[0].x) == [0.5, 1.0]
    for points, each in zip(mass.marks, all_of_them, strict=True):
        np.testing.assert_allclose(points.y, 100 * each.cumulative)
    png, pdf = save(figure, tmp_path / "size")
    assert png.stat().st_size > 10_000 and pdf.read_bytes().startswith(b"%PDF-")


def test_one_basis_can_be_drawn_and_none_is_refused(tmp_path) -> None:
    save(size_figure([studied(8, 0.5)]), tmp_path / "size")
    with pytest.raises(DataError, match="at least one basis"):
        size_figure([])
