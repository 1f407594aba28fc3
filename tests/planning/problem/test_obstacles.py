"""The obstacle constraint contains the boxes; culling and choosing change nothing."""

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from planning_scenes import CAR, drive, smallest_slack

from coverdrive.geometry import boxes_overlap
from coverdrive.paths import PredictedPaths
from coverdrive.planning.problem.obstacles import (
    FAR,
    ObstacleSettings,
    obstacles_of,
    own_half_sizes,
    reachable,
    reachable_range,
    shrink_tubes,
)
from coverdrive.planning.problem.road_table import table_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.surroundings import surroundings_of
from coverdrive.reporting.drives.active_constraints import clearances
from coverdrive.road import Road

ORDERS: tuple[Literal[2, 4, 8, 16, 32], ...] = (2, 4, 8, 16, 32)
SHAPES = [ObstacleSettings(order=order) for order in ORDERS]


def one_step(lon: float, lat: float, half_length: float, half_width: float, speed: float = FAR) -> np.ndarray:
    return np.tile(np.array([lon, lat, half_length, half_width, speed, 0.0, 1.0])[:, None, None], (1, 2, 1))


@pytest.mark.parametrize("shape", SHAPES)
@given(st.floats(-8, 8), st.floats(-5, 5), st.floats(-np.pi, np.pi), st.floats(0.1, 4), st.floats(0.1, 2))
def test_overlapping_boxes_violate_the_constraint(
    shape: ObstacleSettings, lon: float, lat: float, heading: float, half_length: float, half_width: float
) -> None:
    states = np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 20.0, heading]])
    value = clearances(states, one_step(lon, lat, half_length, half_width), CAR, shape)[0, 0]
    overlap = boxes_overlap(
        np.zeros(2),
        np.array(heading),
        CAR.half_sizes,
        np.array([lon, lat]),
        np.array(0.0),
        np.array([half_length, half_width]),
    )
    assert not overlap or value < 1


@pytest.mark.parametrize("shape", SHAPES)
def test_constraint_is_tight_at_the_corner(shape: ObstacleSettings) -> None:
    """Boxes whose corners touch are at the bound, to the millimetre."""
    states = np.zeros((2, 4))
    half = np.array([3.0, 1.0]) + CAR.half_sizes
    touching = clearances(states, one_step(half[0] - 0.001, half[1] - 0.001, 3.0, 1.0), CAR, shape)[0, 0]
    apart = clearances(states, one_step(half[0] + 0.001, half[1] + 0.001, 3.0, 1.0), CAR, shape)[0, 0]
    assert touching < 1 <= apart


@pytest.mark.parametrize("shape", SHAPES)
def test_inflation_puts_the_corner_on_the_superellipse(shape: ObstacleSettings) -> None:
    assert 2 * shape.inflation**-shape.order == pytest.approx(1)


@pytest.mark.parametrize("shape", SHAPES)
@given(st.floats(-8, 30), st.floats(-5, 5), st.floats(0, 30), st.floats(0, 20), st.floats(0, 1))
def test_the_way_to_brake_is_covered_at_the_end(
    shape: ObstacleSettings, lon: float, lat: float, speed: float, other: float, share: float
) -> None:
    """The own box, moved ahead by any part of the way that braking to the other's speed takes, meets no clear box."""
    states = np.array([[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, speed, 0.0]])
    value = clearances(states, one_step(lon, lat, 2.0, 1.0, other), CAR, shape)[0, 0]
    way = max(0.0, speed - other) ** 2 / (2 * CAR.max_deceleration)
    apart = np.abs([lon - share * way, lat]) >= CAR.half_sizes + np.array([2.0, 1.0])
    assert value < 1 or apart.any()


def test_summed_semi_axes_do_not_contain_the_boxes() -> None:
    """The paper's ellipse, without inflation, allows two cars to overlap by their corners: why there is one."""
    offset = np.array([4.0, 1.5])
    assert boxes_overlap(np.zeros(2), np.array(0.0), CAR.half_sizes, offset, np.array(0.0), CAR.half_sizes)
    assert ((offset / (2 * CAR.half_sizes)) ** 2).sum() > 1


