"""Scenes for the planner; lets the tests of this folder import `planning_scenes`."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from coverdrive.paths import PredictedPaths
from coverdrive.planning.surroundings import Surroundings

sys.path.insert(0, str(Path(__file__).parent))

STEPS, DT = 12, 0.25

PathMaker = Callable[..., PredictedPaths]


@pytest.fixture
def straight_paths() -> PathMaker:
    """A function of rows (lon, lat, speed) that gives one path of constant speed per row, one vehicle each."""

    def make(*rows: tuple[float, float, float]) -> PredictedPaths:
        cars = np.reshape(np.array(rows, dtype=float), (-1, 3))
        points = np.zeros((len(cars), STEPS + 1, 2))
        points[..., 0] = cars[:, 0, None] + cars[:, 2, None] * DT * np.arange(STEPS + 1)
        points[..., 1] = cars[:, 1, None]
        half_sizes = np.tile([2.4, 0.95], (len(cars), STEPS + 1, 1))
        return PredictedPaths(points, np.arange(len(cars)), half_sizes, DT)

    return make


@pytest.fixture
def crowded() -> Callable[[int], tuple[np.ndarray, Surroundings]]:
    """A function of a seed that gives the inputs of 23 nodes and surroundings of an ego among eight moving boxes."""

    from planning_scenes import WANTED, between

    def make(seed: int) -> tuple[np.ndarray, Surroundings]:
        rng = np.random.default_rng(seed)
        state = np.array([0.0, rng.uniform(1.5, 9.3), rng.uniform(10, 30), rng.uniform(-0.05, 0.05)])
        boxes = np.zeros((7, STEPS + 1, 8))
        boxes[0] = rng.uniform(-20, 60, 8) + rng.uniform(5, 8, 8) * np.arange(-1, STEPS)[:, None]
        boxes[1], boxes[2], boxes[3] = rng.choice([1.8, 5.4, 9.0], 8), 2.6, 1.1
        boxes[4], boxes[6] = 1e5, 1.0
        boxes[4, -1] = 20.0
        likely = boxes[:, :, :5].copy()
        likely[2:4] -= 0.2
        inputs = rng.normal(0, [1.0, 0.02], (2 * STEPS - 1, 2))
        return inputs, Surroundings(state, np.zeros(2), between(0.0, 10.8), WANTED, boxes, likely)

    return make
