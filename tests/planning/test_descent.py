"""The descent against what it promises."""

import numpy as np
import pytest

from coverdrive.planning.constants import constants_of
from coverdrive.planning.descent import descend
from coverdrive.planning.problem import ProblemSettings

CONSTANTS = constants_of(ProblemSettings())


@pytest.mark.parametrize("seed", range(10))
def test_the_merit_never_rises(crowded, seed: int) -> None:
    inputs, around = crowded(seed)
    starts, target = np.stack([inputs, np.zeros(24)]), np.array([1.8, 5.4])
    before = np.inf
    for iterations in (0, 1, 2, 4, 8, 16):
        value = descend(starts, target, np.zeros(2), around, CONSTANTS, iterations, 1e-6).value
        assert (value <= before).all()
        before = value
    assert (before < descend(starts, target, np.zeros(2), around, CONSTANTS, 0, 1e-6).value).any()
