"""The frame beside a curve: its own inverse, exact on arcs, and the same as commonroad-clcs finds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coverdrive.errors import DataError
from coverdrive.reference_line import SMALLEST_RADIUS, ReferenceLine


def winding(seed: int, length: float = 400.0, radius: float = 100.0) -> ReferenceLine:
    """A random line that turns both ways, with its lat and its place in the map at random."""
    random = np.random.default_rng(seed)
    way = np.arange(0.0, length + 1)
    waves = sum(np.sin(way / random.uniform(15, 80) + random.uniform(0, 6)) for _ in range(3))
    heading = float(random.uniform(-3, 3))
    return ReferenceLine(random.uniform(-1e4, 1e4, 2), heading, waves / 3 / radius, length, random.uniform(-10, 10))


@given(st.integers(0, 2**32 - 1))
def test_there_and_back(seed: int):
    line = winding(seed)
    lon, lat = np.random.default_rng(seed).uniform([-50, -20], [450, 20], (200, 2)).T
    lat += line.lat
    found = line.to_road(*line.to_map(lon, lat))
    assert found[0] == pytest.approx(lon, abs=1e-7)
    assert found[1] == pytest.approx(lat, abs=1e-7)


@given(st.integers(0, 2**32 - 1))
def test_the_foot_is_the_nearest_point(seed: int):
    line = winding(seed)
    away = np.random.default_rng(seed).uniform(-45, 45, (100, 2))
    x, y = line.to_map(np.linspace(0, 400, 100), np.full(100, line.lat)) + away.T
    dense = np.stack(line.to_map(np.linspace(0, 400, 8001), np.full(8001, line.lat)))
    nearest = np.min(np.hypot(x[:, None] - dense[0], y[:, None] - dense[1]), axis=1)
    lon, lat = line.to_road(x, y)
    inside = (lon >= 0) & (lon <= 400)
    assert np.abs(lat - line.lat)[inside] == pytest.approx(nearest[inside], abs=0.26)
    assert np.all(np.abs(lat - line.lat)[inside] < nearest[inside] + 0.26)


@pytest.mark.parametrize(("radius", "aside"), [(SMALLEST_RADIUS, 9.0), (150.0, 15.0), (-1000.0, 15.0)])
def test_arcs_are_exact(radius: float, aside: float):
    line = ReferenceLine(np.zeros(2), 0.0, np.full(101, 1 / radius), 100.0, lat=3.0)
    lon, lat = np.meshgrid(np.linspace(0, 0.75 * np.pi * min(abs(radius), 40.0), 21), np.linspace(-aside, aside, 7))
    expected = (radius - lat) * np.sin(lon / radius), radius - (radius - lat) * np.cos(lon / radius)
    assert np.stack(line.to_map(lon, lat + 3.0)) == pytest.approx(np.stack(expected), abs=1e-9)
    assert np.stack(line.to_road(*expected)) == pytest.approx(np.stack([lon, lat + 3.0]), abs=1e-8)
    assert line.heading_at(lon) == pytest.approx(lon / radius, abs=1e-9)
    assert line.curvature_at(lon) == pytest.approx(1 / radius)


def test_the_line_is_as_long_as_it_says_and_its_curvature_linear():
    line = winding(1)
    fine = np.linspace(0, line.length, 400_001)
    x, y = line.to_map(fine, np.full(len(fine), line.lat))
    assert np.sum(np.hypot(np.diff(x), np.diff(y))) == pytest.approx(line.length, abs=1e-6)
    heading = np.unwrap(np.arctan2(np.diff(y), np.diff(x)))
    turned = heading - line.heading_at((fine[1:] + fine[:-1]) / 2)
    assert np.abs(turned - turned[0]).max() < 1e-6
    assert line.curvature_at(np.array([10.5])) == pytest.approx((line.curvature[10] + line.curvature[11]) / 2)


def test_scalars_and_any_shape():
    line = winding(2)
    x, y = line.to_map(12.0, 1.0)
    assert np.shape(x) == ()
    assert line.to_road(np.full((2, 3), x), np.full((2, 3), y))[0] == pytest.approx(np.full((2, 3), 12.0))


def test_mirrored():
    line = winding(3)
    lon, lat = np.linspace(0, 400, 50), np.linspace(-10, 10, 50)
    x, y = line.to_map(lon, lat)
    assert np.stack(line.mirrored().to_map(lon, -lat)) == pytest.approx(np.stack([x, -y]), abs=1e-6)


def test_tight_curves_and_few_points_are_refused():
    curvature = np.zeros(201)
    curvature[100:150] = 1 / 16
    with pytest.raises(DataError, match=r"a curve of 16 m radius, 100 m after.*at least 20 m"):
        ReferenceLine(np.zeros(2), 0.0, curvature, 200.0)
    with pytest.raises(DataError, match=r"every 2 m; expected more than 0 and at most 1\.25 m"):
        ReferenceLine(np.zeros(2), 0.0, np.full(101, 1 / 25), 200.0)
    with pytest.raises(DataError, match="every 10 m; expected"):
        ReferenceLine(np.zeros(2), 0.0, np.zeros(21), 200.0)


@pytest.mark.parametrize("seed", range(3))
def test_commonroad_clcs_finds_the_same(seed: int):
    """Its line is a polyline between points 0.5 m apart, along which it turns the normals evenly."""
    pycrccosy = pytest.importorskip("commonroad_clcs.pycrccosy", reason="needs the extra test")
    line = winding(seed)
    way = np.arange(-60.0, 460.25, 0.5)
    path = np.stack(line.to_map(way, np.full(len(way), line.lat)), axis=-1)
    other = pycrccosy.CurvilinearCoordinateSystem([*path], 40.0, 0.01)
    lon, lat = np.random.default_rng(seed).uniform([0, -15], [400, 15], (500, 2)).T
    x, y = line.to_map(lon, lat + line.lat)
    found = np.array([other.convert_to_curvilinear_coords(*point) for point in zip(x, y, strict=True)])
    start = other.convert_to_curvilinear_coords(*np.ravel(line.to_map(np.zeros(1), np.full(1, line.lat))))[0]
    assert found[:, 0] - start == pytest.approx(lon, abs=0.02)
    assert found[:, 1] == pytest.approx(lat, abs=0.005)
