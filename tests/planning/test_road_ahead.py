"""What the planner knows of a road that bends, against the motion in the map."""

import numpy as np
import pytest
from bent_roads import LENGTH, bent_road, in_map
from planning_scenes import CAR, CONSTANTS, DT, PROBLEM

from coverdrive.planning.problem.road_table import table_of
from coverdrive.planning.problem.vehicle import accelerations, step, within_limits, yaw_rates
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import Road
from coverdrive.road_ahead import STRAIGHT, bend_at, controls

CLOTHOID = Road(
    np.arange(4) * 3.6, LENGTH, ReferenceLine(np.zeros(2), 0.3, np.linspace(1 / 150, -1 / 150, 301), LENGTH, lat=2.0)
)


def moments(state: np.ndarray, inputs: np.ndarray, road: Road, dt: float) -> np.ndarray:
    """x, y [m] and heading [rad] in the map at five moments dt [s] apart, the third of which is the state."""
    fine = 20
    after, before = [state], [state]
    for _ in range(2 * fine):
        after.append(step(after[-1], inputs, dt / fine))
        before.append(step(before[-1], inputs, -dt / fine))
    states = np.array([before[2 * fine], before[fine], state, after[fine], after[2 * fine]])
    centre, heading = in_map(states, road)
    return np.concatenate([centre, np.unwrap(heading)[:, None]], axis=1)


@pytest.mark.parametrize("seed", range(20))
def test_controls_are_those_of_the_motion_in_the_map(seed: int) -> None:
    rng, dt = np.random.default_rng(seed), 1e-3
    state = np.array([rng.uniform(20, 580), rng.uniform(0, 10.8), rng.uniform(1, 40), rng.uniform(-0.35, 0.35)])
    inputs = rng.uniform([-8, -0.3], [3, 0.3])
    at = moments(state, inputs, CLOTHOID, dt)
    ways = np.diff(at[:, :2], axis=0)
    speeds = np.hypot(*ways.T) / dt
    got = controls(state, inputs, CLOTHOID, CAR.wheelbase)
    assert got.speed == pytest.approx(speeds[1:3].mean(), rel=1e-5)
    assert got.acceleration == pytest.approx((speeds[2] - speeds[1]) / dt, abs=0.01)
    assert got.yaw_rate == pytest.approx((at[3, 2] - at[1, 2]) / (2 * dt), abs=1e-4)
    assert np.tan(got.steering) == pytest.approx(CAR.wheelbase * got.yaw_rate / got.speed)
    heading = np.unwrap(np.append(at[2, 2], np.arctan2(ways[1:3, 1], ways[1:3, 0])))
    assert heading[1:].mean() == pytest.approx(heading[0], abs=1e-4)  # the car points where it moves to


def test_on_a_straight_road_they_are_the_inputs() -> None:
    state, inputs = np.array([[5.0, 2.0, 20.0, 0.1], [5.0, 2.0, 0.0, 0.1]]), np.array([[1.0, 0.05], [0.0, 0.0]])
    got = controls(state, inputs, Road.straight(), 2.5)
    np.testing.assert_allclose(got.speed, [20, 0], atol=1e-12)
    np.testing.assert_allclose(got.acceleration, [1, 0], atol=1e-12)
    np.testing.assert_allclose(got.yaw_rate, [0.05, 0], atol=1e-12)
    np.testing.assert_allclose(got.steering, [np.arctan(2.5 * 0.05 / 20), 0], atol=1e-12)


