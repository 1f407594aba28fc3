"""The way to a lane."""

import pytest
from planning_scenes import CONSTANTS, DT, PERIOD

from coverdrive.planning.evaluate import drive_step
from coverdrive.planning.motion import lane_seeking


@pytest.mark.parametrize("speed", [3.0, 20.0, 40.0])
@pytest.mark.parametrize("target", [1.8, 5.4])
def test_lane_seeking_reaches_the_lane(speed: float, target: float) -> None:
    state, before, elapsed, lats = (0.0, 1.8, speed, 0.0), (0.0, 0.0), PERIOD, []
    for _ in range(40):
        turn = lane_seeking(state[1], state[2], state[3], target, 1.0)
        (before, state), elapsed = drive_step(state, (0.0, turn), before, elapsed, CONSTANTS), DT
        lats.append(state[1])
    assert lats[-1] == pytest.approx(target, abs=0.1)
    assert max(lats) < target + 0.3
