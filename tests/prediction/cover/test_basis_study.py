"""Bases of several ε: verified covers, bounds in the right order, and files that others can read."""

import numpy as np
import polars as pl
import pytest
from prediction_fakes import segments_of

from coverdrive.errors import SettingError
from coverdrive.prediction.cover.basis import BasisSettings, make_basis
from coverdrive.prediction.cover.basis_study import StudiedBasis, basis_record, point_table, study_bases
from coverdrive.prediction.data.segments import Segments


@pytest.fixture(scope="module")
def segments() -> Segments:
    random = np.random.default_rng(0)
    time = 0.5 * np.arange(7)
    points = np.stack([random.normal(0, 1.5, (120, 1)) * time**2, random.normal(0, 0.5, (120, 1)) * time], axis=-1)
    return segments_of(points)


@pytest.fixture(scope="module")
def studied(segments: Segments) -> tuple[StudiedBasis, ...]:
    return study_bases(segments, (1.0, 0.5, 1.0), BasisSettings(candidates=64), seed=2)


def test_every_epsilon_once_and_as_make_basis_does(segments: Segments, studied: tuple[StudiedBasis, ...]) -> None:
    assert [each.basis.radius for each in studied] == [0.5, 1.0]
    for each in studied:
        expected = make_basis(segments, BasisSettings(radius=each.basis.radius, candidates=64), seed=2)
        assert np.array_equal(each.basis.points, expected.points)


def test_the_cover_is_measured_as_a_slow_loop_does(segments: Segments, studied: tuple[StudiedBasis, ...]) -> None:
    for each in studied:
        growth = np.stack([4 * (1 + np.arange(7) / 6), 1 + np.arange(7) / 6], axis=-1)
        distance = [
            min(np.linalg.norm((point - base) / growth, axis=-1).max() for base in each.basis.points)
            for point in segments.points
        ]
        assert each.covered == 1.0
        assert each.largest == pytest.approx(max(distance), rel=1e-6)
        assert each.largest <= each.basis.radius


def test_bounds_and_masses(studied: tuple[StudiedBasis, ...]) -> None:
    for each in studied:
        assert 1 < each.anywhere <= each.among_segments <= len(each.basis)
        assert each.share.sum() == pytest.approx(1)
        assert each.cumulative[-1] == pytest.approx(1)
        assert each.cumulative[0] == each.share.max()
        assert (np.diff(each.cumulative, 2) <= 1e-12).all()
    assert len(studied[0].basis) > len(studied[1].basis)


def test_points_in_rows(studied: tuple[StudiedBasis, ...]) -> None:
    basis, table = studied[1].basis, point_table(studied[1])
    assert table.columns == ["base", "time", "lon", "lat", "share"]
    back = table.select("lon", "lat").to_numpy().reshape(len(basis), 7, 2)
    assert np.array_equal(back, basis.points)
    assert table.filter(pl.col("base") == 1)["time"].to_list() == [0, 0.5, 1, 1.5, 2, 2.5, 3]
    assert table.group_by("base").first()["share"].sum() == pytest.approx(1)


def test_the_record_says_what_was_measured(studied: tuple[StudiedBasis, ...]) -> None:
    record = basis_record(studied[0])
    assert record["bases"] == len(studied[0].basis) and record["radius"] == 0.5 and record["covered"] == 1.0
    assert record["source"] == studied[1].source


@pytest.mark.parametrize("epsilons", [(), (0.5, 0.0), (-1.0,), (float("nan"),), (float("inf"),)])
def test_radii_that_make_no_sense_are_refused(segments: Segments, epsilons: tuple[float, ...]) -> None:
    with pytest.raises(SettingError, match="positive number"):
        study_bases(segments, epsilons)
