"""Synthetic samples whose miss probability is known; the tests may import `certificates_fakes`."""

import sys
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from coverdrive.certificates.calibration import ScoredSamples
from shape_checks import unchecked

sys.path.insert(0, str(Path(__file__).parent))

Draw = Callable[..., ScoredSamples]


@pytest.fixture(autouse=True)
def as_users_call(request: pytest.FixtureRequest) -> Iterator[None]:
    """Thousands of calibrations are not slowed down by checks of shapes, which the fast tests have."""
    with unchecked() if request.node.get_closest_marker("slow") else nullcontext():
        yield


@pytest.fixture
def draw() -> Draw:
    """Uniform bases with uniform scores, of which a share leaves the tube; windows of a vehicle are all alike.

    The threshold c misses a new window with probability outside + (1 − outside)·c, averaged over the bases. The last
    hidden layer is the scores.
    """

    def drawn(
        vehicles: int, bases: int, seed: int, outside: float = 0.0, windows: int = 1, first: int = 0
    ) -> ScoredSamples:
        random = np.random.default_rng(seed)
        scores = random.random((vehicles, bases))
        base = random.integers(0, bases, vehicles)
        distance = np.where(random.random(vehicles) < outside, 1.0, 0.0)
        rows = np.repeat(np.arange(vehicles), windows)
        return ScoredSamples(scores[rows], base[rows], distance[rows], first + rows, scores[rows])

    return drawn