def test_slack_is_that_of_the_worst_box() -> None:
    values = np.array([[0.7, 1.4, 0.9], [1.1, 1.0, 5.0]])
    np.testing.assert_allclose(smallest_slack(values, 0.0), [0.3, 0.0])
    np.testing.assert_array_equal(smallest_slack(np.zeros((2, 0)), 0.1), [0.0, 0.0])


@pytest.mark.parametrize("shape", SHAPES)
def test_culling_keeps_all_that_can_be_met(straight_paths, shape: ObstacleSettings) -> None:
    state = np.array([100.0, 5.4, 20.0, 0.0])
    rows = [(100 + d, 1.8 + 3.6 * (i % 3), 20.0 + i % 5) for i, d in enumerate(range(-300, 300, 7))]
    everything, _ = obstacles_of(straight_paths(*rows), shape)
    near = reachable(state, everything, 0.25, CAR, shape)
    kept = everything[:, :, near]
    assert 0 < near.sum() < len(near)
    wishes = np.random.default_rng(0).choice([-8.0, -0.2, 0.0, 0.2, 3.0], size=(200, 12, 2))
    states, _ = drive(state, wishes)
    with_all = smallest_slack(clearances(states, everything, CAR, shape), 0.01)
    np.testing.assert_array_equal(smallest_slack(clearances(states, kept, CAR, shape), 0.01), with_all)
    assert with_all.max() > 0.1


@given(st.integers(0, 2**32 - 1), st.floats(-1, 60), st.floats(-0.6, 0.6), st.sampled_from([-1.0, 1.0]))
def test_what_some_motion_touches_is_kept(seed: int, speed: float, heading: float, side: float) -> None:
    state, shape = np.array([7.0, 2.0, speed, heading]), ObstacleSettings(terminal_braking=False)
    wishes = np.random.default_rng(seed).choice([-10.0, -1.0, 0.0, 1.0, 10.0], size=(20, 12, 2))
    states, _ = drive(state, wishes)
    touching = states[..., :2] + side * np.array([own_half_sizes(0.0, CAR)[0] + 0.01, 0.0])
    sizes = np.full((20, 13, 2), 0.01)
    paths = PredictedPaths(touching, np.arange(20), sizes, 0.25)
    assert reachable(state, obstacles_of(paths, shape)[0], 0.25, CAR, shape).all()


@given(st.integers(0, 2**32 - 1), st.floats(-1, 60), st.floats(-0.6, 0.6))
def test_every_motion_stays_in_the_reachable_range(seed: int, speed: float, heading: float) -> None:
    state = np.array([7.0, 2.0, speed, heading])
    wishes = np.random.default_rng(seed).choice([-10.0, -1.0, 0.0, 1.0, 10.0], size=(20, 12, 2))
    states, _ = drive(state, wishes)
    low, high = reachable_range(state, 13, 0.25, CAR)
    assert (states[..., 0] >= low - 1e-9).all()
    assert (states[..., 0] <= high + 1e-9).all()


def test_reachable_range_by_hand() -> None:
    low, high = reachable_range(np.array([5.0, 2.0, 44.0, 0.0]), 3, 0.5, CAR)
    np.testing.assert_allclose(high, 5 + np.array([0, 22 + 1 / 3, 45 - 1 / 6]))
    np.testing.assert_allclose(low, 5 + np.cos(0.35) * np.array([0, 21, 40]))
    assert reachable_range(np.array([5.0, 2.0, 4.0, 0.0]), 3, 0.5, CAR)[0][-1] == pytest.approx(5 + np.cos(0.35))


