"""Scenes for the planner; lets the tests of this folder import `planning_scenes`."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from coverdrive.planning.surroundings import Surroundings

sys.path.insert(0, str(Path(__file__).parent))

STEPS = 12


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
