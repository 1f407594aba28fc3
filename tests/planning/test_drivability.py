"""What is planned and driven passes the kinematic single-track test of the drivability checker, for a BMW 320i.

Our point moves where the car points: it is the middle of the rear axle. The checker looks for a steering rate and an
acceleration that lead from state to state, to 2 cm and 0.03 rad. During a step of ours the wheels stand as its
curvature asks. In a drive they turn in between: at a state they are half-way from one step to the next, and must be
able to go on. A plan's steps are too long for that; there the wheels are where the next step has them, and their rate
is tested apart. T = K + 1 states.
"""

import sys
from importlib.util import find_spec
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bent_roads import bent_road, in_map
from commonroad.common.solution import VehicleType
from commonroad.scenario.state import KSState
from planning_scenes import CAR, CONSTANTS, DT, PERIOD, PROBLEM, STRAIGHT, drive, scene, wishes
from vehiclemodels.parameters_vehicle2 import parameters_vehicle2

from coverdrive.paths import PredictedPaths
from coverdrive.planning.planner import MpcPlanner
from coverdrive.planning.problem.road_table import table_of
from coverdrive.planning.problem.vehicle import step, within_limits
from coverdrive.road import Road
from coverdrive.road_ahead import bend_at, controls

with pytest.MonkeyPatch.context() as patch:
    if find_spec("commonroad.geometry.shape") is None:  # gone in commonroad-io 2026.1; the checker makes no use of it
        patch.setitem(sys.modules, "commonroad.geometry.shape", SimpleNamespace(Rectangle=lambda **_: None))
    feasibility: Any = pytest.importorskip("commonroad_dc.feasibility.feasibility_checker")
VehicleDynamics = feasibility.VehicleDynamics
BMW: Any = parameters_vehicle2()
ROAD = Road.straight()
Driven = tuple[np.ndarray, np.ndarray]
"""states (T, 4) and inputs (K, 2)"""


def difference(u: np.ndarray, before: np.ndarray, after: np.ndarray, dt: float, car: Any, *_: Any) -> float:
    """What the checker makes small: squares, since its own sum of angles and ways has no derivative where it is 0."""
    reached = car.forward_simulation(before, u, dt, throw=False)
    return 100.0 if reached is None else float((((reached - after)[[0, 1, 3, 4]]) ** 2).sum())


def checks(states: np.ndarray, angles: np.ndarray, dt: float) -> bool:
    """Whether the checker finds the states (T, 4) feasible with these angles (T) [rad] of the wheels."""
    points = states[:, :2] + BMW.b * np.stack([np.cos(states[:, 3]), np.sin(states[:, 3])], axis=-1)
    rows = [
        KSState(k, points[k], velocity=states[k, 2], orientation=states[k, 3], steering_angle=angles[k])
        for k in range(len(states))
    ]
    car = VehicleDynamics.KS(VehicleType.BMW_320i)
    return all(reachable(*pair, dt, car) for pair in pairwise(rows))


def reachable(before: KSState, after: KSState, dt: float, car: Any) -> bool:
    """Whether the checker finds inputs from one state to the next.

    It is told those that turn the wheels and the speed into the next: its search begins at none, takes long and may end
    early.
    """
    now, then = (car.state_to_array(each)[0] for each in (before, after))
    reached = car.forward_simulation(now, (then - now)[2:4] / dt, dt, throw=False)  # None beyond the limits of the car
    if reached is not None and feasibility.position_orientation_feasibility_criteria(then, reached, car):
        return True
    return bool(feasibility.state_transition_feasibility(before, after, car, dt, objective=difference, ftol=1e-12)[0])


