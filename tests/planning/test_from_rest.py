"""Getting out from behind what stands, at walking pace."""

import numpy as np
import pytest
from jaxtyping import Float

from coverdrive.geometry import boxes_overlap
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Status
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.problem.constants import vehicle_of
from coverdrive.planning.problem.vehicle import VehicleSettings, allowed, slow, step
from coverdrive.planning.rules.manners import MannersSettings
from coverdrive.road import Road

PERIOD, PARTS, HALF = 0.1, 5, np.array([2.25, 0.9])
CAR, TIMES, ROAD = VehicleSettings(), 0.25 * np.arange(13), Road.straight(2)
Others = list[tuple[float, float, float]]
"""lon [m] at the start, lat [m] and speed [m/s] of each"""


def paths_of(others: Others, now: float, learned: bool = False) -> PredictedPaths:
    """Their true futures, or sets like learned ones: who stands may start, and move sideways."""
    points = np.array([np.stack([lon + speed * (now + TIMES), 0 * TIMES + lat], -1) for lon, lat, speed in others])
    half_sizes = np.broadcast_to(HALF, points.shape).copy()
    if learned:
        points[..., 0] += 0.5 * (TIMES / TIMES[-1]) ** 1.8 * np.maximum(3 - np.array(others)[:, 2:], 0)
        half_sizes += np.multiply.outer(TIMES / TIMES[-1], [1.9, 0.5])
    return PredictedPaths(points, np.arange(len(points)), half_sizes, 0.25)


def driven(
    state: list[float], others: Others, time: float, settings: PlannerSettings, learned: bool = False
) -> Float[np.ndarray, "n 4"]:
    """States of a drive in which every plan is clear, and nobody is touched."""
    planner, states = MpcPlanner(settings), [np.array(state)]
    planner.reset(PERIOD)
    for k in range(round(time / PERIOD)):
        plan = planner.plan(states[-1], paths_of(others, k * PERIOD, learned), ROAD)
        assert plan.status is not Status.UNSAFE
        for part in range(PARTS):
            states.append(step(states[-1], plan.applied(PERIOD), PERIOD / PARTS))
            for begun, lat, speed in others:
                there = np.array([begun + speed * PERIOD * (k + (part + 1) / PARTS), lat])
                assert not boxes_overlap(states[-1][:2], states[-1][3], CAR.half_sizes, there, np.array(0.0), HALF)
    return np.array(states)


@pytest.mark.parametrize("lat", [1.8, 5.4])
def test_gets_past_what_stands_from_rest(lat: float):
    ahead = [(8.0 + CAR.length / 2 + HALF[0], lat, 0.0)]
    states = driven([0, lat, 0, 0], ahead, 12.0, PlannerSettings())
    assert states[-1, 0] > 40
    stays = driven([0, lat, 0, 0], ahead, 12.0, PlannerSettings(manners=MannersSettings(like="paper")))
    assert stays[-1, 0] < 10  # in the paper, angle and turning cost the same at any speed


@pytest.mark.parametrize("learned", [False, True])
def test_waits_behind_a_broken_down_car_until_the_lane_beside_is_free(learned: bool):
    column = [(60.0 - 18 * i, 5.4, 14.0) for i in range(12)]
    states = driven([0, 1.8, 20, 0], [(150.0, 1.8, 0.0), *column], 35.0, PlannerSettings(), learned)
    assert states[:, 2].min() < 0.1 and states[-1, 0] > 160


def test_angles_of_who_goes_at_walking_pace():
    for speed, widest in ((1.0, slow(CAR).max_heading), (5.0, CAR.max_heading)):
        state, applied = np.array([0, 3.6, speed, 0]), (0.0, 0.0)
        for _ in range(100):
            applied = allowed(state, (0.0, 1.0), applied, 0.1, ROAD, vehicle_of(CAR))
            state = step(state, np.array(applied), 0.1)
        assert 0.9 * widest < state[3] <= widest + 1e-9
    wide = VehicleSettings(max_heading=1.2)
    assert slow(wide) == wide