def test_what_no_motion_comes_near_is_left_out(straight_paths) -> None:
    """In 3 s a car at 20 m/s gets 20 m far at the least, braking, and 73.5 m at the most."""
    shape = ObstacleSettings(terminal_braking=False)
    boxes, _ = obstacles_of(
        straight_paths((-8.0, 2.0, 0.0), (-5.0, 2.0, 0.0), (85.0, 2.0, 0.0), (78.0, 2.0, 0.0)), shape
    )
    near = reachable(np.array([0.0, 2.0, 20.0, 0.0]), boxes, 0.25, CAR, shape)
    assert near.tolist() == [False, True, False, True]


def test_surroundings_are_what_can_be_met_seen_from_the_ego(straight_paths) -> None:
    state, problem = np.array([50.0, 1.8, 20.0, 0.0]), ProblemSettings()
    paths = straight_paths((-900, 1.8, 20), (60, 5.4, 10), (900, 5.4, 10))
    around = surroundings_of(state, np.zeros(2), paths, table_of(Road.straight(), problem), problem)
    assert around.boxes.shape == around.likely.shape == (7, 13, 1)
    np.testing.assert_allclose(around.boxes[:2, :, 0].T, paths.points[1] - [50, 0])
    np.testing.assert_array_equal(around.boxes[2:4, :, 0].T, paths.half_sizes[1])
    np.testing.assert_array_equal(around.boxes[4:6, -1, 0], [10, 0])
    np.testing.assert_array_equal(around.boxes[4, :-1, 0], FAR)
    np.testing.assert_array_equal(around.boxes[6], 1.0)


def test_speed_to_brake_to_at_the_end_goes_on_as_it_fell(straight_paths) -> None:
    """From 10 m/s at 2 m/s²: over the last step it is 4.25 m/s fast in the mean, and 4 m/s at its end."""
    paths = straight_paths((0, 1.8, 10), (0, 5.4, 10))
    time = 0.25 * np.arange(13)
    paths.points[0, :, 0] = 10 * time - time**2
    obstacles, _ = obstacles_of(paths, ObstacleSettings())
    np.testing.assert_allclose(obstacles[5, -1], [2, 0], atol=1e-9)
    np.testing.assert_allclose(obstacles[4, -1], [4, 10])
    assert (obstacles_of(paths, ObstacleSettings(terminal_braking=False))[0][4] == FAR).all()


def test_likelihoods_add_up_to_one_for_every_vehicle(straight_paths) -> None:
    paths = replace(straight_paths(*3 * [(0, 1.8, 10)]), vehicle=np.array([7, 2, 7]))
    np.testing.assert_allclose(obstacles_of(paths, ObstacleSettings())[0][6], np.tile([0.5, 1, 0.5], (13, 1)))
    paths = replace(paths, weight=np.array([3.0, 5.0, 1.0]))
    np.testing.assert_allclose(obstacles_of(paths, ObstacleSettings())[0][6], np.tile([0.75, 1, 0.25], (13, 1)))


def test_what_is_likely_is_the_likeliest_path_of_every_vehicle_in_a_part_of_its_tube(straight_paths) -> None:
    paths = straight_paths((0, 1.8, 10), (20, 5.4, 10), (0, 1.8, 12))
    paths = replace(paths, vehicle=np.array([0, 1, 0]), weight=np.array([0.4, 1.0, 0.6]))
    paths.half_sizes[:, 1:] += 1.0
    boxes, likeliest = obstacles_of(paths, ObstacleSettings())
    np.testing.assert_array_equal(likeliest, [False, True, True])
    likeliest = obstacles_of(replace(paths, weight=None), ObstacleSettings())[1]
    np.testing.assert_array_equal(likeliest, [True, True, False])
    likely = boxes.copy()
    shrink_tubes(likely, 0.5)
    np.testing.assert_array_equal(likely[[0, 1, 4, 5]], boxes[[0, 1, 4, 5]])
    np.testing.assert_allclose(likely[2:4, 0], boxes[2:4, 0])
    np.testing.assert_allclose(likely[2:4, 1:], boxes[2:4, 1:] - 0.5)
    np.testing.assert_array_equal(likely[6], 1.0)
