"""IDM and MOBIL against hand-computed cases, limits and a slow loop."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coverdrive.simulation.drivers.idm_mobil import (
    FREE,
    Drivers,
    DriverSettings,
    draw_drivers,
    follow,
    lane_change_advantage,
    neighbours,
)


def usual(count: int, **changes: float) -> Drivers:
    values = {
        "desired_speed": 30.0,
        "time_gap": 1.5,
        "minimum_gap": 2.0,
        "acceleration": 1.0,
        "deceleration": 2.0,
        "politeness": 0.5,
        "threshold": 0.1,
        "safe_deceleration": 4.0,
    }
    return Drivers(**{name: np.full(count, value) for name, value in (values | changes).items()})


def only(value: float) -> np.ndarray:
    return np.array([value])


def test_free_road_acceleration_is_that_of_the_paper():
    assert follow(usual(1), only(0.0), only(FREE), only(0.0)) == pytest.approx(1.0)
    assert follow(usual(1), only(15.0), only(FREE), only(0.0)) == pytest.approx(1 - 0.5**4)
    assert follow(usual(1), only(30.0), only(FREE), only(0.0)) == pytest.approx(0.0)


def test_interaction_is_that_of_the_paper():
    # s* = 2 + 20·1.5 + 20·(20 − 15)/(2·√2) = 67.355; a = 1 − (2/3)⁴ − (67.355/50)²
    desired = 2 + 30 + 100 / (2 * np.sqrt(2))
    expected = 1 - (2 / 3) ** 4 - (desired / 50) ** 2
    assert follow(usual(1), only(20.0), only(50.0), only(15.0)) == pytest.approx(expected)


def test_equilibrium_gap_keeps_the_speed():
    speed = 20.0
    gap = (2 + 1.5 * speed) / np.sqrt(1 - (speed / 30) ** 4)
    assert follow(usual(1), only(speed), only(gap), only(speed)) == pytest.approx(0.0, abs=1e-12)


@given(st.floats(30, 100))
def test_driver_above_desired_speed_brakes_at_most_comfortably(speed: float):
    acceleration = follow(usual(1), only(speed), only(FREE), only(0.0))[0]
    assert -2.0 <= acceleration <= 0


@given(st.floats(0, 40), st.floats(0.2, 200), st.floats(0, 40), st.floats(0.01, 50))
def test_a_larger_gap_never_means_harder_braking(speed: float, gap: float, leader: float, more: float):
    near = follow(usual(1), only(speed), only(gap), only(leader))
    far = follow(usual(1), only(speed), only(gap + more), only(leader))
    assert far >= near


def test_neighbours_of_three_in_a_row():
    lon, length = np.array([0.0, 30.0, 10.0]), np.array([4.0, 6.0, 5.0])
    found = neighbours(lon, length, np.ones((3, 3), dtype=bool))
    assert found.gap.tolist() == pytest.approx([10 - 4.5, FREE, 20 - 5.5])
    assert found.rear_gap.tolist() == pytest.approx([FREE, 20 - 5.5, 10 - 4.5])
    assert (found.leader[0], found.leader[2], found.follower[1], found.follower[2]) == (2, 1, 2, 0)


def test_vehicles_side_by_side_overlap_and_keep_an_order():
    found = neighbours(np.zeros(2), np.full(2, 4.0), np.ones((2, 2), dtype=bool))
    assert found.gap.tolist() == [-4.0, FREE]
    assert found.rear_gap.tolist() == [FREE, -4.0]


@given(st.integers(0, 2**32 - 1))
def test_neighbours_agree_with_a_loop(seed: int):
    random = np.random.default_rng(seed)
    lon, length = random.uniform(0, 200, (2, 6)), random.uniform(3, 12, (2, 6))
    there = random.random((2, 6, 6)) < 0.5
    found = neighbours(lon, length, there)
    for scene in range(2):
        for own in range(6):
            others = [j for j in range(6) if j != own and there[scene, own, j]]
            ahead = [j for j in others if lon[scene, j] > lon[scene, own]]
            behind = [j for j in others if lon[scene, j] < lon[scene, own]]
            half = length[scene, own] / 2
            gap, rear = FREE, FREE
            if ahead:
                j = min(ahead, key=lambda j: lon[scene, j])
                gap = lon[scene, j] - lon[scene, own] - half - length[scene, j] / 2
                assert found.leader[scene, own] == j
            if behind:
                j = max(behind, key=lambda j: lon[scene, j])
                rear = lon[scene, own] - lon[scene, j] - half - length[scene, j] / 2
                assert found.follower[scene, own] == j
            assert found.gap[scene, own] == pytest.approx(gap)
            assert found.rear_gap[scene, own] == pytest.approx(rear)


def advantage_of_first(lon: list[float], speed: list[float], lane: list[int], drivers: Drivers) -> float:
    """Advantage of vehicle 0 in lane 0 of changing to lane 1; all vehicles are 4 m long."""
    lanes = np.array(lane)
    places, speeds, length = np.array(lon), np.array(speed), np.full(len(lon), 4.0)
    current = neighbours(places, length, lanes == lanes[:, None])
    target = neighbours(places, length, lanes == (1 - lanes)[:, None])
    return float(lane_change_advantage(drivers, speeds, length, current, target)[0])


def test_advantage_is_that_of_the_paper():
    # A slow leader 20 m ahead; behind in the new lane somebody who has to brake; nobody behind in the old lane.
    lon, speed, lane = [0.0, 24.0, -44.0], [20.0, 15.0, 20.0], [0, 0, 1]
    drivers = usual(3)
    own = usual(1)
    free, slow = only(FREE), only(15.0)
    gain = follow(own, only(20.0), free, slow) - follow(own, only(20.0), only(20.0), slow)
    loss = follow(own, only(20.0), only(40.0), only(20.0)) - follow(own, only(20.0), free, slow)
    expected = gain + 0.5 * loss - 0.1
    assert advantage_of_first(lon, speed, lane, drivers) == pytest.approx(expected[0])
    assert expected > 0


def test_old_follower_gains_count():
    lon, speed, lane = [0.0, 24.0, -24.0], [20.0, 15.0, 20.0], [0, 0, 0]
    own = usual(1)
    gain = follow(own, only(20.0), only(FREE), only(0.0)) - follow(own, only(20.0), only(20.0), only(15.0))
    before = follow(own, only(20.0), only(20.0), only(20.0))
    after = follow(own, only(20.0), only(44.0), only(15.0))
    expected = gain + 0.5 * (after - before) - 0.1
    assert advantage_of_first(lon, speed, lane, usual(3)) == pytest.approx(expected[0])


def test_unsafe_changes_are_refused():
    beside, close_behind, fast_behind = [2.0], [-5.0], [-40.0]
    for place, speed in ((beside, 20.0), (close_behind, 20.0), (fast_behind, 38.0)):
        assert advantage_of_first([0.0, *place], [20.0, speed], [0, 1], usual(2)) == -np.inf


def test_nobody_changes_lanes_on_an_empty_road():
    assert advantage_of_first([0.0], [20.0], [0], usual(1)) == pytest.approx(-0.1)


def test_drawn_drivers_are_mixed_and_repeatable():
    settings = DriverSettings()
    first = draw_drivers(settings, np.random.default_rng(1), (200,))
    again = draw_drivers(settings, np.random.default_rng(1), (200,))
    assert np.array_equal(first.desired_speed, again.desired_speed)
    assert first.desired_speed.std() > 0.05 * settings.desired_speed
    assert abs(first.desired_speed.mean() / settings.desired_speed - 1) < 0.05
    assert np.all(first.time_gap > 0.5 * settings.time_gap)
