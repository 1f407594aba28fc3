"""What the compiled search takes for the clearance of a box against the definition, and its derivatives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coverdrive.planning.constants import constants_of
from coverdrive.planning.contact import box_excess
from coverdrive.planning.obstacles import ObstacleSettings, clearance, own_half_sizes, way_to_brake
from coverdrive.planning.problem import ProblemSettings

SHAPES = {order: ProblemSettings(obstacles=ObstacleSettings(order=order)) for order in (2, 4, 8, 16, 32)}


def excess_of(order: int, state: np.ndarray, box: list[float], view: float = 100.0) -> tuple:
    """Slack and derivatives for lon, lat, speed and heading."""
    problem = SHAPES[order]
    sign = 1.0 if state[3] >= 0 else -1.0
    own = own_half_sizes(sign * state[3], problem.vehicle)
    return box_excess(tuple(state[:3]), own, sign, tuple(box), view, constants_of(problem))


def slack_of(order: int, state: np.ndarray, box: list[float]) -> float:
    problem = SHAPES[order]
    own = own_half_sizes(abs(state[3]), problem.vehicle)
    way = way_to_brake(state[2], min(state[2], box[4]), box[5], problem.vehicle.max_deceleration)
    offset = state[0] - box[0], state[1] - box[1]
    value = clearance(offset, (box[2], box[3]), own, way, problem.obstacles)
    return 1 + problem.obstacles.margin - value


@pytest.mark.parametrize("order", [2, 4, 8, 16, 32])
@given(
    lon=st.floats(-20, 20),
    lat=st.floats(-6, 6),
    speed=st.floats(0, 40),
    heading=st.floats(-0.3, 0.3),
    other=st.floats(0, 40),
    fall=st.floats(0, 9),
)
def test_slack_is_that_of_the_definition(
    order: int, lon: float, lat: float, speed: float, heading, other, fall
) -> None:
    state, box = np.array([lon, lat, speed, heading]), [1.0, 0.5, 2.5, 1.1, other, fall]
    expected = slack_of(order, state, box)
    assert excess_of(order, state, box)[0] == pytest.approx(expected, rel=1e-9, abs=1e-9)
    near, slopes, _ = excess_of(order, state, box, view=1.0)
    if expected > -1 + 1e-9:
        assert near == pytest.approx(expected, abs=1e-9)
    else:
        assert near <= -1 + 1e-9
    assert near != -1 or slopes == (0, 0, 0, 0)


@pytest.mark.parametrize("order", [2, 4, 8, 16, 32])
@pytest.mark.parametrize("lat", [0.5, 2.0, -3.0])
@pytest.mark.parametrize("fall", [0.0, 3.0])
def test_derivatives(order: int, lat: float, fall: float) -> None:
    state, box, small = np.array([-4.0, lat, 30.0, 0.1]), [5.0, 0.5, 2.5, 1.1, 12.0, fall], 1e-6
    for i, nudge in enumerate(small * np.eye(4)):
        change = (slack_of(order, state + nudge, box) - slack_of(order, state - nudge, box)) / (2 * small)
        assert excess_of(order, state, box)[1][i] == pytest.approx(change, rel=1e-6, abs=1e-8)
