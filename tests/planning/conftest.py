"""Scenes for the planner: cars that keep their speed and their lane."""

from collections.abc import Callable

import numpy as np
import pytest

from coverdrive.paths import PredictedPaths

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