@pytest.mark.parametrize("seed", range(30))
def test_bounds_are_those_of_the_real_car(seed: int) -> None:
    """Each of the limits, where it is the one that binds, at the middle of the curve half a step ahead.

    What steering adds to the acceleration, u·C·χ', is left out of its bounds: less than 0.5 m/s² here.
    """
    rng = np.random.default_rng(seed)
    road = Road(np.arange(4) * 3.6, LENGTH, ReferenceLine(np.zeros(2), 0.0, np.full(301, 1 / 150), LENGTH, lat=5.4))
    ahead, speed = table_of(road, PROBLEM).road, rng.uniform(3, 24)
    state = (300.0, rng.uniform(1, 9.8), speed, rng.uniform(-0.2, 0.2))
    bend = bend_at(state, DT, ahead)
    free = CONSTANTS.vehicle._replace(max_steering_rate=1e4)
    rates = yaw_rates(speed, 0.0, (0.0, 0.0), DT, bend, free)
    for rate, side in zip(rates, (-1, 1), strict=True):
        real = controls(np.array(state), np.array([0.0, rate]), road, CAR.wheelbase)
        lateral = real.yaw_rate * real.speed * side
        assert lateral <= CAR.max_lateral_acceleration + 1e-6
        assert real.steering * side <= CAR.max_steering + 1e-9
        assert lateral == pytest.approx(4.0) or real.steering * side == pytest.approx(CAR.max_steering)
    for acceleration, side in zip(accelerations(speed, bend, free), (-1, 1), strict=True):
        for rate in rates:
            real = controls(np.array(state), np.array([acceleration, rate]), road, CAR.wheelbase)
            most = CAR.max_deceleration if side < 0 else min(CAR.max_acceleration, CAR.max_power / real.speed)
            assert abs(real.acceleration * side - most) < 0.5
        real = controls(np.array(state), np.array([acceleration, 0.0]), road, CAR.wheelbase)
        assert real.acceleration * side == pytest.approx(most)


@pytest.mark.parametrize("seed", range(30))
def test_what_is_driven_keeps_the_real_limits_to_second_order(seed: int) -> None:
    """Wild wishes on roads of 150 m radius and more whose curvature changes by up to 1/150 m within 60 m.

    Bounds hold in the middle of a step; at its ends, half a step of 0.1 s away, lateral acceleration is larger by the
    change of speed, by what heading has changed, and by v³·dκ/ds·dt/2.
    """
    rng = np.random.default_rng(seed)
    road = bent_road(rng, tapers=False)
    ahead, before, period = table_of(road, PROBLEM).road, (0.0, 0.0), 0.1
    state = np.array([100.0, rng.uniform(2, 8.8), rng.uniform(2, 22), 0.0])
    lateral, angles, accelerations_ = [], [], []
    for wish in rng.normal(0, [4.0, 0.4], (60, 2)).tolist():
        bend = bend_at(tuple(state), period, ahead)
        wish[0] -= 3.0 * (state[2] > 20)
        before = within_limits(tuple(state), tuple(wish), before, period, period, bend, CONSTANTS.vehicle)
        for share in np.linspace(0, 1, 5):
            there = step(state, np.array(before), share * period)
            real = controls(there, np.array(before), road, CAR.wheelbase)
            lateral.append(real.yaw_rate * real.speed)
            if share == 0.5:  # the wheels stand as the mean speed asks
                angles.append(real.steering)
            accelerations_.append(real.acceleration)
        state = step(state, np.array(before), period)
        if not 3 < state[1] < 7.8 or not 100 <= state[0] <= 500:
            break
    assert np.abs(lateral).max() <= CAR.max_lateral_acceleration * 1.12
    assert np.abs(angles).max() <= CAR.max_steering + 0.01
    assert min(accelerations_) >= -CAR.max_deceleration - 0.6
    assert max(accelerations_) <= CAR.max_acceleration + 0.6


def test_a_straight_road_bends_nothing() -> None:
    table = table_of(Road.straight(), PROBLEM)
    assert len(table.road.rows) == 1 and table.vehicle == CONSTANTS.vehicle == table.reaching
    bend = bend_at((5.0, 3.0, 20.0, 0.2), DT, table.road)
    np.testing.assert_allclose(bend, STRAIGHT, atol=1e-15)
