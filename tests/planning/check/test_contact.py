"""What the compiled search takes for the clearance of a box against the definition, and its derivatives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coverdrive.planning.check.contact import box_between, box_excess, box_of, parts_of, smooth_half_sizes
from coverdrive.planning.problem.constants import constants_of
from coverdrive.planning.problem.obstacles import FAR, ObstacleSettings, clearance, own_half_sizes, way_to_brake
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.vehicle import VehicleSettings

SHAPES = {order: ProblemSettings(obstacles=ObstacleSettings(order=order)) for order in (2, 4, 8, 16, 32)}
CONSTANTS = {order: constants_of(problem, 0.1) for order, problem in SHAPES.items()}
CAR = VehicleSettings()


def excess_of(order: int, state: np.ndarray, box: list[float], view: float = 100.0) -> tuple:
    """Slack and derivatives for lon, lat, speed and heading."""
    own = smooth_half_sizes(float(state[3]), CONSTANTS[order].vehicle)
    return box_excess(tuple(state.tolist()), own, tuple(box), view, CONSTANTS[order])


def slack_of(order: int, state: np.ndarray, box: list[float]) -> float:
    problem = SHAPES[order]
    own = own_half_sizes(np.hypot(state[3], 0.01), problem.vehicle)
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
    near, slopes = excess_of(order, state, box, view=1.0)
    if expected > -1 + 1e-9:
        assert near == pytest.approx(expected, abs=1e-9)
    else:
        assert near <= -1 + 1e-9
    assert near != -1 or slopes == (0, 0, 0, 0)


@pytest.mark.parametrize("order", [2, 4, 8, 16, 32])
@pytest.mark.parametrize("lat", [0.5, 2.0, -3.0])
@pytest.mark.parametrize("heading", [-0.2, 0.0, 0.1])
@pytest.mark.parametrize("fall", [0.0, 3.0, 7.9])
def test_derivatives(order: int, lat: float, heading: float, fall: float) -> None:
    state, box, small = np.array([-4.0, lat, 30.0, heading]), [5.0, 0.5, 2.5, 1.1, 12.0, fall], 1e-6
    got = excess_of(order, state, box)[1]
    for i, nudge in enumerate(small * np.eye(4)):
        change = (slack_of(order, state + nudge, box) - slack_of(order, state - nudge, box)) / (2 * small)
        assert got[i] == pytest.approx(change, rel=1e-6, abs=1e-8)


@given(st.floats(-0.5, 0.5))
def test_smooth_half_sizes_are_no_smaller_than_those_of_either_sign(heading: float) -> None:
    smooth = smooth_half_sizes(heading, CONSTANTS[8].vehicle)
    for (size, slope), least in zip(smooth, own_half_sizes(abs(heading), CAR), strict=True):
        assert least <= size <= least + 0.01 * CAR.length / 2
        assert slope * heading >= 0


def boxes() -> np.ndarray:
    """A box that goes on by 10 m, grows and gets slower, and one that stands."""
    result = np.zeros((7, 2, 2))
    result[:, 0, 0], result[:, 1, 0] = (0, 5, 2, 1, 7, 3, 1), (10, 6, 3, 2, 5, 3, 1)
    result[:4, :, 1] = np.array([20, 5, 1, 0.5])[:, None]
    return result


def test_a_box_within_a_step_is_between_those_at_its_ends() -> None:
    assert box_of(boxes(), 1, 0) == (10, 6, 3, 2, 5, 3)
    assert box_between(boxes(), 0, 0, 0.25) == pytest.approx((2.5, 5.25, 2.25, 1.25, FAR, 0))


@pytest.mark.parametrize(
    ("way", "slot", "parts"),
    [
        ((10.0, 1.0), 0, 1),
        ((10.0, 0.0), 1, 3),
        ((3.0, 0.0), 1, 1),
        ((3.5, 0.0), 1, 2),
        ((5.0, 5.0), 0, 3),
        ((1e6, 0.0), 1, 8),
    ],
)
def test_a_step_is_looked_at_as_often_as_boxes_could_be_jumped_over(way, slot: int, parts: int) -> None:
    """The half extents of ego and standing box are 3.4 m along and 1.5 m across, of the other 4.4 m and 2 m."""
    assert parts_of(way, (2.4, 1.0), boxes(), 0, slot) == parts
