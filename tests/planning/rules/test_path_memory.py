"""Vehicles that vanish, come back, or have numbers that are none."""

from dataclasses import replace

import numpy as np
import pytest

from coverdrive.paths import PredictedPaths
from coverdrive.planning.rules.path_memory import PathMemory, later


def test_later_paths_of_constant_velocity_move_on(straight_paths) -> None:
    moved = later(straight_paths((10, 1.8, 20)), 0.1)
    expected = straight_paths((12, 1.8, 20))
    np.testing.assert_allclose(moved.points, expected.points)
    np.testing.assert_allclose(moved.half_sizes, expected.half_sizes)


def test_a_vehicle_is_kept_for_the_grace_and_no_longer(straight_paths) -> None:
    memory, both = PathMemory(0.25, 0.1), straight_paths((10, 1.8, 20), (40, 5.4, 10))
    one = both.of(np.array([0]))
    memory.completed(both)
    counts = [len(memory.completed(one)[0]) for _ in range(4)]
    assert counts == [2, 2, 1, 1]


def test_kept_paths_are_where_the_vehicle_would_be(straight_paths) -> None:
    memory, other = PathMemory(1.0, 0.1), straight_paths((10, 1.8, 20), (40, 5.4, 10))
    memory.completed(other)
    memory.completed(other.of(np.array([0])))
    got, complete = memory.completed(other.of(np.array([0])))
    assert complete
    np.testing.assert_array_equal(got.vehicle, [0, 1])
    np.testing.assert_allclose(got.points[1], straight_paths((42, 5.4, 10)).points[0])


def test_a_returned_vehicle_has_its_new_paths(straight_paths) -> None:
    memory, both = PathMemory(1.0, 0.1), straight_paths((10, 1.8, 20), (40, 5.4, 10))
    memory.completed(both)
    memory.completed(both.of(np.array([1])))
    got, _ = memory.completed(both)
    np.testing.assert_array_equal(got.points, both.points)


@pytest.mark.parametrize("index", range(3))
def test_bodies_without_a_size_and_impossible_speeds_are_broken(straight_paths, index: int) -> None:
    memory, paths = PathMemory(1.0, 0.1), straight_paths((10, 1.8, 20), (15, 5.4, 0))
    points, half_sizes = paths.points.copy(), np.array(paths.half_sizes)
    if index == 0:
        half_sizes[1] = -5.0
    elif index == 1:
        half_sizes[1, 3, 1] = np.nan
    else:
        points[1, 6:, 0] += 1e4
    got, complete = memory.completed(PredictedPaths(points, paths.vehicle, half_sizes, paths.dt))
    assert not complete
    np.testing.assert_array_equal(got.vehicle, [0])


def test_broken_paths_are_replaced_if_the_vehicle_is_known(straight_paths) -> None:
    memory, both = PathMemory(1.0, 0.1), straight_paths((10, 1.8, 20), (40, 5.4, 10))
    broken = PredictedPaths(both.points.copy(), both.vehicle, both.half_sizes, both.dt)
    broken.points[1, 3, 0] = np.nan
    paths, complete = memory.completed(broken)
    assert not complete
    np.testing.assert_array_equal(paths.vehicle, [0])
    memory.completed(both)
    paths, complete = memory.completed(broken)
    assert complete
    np.testing.assert_allclose(paths.points[1], straight_paths((41, 5.4, 10)).points[0])


def test_a_vehicle_that_vanished_takes_nobodys_weight_along(straight_paths) -> None:
    paths, memory = straight_paths((10, 1.8, 20), (10, 1.8, 25), (40, 5.4, 10)), PathMemory(1.0, 0.1)
    weighted = replace(paths, vehicle=np.array([0, 0, 1]), weight=np.array([0.2, 0.8, 1.0]))
    memory.completed(weighted)
    got, _ = memory.completed(weighted.of(np.array([0, 1])))
    np.testing.assert_array_equal(got.weight, [0.2, 0.8, 1.0])
    got, _ = memory.completed(weighted.of(np.array([2])))
    np.testing.assert_array_equal(got.weight, [1.0, 0.2, 0.8])
