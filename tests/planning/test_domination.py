"""Paths that others dominate are left out, and what is clear of the rest is clear of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import coverdrive.planning.planner as planning
from coverdrive.planning.constants import constants_of
from coverdrive.planning.domination import mark_undominated
from coverdrive.planning.obstacles import FAR, Obstacles, clearances
from coverdrive.planning.planner import MpcPlanner
from coverdrive.planning.problem import ProblemSettings
from coverdrive.road import Road

PROBLEM = ProblemSettings()
CAR = PROBLEM.vehicle


def undominated(centres: np.ndarray, half_sizes: np.ndarray, speed: np.ndarray) -> np.ndarray:
    boxes = np.concatenate([centres, half_sizes, speed[..., None]], axis=-1).transpose(2, 0, 1).copy()
    kept = np.empty(centres.shape[1], bool)
    mark_undominated(boxes, CAR.max_heading, CAR.max_speed, constants_of(PROBLEM), kept)
    return kept


def constant(rows: list[tuple[float, float, float, float]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Standing boxes lon, lat, half length, half width; nothing to brake for at the end."""
    values = np.tile(np.array(rows), (12, 1, 1))
    return values[..., :2], values[..., 2:], np.full((12, len(rows)), FAR)


def test_a_box_well_within_another_is_dominated_and_its_equal_is_not() -> None:
    assert undominated(*constant([(30, 5, 2, 1), (30, 5, 4, 2)])).tolist() == [False, True]
    assert undominated(*constant([(30, 5, 4, 2), (30, 5, 2, 1)])).tolist() == [True, False]
    assert undominated(*constant([(30, 5, 2, 1), (30, 5, 2, 1)])).all()
    assert undominated(*constant([(30, 5, 2, 1), (33, 5, 4, 2)])).all()
    assert undominated(*constant([(30, 5, 2, 1), (30, 5, 4, 1.1)])).all()


def test_one_step_outside_is_enough_not_to_be_dominated() -> None:
    centres, half_sizes, speed = constant([(30, 5, 2, 1), (30, 5, 4, 2)])
    centres[4, 0, 0] += 2
    assert undominated(centres, half_sizes, speed).all()


def test_who_must_be_braked_for_harder_is_not_dominated() -> None:
    centres, half_sizes, speed = constant([(30, 5, 2, 1), (30, 5, 40, 9)])
    speed[-1] = [10.0, 20.0]
    assert undominated(centres, half_sizes, speed).all()
    speed[-1] = [20.0, 10.0]
    assert undominated(centres, half_sizes, speed).tolist() == [False, True]


@given(
    st.floats(-12, 12),
    st.floats(-7, 7),
    st.floats(-0.35, 0.35),
    st.floats(0, 45),
    st.floats(-1.5, 1.5),
    st.floats(-0.5, 0.5),
    st.floats(0, 40),
    st.floats(0, 5),
)
def test_whoever_is_clear_of_the_outer_box_is_clear_of_the_inner(
    lon: float, lat: float, heading: float, speed: float, ahead: float, aside: float, inner: float, slower: float
) -> None:
    centres, half_sizes, limits = constant([(0, 0, 5, 2.5), (ahead, aside, 2, 1)])
    limits[-1] = [max(0.0, inner - slower), inner]
    half_sizes[-1, 0] = [9.5, 2.5]
    kept = undominated(centres, half_sizes, limits)
    states = np.tile([lon, lat, speed, heading], (13, 1))
    values = clearances(states, Obstacles(centres, half_sizes, limits), CAR, PROBLEM.obstacles)
    if not kept[1]:
        assert ((values[:, 0] < 1) | (values[:, 1] >= 1)).all()


def test_plans_are_the_same_without_dominated_paths(straight_paths, monkeypatch: pytest.MonkeyPatch) -> None:
    state, road = np.array([0.0, 5.4, 22.0, 0.0]), Road.straight()
    paths = straight_paths((35, 5.4, 15), (35, 5.4, 15), (60, 1.8, 18))
    paths.half_sizes[1] += np.array([12.0, 0.5])
    seen = []

    def spy(*arguments) -> None:
        mark_undominated(*arguments)
        seen.append(arguments[-1].copy())

    monkeypatch.setattr(planning, "mark_undominated", spy)
    fewer = MpcPlanner().plan(state, paths, road)
    assert seen[0].tolist() == [False, True, True]
    monkeypatch.setattr(planning, "mark_undominated", lambda *arguments: arguments[-1].fill(True))
    everything = MpcPlanner().plan(state, paths, road)
    assert everything.slack.max() == 0
    np.testing.assert_allclose(fewer.states, everything.states, atol=1e-3)
