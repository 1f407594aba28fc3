"""Boxes: hand-computed cases, and linear programming as an independent oracle."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from coverdrive.geometry import axis_gap, body_distance, boxes_overlap, turned_half_extents

CAR = np.array([2.4, 0.95])
number = st.floats(-6, 6)
angle = st.floats(-np.pi, np.pi)
size = st.tuples(st.floats(0.3, 3), st.floats(0.3, 3)).map(np.array)


def corners(centre: np.ndarray, heading: float, half: np.ndarray) -> np.ndarray:
    signs = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]])
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    return centre + (signs * half) @ turn


def test_gap_is_bumper_to_bumper() -> None:
    assert axis_gap(np.array(0.0), np.array(10.0), 2.4, 2.6) == pytest.approx(5.0)
    assert axis_gap(np.array(10.0), np.array(7.0), 2.4, 2.6) == pytest.approx(-2.0)


def test_turned_half_extents_by_hand() -> None:
    quarter = turned_half_extents(CAR, np.array(np.pi / 2))
    np.testing.assert_allclose(quarter, [0.95, 2.4], atol=1e-12)
    eighth = turned_half_extents(CAR, np.array(-np.pi / 4))
    np.testing.assert_allclose(eighth, np.full(2, (2.4 + 0.95) / np.sqrt(2)))


@given(size, angle)
def test_turned_half_extents_are_those_of_the_corners(half: np.ndarray, heading: float) -> None:
    expected = np.abs(corners(np.zeros(2), heading, half)).max(axis=0)
    np.testing.assert_allclose(turned_half_extents(half, np.array(heading)), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("lon", "lat", "heading", "overlap"),
    [
        (4.7, 0.0, 0.0, True),
        (4.8, 0.0, 0.0, False),  # bumpers touch
        (0.0, 1.95, 0.0, False),
        (0.0, 1.95, 0.1, True),  # the turned car sticks out
        (4.7, 1.85, 0.0, True),
        (3.0, 2.4, np.pi / 4, True),
        (3.9, 2.4, np.pi / 4, True),  # a corner of the one cuts a side of the other
        (3.9, 2.2, -np.pi / 4, False),  # the upright boxes around them overlap, they do not
    ],
)
def test_overlap_by_hand(lon: float, lat: float, heading: float, overlap: bool) -> None:
    got = boxes_overlap(np.zeros(2), np.array(0.0), CAR, np.array([lon, lat]), np.array(heading), CAR)
    assert got == overlap


def depth(first: tuple[np.ndarray, float, np.ndarray], second: tuple[np.ndarray, float, np.ndarray]) -> float:
    """Largest distance to all sides that a point inside both boxes can have (negative: none), as a linear program."""
    rows, bounds = [], []
    for centre, heading, half in (first, second):
        axes = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
        for axis, extent in zip(axes, half, strict=True):
            for sign in (1, -1):
                rows.append([*(sign * axis), 1.0])
                bounds.append(sign * axis @ centre + extent)
    return -linprog([0, 0, -1], rows, bounds, bounds=[(None, None)] * 3).fun


@settings(max_examples=100, deadline=None)
@given(number, number, angle, angle, size, size)
def test_overlap_agrees_with_a_linear_program(
    lon: float, lat: float, heading: float, other_heading: float, half: np.ndarray, other_half: np.ndarray
) -> None:
    first, second = (np.zeros(2), heading, half), (np.array([lon, lat]), other_heading, other_half)
    margin = depth(first, second)
    assume(abs(margin) > 1e-6)
    got = boxes_overlap(first[0], np.array(heading), half, second[0], np.array(other_heading), other_half)
    assert got == (margin > 0)


@given(number, number, size, size)
def test_upright_boxes_are_boxes_without_heading(
    lon: float, lat: float, half: np.ndarray, other_half: np.ndarray
) -> None:
    centre, other, straight = np.zeros(2), np.array([lon, lat]), np.array(0.0)
    expected = boxes_overlap(centre, straight, half, other, straight, other_half)
    assert np.all(axis_gap(centre, other, half, other_half) < 0) == expected


@given(number, number, angle, angle, size, size)
def test_overlap_is_symmetric(
    lon: float, lat: float, heading: float, other_heading: float, half: np.ndarray, other_half: np.ndarray
) -> None:
    first = (np.zeros(2), np.array(heading), half)
    second = (np.array([lon, lat]), np.array(other_heading), other_half)
    assert boxes_overlap(*first, *second) == boxes_overlap(*second, *first)


def test_functions_broadcast() -> None:
    others = np.array([[0.0, 0.0], [4.0, 0.0], [9.0, 0.0]])
    got = boxes_overlap(np.zeros(2), np.array(0.0), CAR, others, np.zeros(3), CAR)
    np.testing.assert_array_equal(got, [True, True, False])


@given(number, number, angle, angle, size, size)
def test_distance_is_the_least_between_points_of_the_edges(
    lon: float, lat: float, heading: float, other_heading: float, half: np.ndarray, other_half: np.ndarray
) -> None:
    first = (np.zeros(2), np.array(heading), half)
    second = (np.array([lon, lat]), np.array(other_heading), other_half)
    got = body_distance(*first, *second)
    if boxes_overlap(*first, *second):
        assert got == 0
        return
    share = np.linspace(0, 1, 101)[:, None]
    outlines = []
    for centre, turn, extent in (first, second):
        around = corners(centre, float(turn), extent)
        outlines.append(
            np.concatenate([a + share * (b - a) for a, b in zip(around, np.roll(around, 1, 0), strict=True)])
        )
    sampled = np.linalg.norm(outlines[0][:, None] - outlines[1], axis=-1).min()
    assert sampled - 0.06 <= got <= sampled + 1e-9


def test_distance_between_a_turned_and_an_upright_box() -> None:
    turned = body_distance(
        np.zeros(2), np.array(np.pi / 4), np.ones(2), np.array([4.0, 0.0]), np.array(0.0), np.ones(2)
    )
    assert turned == pytest.approx(3 - np.sqrt(2))