def wheels(states: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Angles (K) [rad] of the wheels during the steps; straight where the car stands."""
    mean = (states[:-1, 2] + states[1:, 2]) / 2
    return np.arctan((BMW.a + BMW.b) * np.where(mean > 1e-6, inputs[:, 1], 0.0) / np.maximum(mean, 1e-6))


def turning(states: np.ndarray, inputs: np.ndarray) -> float:
    """[rad] by which the wheels turn at the most from one step to the next, while the car moves."""
    moving = np.minimum(states[:-2, 2], states[2:, 2]) > 1e-6
    return float(np.abs(np.diff(wheels(states, inputs)))[moving].max(initial=0.0))


def drive_passes(states: np.ndarray, inputs: np.ndarray) -> bool:
    during = wheels(states, inputs)
    angles = (np.append(0.0, during) + np.append(during, during[-1])) / 2
    assert turning(states, inputs) <= BMW.steering.v_max * PERIOD * (1 + 1e-6)
    return checks(states, angles, PERIOD)


def plan_passes(states: np.ndarray, inputs: np.ndarray) -> bool:
    during = wheels(states, inputs)
    assert turning(states, inputs) <= BMW.steering.v_max * DT * (1 + 1e-6)
    return checks(states, np.append(during, during[-1]), DT)


def rushed(rng: np.random.Generator, vehicle: Any, speed: float, steps: int = 25) -> Driven:
    """A drive that follows wild wishes within the limits of a vehicle, anew in every period."""
    states, inputs = [np.array([0.0, 5.4, speed, 0.0])], [np.zeros(2)]
    for faster, turn in rng.normal(0, [4.0, 0.4], (steps, 2)).tolist():
        applied = within_limits(tuple(states[-1]), (faster, turn), tuple(inputs[-1]), PERIOD, PERIOD, STRAIGHT, vehicle)
        inputs.append(np.array(applied))
        states.append(step(states[-1], inputs[-1], PERIOD))
    return np.array(states), np.array(inputs[1:])


def planned(state: np.ndarray, paths: PredictedPaths, steps: int = 25) -> tuple[Driven, list[Driven]]:
    """A drive among vehicles on their paths, and of every tenth plan both branches."""
    planner, states, inputs, plans, times = MpcPlanner(), [state], [], [], DT * np.arange(paths.points.shape[1])
    planner.reset(PERIOD)
    for k in range(steps):
        ahead = np.minimum(k * PERIOD + times, times[-1])
        points = [[np.interp(ahead, times, path[:, i]) for i in range(2)] for path in paths.points]
        moved = np.reshape(points, (-1, 2, len(times))).swapaxes(1, 2)
        plan = planner.plan(states[-1], PredictedPaths(moved, paths.vehicle, paths.half_sizes, DT), ROAD)
        if k % 10 == 0:
            branches = (plan.states, plan.held)
            plans += [
                (each, np.concatenate([plan.inputs[:1], np.diff(each[1:, 2:], axis=0) / DT])) for each in branches
            ]
        inputs.append(plan.inputs[0])
        states.append(step(states[-1], plan.inputs[0], PERIOD))
    return (np.array(states), np.array(inputs)), plans


def test_the_limits_are_those_of_the_models() -> None:
    assert CAR.wheelbase == pytest.approx(BMW.a + BMW.b, abs=1e-3)
    assert (CAR.max_steering, CAR.max_steering_rate) == (BMW.steering.max, BMW.steering.v_max)
    assert (-CAR.max_steering, -CAR.max_steering_rate) == (BMW.steering.min, BMW.steering.v_min)
    assert CAR.max_power == pytest.approx(BMW.longitudinal.a_max * BMW.longitudinal.v_switch, rel=1e-3)
    assert CAR.max_power <= BMW.longitudinal.a_max * BMW.longitudinal.v_switch
    assert np.hypot(CAR.max_deceleration, CAR.max_lateral_acceleration) < BMW.longitudinal.a_max
    assert CAR.max_speed < BMW.longitudinal.v_max


@pytest.mark.parametrize("speed", [0.0, 2.0, 10.0, 45.0])
def test_a_rushed_drive_passes_and_without_limits_does_not(speed: float) -> None:
    rng = np.random.default_rng(int(speed))
    assert all(drive_passes(*rushed(rng, CONSTANTS.vehicle, speed)) for _ in range(2))
    if 0 < speed < 12:  # faster, the lateral acceleration is the tighter bound
        free = CONSTANTS.vehicle._replace(max_steering=1.57, max_steering_rate=1e4)
        states, inputs = rushed(rng, free, speed)
        assert turning(states, inputs) > 0.4 * PERIOD
        during = wheels(states, inputs)
        assert not checks(states, (np.append(0.0, during) + np.append(during, during[-1])) / 2, PERIOD)


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_the_checker_knows_the_power(factor: float) -> None:
    start, inputs = np.array([0.0, 5.4, 40.0, 0.0]), np.array([factor * CAR.max_power / 40.0, 0.0])
    assert checks(np.stack([start, step(start, inputs, DT)]), np.zeros(2), DT) is (factor == 1.0)


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 60))])
def test_drives_and_plans_in_random_scenes_pass(seed: int) -> None:
    """Most begin with an emergency, every third from standstill or slowly."""
    state, paths = scene(rng := np.random.default_rng(seed))
    if seed % 3 == 0:
        state[2:] = rng.choice([0.0, 1.0, 4.0]), 0.0
    driven, plans = planned(state, paths)
    assert drive_passes(*driven)
    assert all(plan_passes(*plan) for plan in plans)


@pytest.mark.parametrize("speed", [3.0, 30.0])
@pytest.mark.parametrize("lanes", [[5.4], [1.8, 5.4, 9.0]], ids=["evades", "brakes"])
def test_emergencies_pass(straight_paths, speed: float, lanes: list[float]) -> None:
    driven, plans = planned(np.array([0, 5.4, speed, 0.0]), straight_paths(*((6 + speed, lat, 0) for lat in lanes)))
    assert drive_passes(*driven)
    assert all(plan_passes(*plan) for plan in plans)


def test_simple_manoeuvres_pass() -> None:
    states, inputs = drive(np.array([0.0, 5.4, 8.0, 0.1]), wishes(np.random.default_rng(0), 4, 12))
    assert all(plan_passes(*each) for each in zip(states, inputs, strict=True))


@pytest.mark.parametrize("speed", [2.0, 6.0, 10.0, 15.0, 22.0])
def test_rushed_drives_around_bends_pass(speed: float) -> None:
    """Driven in the road frame on a road of 150 m radius and more, and seen in the map."""
    rng = np.random.default_rng(int(speed))
    road = bent_road(rng, tapers=False)
    ahead, driven, before = table_of(road, PROBLEM).road, [np.array([200.0, 5.4, speed, 0.0])], (0.0, 0.0)
    for faster, turn in rng.normal(0, [4.0, 0.4], (25, 2)).tolist():
        bend = bend_at(tuple(driven[-1]), PERIOD, ahead)
        before = within_limits(tuple(driven[-1]), (faster, turn), before, PERIOD, PERIOD, bend, CONSTANTS.vehicle)
        driven.append(step(driven[-1], np.array(before), PERIOD))
    centre, heading = in_map(np.array(driven), road)
    speeds = controls(np.array(driven), np.zeros((26, 2)), road, CAR.wheelbase).speed
    states = np.column_stack([centre, speeds, np.unwrap(heading)])
    inputs = np.diff(states[:, 2:], axis=0) / PERIOD
    during = wheels(states, inputs)
    assert turning(states, inputs) <= 1.02 * BMW.steering.v_max * PERIOD
    assert np.abs(inputs[:, 1] * (states[1:, 2] + states[:-1, 2]) / 2).max() <= 1.03 * CAR.max_lateral_acceleration
    assert checks(states, (np.append(during[0], during) + np.append(during, during[-1])) / 2, PERIOD)
