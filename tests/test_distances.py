"""Distances that vehicles keep: by hand, for one vehicle and for all at once."""

import numpy as np
import pytest

from coverdrive.distances import kept
from coverdrive.road import Road
from coverdrive.scene import Scene

ROAD = Road.straight()


def scene(*vehicles: tuple[float, float, float], valid: tuple[bool, ...] | None = None) -> Scene:
    """One moment of cars of 5 m by 2 m at (lon, lat, speed)."""
    lon, lat, speed = np.array(vehicles, dtype=float).T[:, None]
    there = np.ones_like(lon, dtype=bool) if valid is None else np.array([valid])
    return Scene(lon, lat, speed, np.zeros_like(lon), np.full_like(lon, 5.0), np.full_like(lon, 2.0), there)


def test_headways_are_to_the_nearest_in_the_lane_from_bumper_to_bumper() -> None:
    found = kept(scene((0, 1.8, 20), (35, 1.8, 20), (60, 1.8, 10), (-25, 1.8, 40), (12, 5.4, 20)), ROAD, np.array([0]))
    assert found.follower == 3
    assert found.headway == pytest.approx(30 / 20) and found.left == pytest.approx(20 / 40)


def test_the_distance_beside_is_to_whoever_is_alongside() -> None:
    found = kept(scene((0, 1.8, 20), (4, 5.4, 20), (7, 4.2, 20)), ROAD, np.array([0]))
    assert found.beside == pytest.approx(3.6 - 2)


def test_nobody_is_infinitely_far() -> None:
    found = kept(scene((0, 1.8, 20), (30, 1.8, 20), valid=(True, False)), ROAD, np.array([0]))
    distances = (found.headway, found.left, found.beside, found.time_to_collision)
    assert all(np.isinf(each).all() for each in distances)


def test_what_one_keeps_ahead_the_other_is_left() -> None:
    found = kept(scene((0, 1.8, 20), (25, 1.8, 10)), ROAD, np.array([0, 1]))
    np.testing.assert_allclose(found.headway, [[1.0, np.inf]])
    np.testing.assert_allclose(found.left, [[np.inf, 1.0]])
    np.testing.assert_allclose(found.time_to_collision, [[2.0, 2.0]])


def test_who_stands_has_a_finite_headway() -> None:
    assert kept(scene((0, 1.8, 0), (10, 1.8, 0)), ROAD, np.array([0])).headway == pytest.approx(50)
