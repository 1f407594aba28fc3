"""The road frame along a line: exact on straight roads and arcs, deaf to the kinks of a drawn map."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import make_smoothing_spline

from coverdrive.errors import DataError
from coverdrive.recordings.roads.line_fit import TOLERANCE, _even, fit_line
from coverdrive.reference_line import ReferenceLine


def turned(points: np.ndarray, angle: float, shift: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return points @ rotation.T + shift


def project(line: ReferenceLine, points: np.ndarray) -> np.ndarray:
    return np.stack(line.to_road(*points.T), axis=-1)


@given(st.floats(-3.1, 3.1), st.floats(-500, 500), st.integers(0, 2**32 - 1))
def test_straight_roads_of_any_direction(angle: float, shift: float, seed: int):
    frame = np.random.default_rng(seed).uniform([-50, -20], [250, 20], (20, 2))
    line = fit_line(turned(np.array([[0.0, 0], [60, 0], [200, 0]]), angle, (shift, -shift)))
    assert line.length == pytest.approx(200)
    assert project(line, turned(frame, angle, (shift, -shift))) == pytest.approx(frame, abs=1e-6)


def test_arcs_keep_their_length_and_offsets():
    radius, angle = 1000.0, 0.3
    along = np.linspace(0, angle, 40)

    def arc(at: np.ndarray, left: float) -> np.ndarray:
        return np.stack([(radius - left) * np.sin(at), radius - (radius - left) * np.cos(at)], axis=-1)

    line = fit_line(arc(along, 0.0))
    assert line.length == pytest.approx(radius * angle, abs=0.05)
    inside = np.linspace(0.05, 0.25, 9)
    for left in (-10.0, 0.0, 6.0):
        lon, lat = project(line, arc(inside, left)).T
        assert lon == pytest.approx(radius * inside, abs=0.1)
        assert lat == pytest.approx(left, abs=0.05)


def test_the_line_goes_on_straight_beyond_its_ends():
    line = fit_line(np.array([[0.0, 0], [50, 0], [100, 0]]))
    assert project(line, np.array([[-30.0, 2], [140, -3]])) == pytest.approx(np.array([[-30.0, 2], [140, -3]]))


def test_kinks_are_smoothed_out():
    points = np.stack([np.linspace(0, 200, 101), 0.05 * (-1.0) ** np.arange(101)], axis=-1)
    line = fit_line(points)
    lon, lat = project(line, np.stack([np.linspace(20, 180, 400), np.full(400, 5.0)], axis=-1)).T
    assert lat == pytest.approx(5.0, abs=0.06)
    assert np.ptp(np.diff(lon)) < 0.01


@pytest.mark.parametrize("radius", [60.0, 150.0, 600.0])
def test_curves_between_straights_are_followed_within_the_tolerance(radius: float):
    way = np.arange(0.0, 200.0)
    angle = np.clip(way - 60, 0, 80) / radius
    drawn = np.cumsum(np.stack([np.cos(angle), np.sin(angle)], axis=-1), axis=0)
    line = fit_line(drawn)
    assert np.abs(project(line, drawn)[:, 1]).max() < TOLERANCE
    assert 1 / np.abs(line.curvature).max() == pytest.approx(radius, rel=0.25)
    assert line.bend == pytest.approx(80 / radius, abs=0.03)


@pytest.mark.parametrize("radius", [60.0, 150.0, 500.0])
def test_arcs_do_not_end_straight(radius: float):
    angle = np.arange(0, 200, 4.0) / radius
    drawn = radius * np.stack([np.sin(angle), 1 - np.cos(angle)], axis=-1)
    line = fit_line(drawn)
    lon, lat = project(line, drawn).T
    assert lat == pytest.approx(0.0, abs=0.25)
    assert line.heading_at(lon) == pytest.approx(angle, abs=0.015)


def test_a_corner_is_no_road():
    with pytest.raises(DataError, match=r"a curve of \d+ m radius, \d+ m after the road's beginning; expected at"):
        fit_line(np.array([[0.0, 0], [100, 0], [100, 100]]))


def test_splines_are_those_of_scipy():
    points = np.random.default_rng(1).normal(0, 0.1, (2, 400)) + 30 * np.sin(np.arange(400) / 60)
    found = _even(points, 0.9, 12.7**4)
    for own, values in zip(found, points, strict=True):
        grid = 0.9 * np.arange(400)
        assert own == pytest.approx(make_smoothing_spline(grid, values, lam=12.7**4 / 0.9)(grid), abs=1e-7)


def test_a_straight_of_199_km_between_two_points_is_not_fitted_point_by_point(lines_run):
    found: list[ReferenceLine] = []
    assert lines_run(lambda: found.append(fit_line(np.array([[0.0, 0.0], [199_000.0, 0.0]])))) < 20_000
    assert found[0].length == pytest.approx(199_000.0)
