"""The merit against a plain formula, and its derivatives against finite differences."""

import numpy as np
import pytest
from planning_scenes import CAR, CONSTANTS, DT, PERIOD, PROBLEM, WANTED, between

from coverdrive.planning.check.merit import Model, input_bounds, merit
from coverdrive.planning.problem.constants import Constants, constants_of
from coverdrive.planning.problem.cost import OFF_ROAD
from coverdrive.planning.problem.obstacles import FAR, ObstacleSettings, clearance, own_half_sizes, way_to_brake
from coverdrive.planning.problem.rollout import add_pulled_back, curvature_of
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.vehicle import step
from coverdrive.planning.surroundings import Surroundings

STATE = np.array([0.0, 2.0, 22.0, 0.04])
TARGETS = np.array([5.4, 1.8])
NODES = len(CONSTANTS.tree.parent)
INPUTS = np.random.default_rng(1).normal(0, [3.0, 0.1], (3, NODES, 2))


@pytest.fixture
def around() -> Surroundings:
    """Boxes that jump about; some are met, and some passed within a step."""
    rng = np.random.default_rng(3)
    boxes = np.zeros((7, 13, 6))
    boxes[0], boxes[1] = rng.uniform(0, 70, (13, 6)), rng.uniform(0, 11, (13, 6))
    boxes[2], boxes[3], boxes[4], boxes[6] = rng.uniform(2, 4, (13, 6)), rng.uniform(1, 2, (13, 6)), 15.0, 1.0
    road, likely = between(0.0, 10.8), boxes[:, :, :4].copy()
    return Surroundings(STATE, np.array([-0.5, 0.02]), road, WANTED, boxes, likely, sideways=0.5)


def slack_of(state: np.ndarray, box: np.ndarray) -> float:
    """What a box (lon, lat, half length, half width, speed, deceleration) asks for at a moment."""
    own = own_half_sizes(np.hypot(state[3], 0.01), CAR)
    way = way_to_brake(state[2], min(state[2], box[4]), box[5], CAR.max_deceleration)
    offset = state[0] - box[0], state[1] - box[1]
    return 1 + PROBLEM.obstacles.margin - clearance(offset, (box[2], box[3]), own, way, PROBLEM.obstacles)


def by_hand(inputs: np.ndarray, around: Surroundings) -> float:
    """The cost of every node, and the squares of what it violates; boxes that are not passed within a step."""
    tree, value, states = CONSTANTS.tree, 0.0, []
    for n, p in enumerate(tree.parent):
        states.append(step(states[p] if p >= 0 else around.state, inputs[n], DT))
        _, lat, speed, heading = states[n]
        target = TARGETS[1] if tree.safe[n] else TARGETS[0]
        value += tree.errors[n] @ np.square([lat - target, speed - PROBLEM.cost.reference_speed, heading])
        change = inputs[n] - (inputs[p] if p >= 0 else around.previous_input)
        value += tree.inputs[n] @ inputs[n] ** 2 + tree.changes[n] @ change**2
        half_width = own_half_sizes(np.hypot(heading, 0.01), CAR)[1] + PROBLEM.obstacles.edge_margin
        off_road = lat + half_width - 10.8, -lat + half_width
        value += OFF_ROAD * np.square(np.maximum(0, off_road)).sum()
        value += 1e4 * np.square(np.maximum(0, [speed - CAR.max_speed, -speed])).sum()
        value += 1e6 * max(0.0, abs(heading) - CAR.max_heading) ** 2
        value += 0.0 if tree.safe[n] else 1e3 * max(0.0, abs(speed * heading) - around.sideways) ** 2
        boxes = around.boxes if tree.careful[n] else around.likely
        slacks = [slack_of(states[n], boxes[:, tree.moment[n], slot]) for slot in range(boxes.shape[2])]
        value += tree.slack[n] * np.square(np.maximum(0, slacks)).sum()
    return float(value)


@pytest.mark.parametrize("seed", range(5))
def test_merit_is_the_cost_and_the_squares_of_all_violations(crowded, seed: int) -> None:
    """Boxes go on nearly as fast as the ego, so that none is passed within a step."""
    inputs, around = crowded(seed)
    boxes, likely = around.boxes.copy(), around.likely.copy()
    for each in (boxes, likely):
        each[0] = each[0, 1] + around.state[2] * DT * np.arange(13)[:, None]
        each[:2, :, 0] = around.state[2] * DT * np.arange(13) + 4, around.state[1] + 1 + np.zeros(13)
    around = around._replace(boxes=boxes, likely=likely)
    model = merit(inputs, TARGETS, around, CONSTANTS)
    assert (model.constraints.excess > 0.05).sum() > 2
    assert model.value == pytest.approx(by_hand(inputs, around), rel=1e-9)


def test_limits_and_edges_count_as_well(crowded) -> None:
    _, around = crowded(0)
    around = around._replace(state=np.array([0.0, 1.0, 40.0, -0.2]), sideways=1.5)
    around.boxes[0] = around.likely[0] = FAR
    inputs = np.tile([6.0, -0.1], (NODES, 1))
    assert merit(inputs, TARGETS, around, CONSTANTS).value == pytest.approx(by_hand(inputs, around), rel=1e-9)


@pytest.mark.parametrize("lon", np.arange(12.0, 40.0, 1.7))
def test_a_box_within_a_step_is_not_overlooked(lon: float) -> None:
    """A motorcycle in the lane of an ego at 40 m/s, which is at it between two moments."""
    box = np.zeros((7, 13, 1))
    box[:5, :, 0] = np.array([lon, 5.4, 1.1, 0.4, FAR])[:, None]
    around = Surroundings(np.array([0.0, 5.4, 40.0, 0.0]), np.zeros(2), between(0.0, 10.8), WANTED, box, box)
    model = merit(np.zeros((NODES, 2)), TARGETS, around, CONSTANTS)
    assert model.constraints.excess.max() > 0.3


def gradient(model: Model, constants: Constants) -> np.ndarray:
    by_state, by_input = model.by_state.copy(), model.by_input.copy()
    excess, normal, node, weight = model.constraints
    np.add.at(by_state, node, (weight * np.maximum(0, excess))[:, None] * normal)
    add_pulled_back(model.rollout, by_state, constants.tree, constants.dt, by_input)
    return 2 * by_input


@pytest.mark.parametrize("order", [2, 4, 8, 16, 32])
@pytest.mark.parametrize("inputs", INPUTS)
def test_gradient_of_the_merit(inputs: np.ndarray, order: int, around: Surroundings) -> None:
    constants = constants_of(ProblemSettings(obstacles=ObstacleSettings(order=order)), PERIOD)
    model = merit(inputs, TARGETS, around, constants)
    assert (model.constraints.excess > 0).any()
    small, expected = 1e-6, np.empty_like(inputs)
    for at in np.ndindex(inputs.shape):
        nudge = np.zeros_like(inputs)
        nudge[at] = small
        values = [merit(inputs + sign * nudge, TARGETS, around, constants).value for sign in (1, -1)]
        expected[at] = (values[0] - values[1]) / (2 * small)
    got = gradient(model, constants)
    np.testing.assert_allclose(got, expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max())


def test_curvature_without_constraints_is_that_of_the_squares(around: Surroundings) -> None:
    """Nearly so for the yaw rate, of whose way across half a step is left out."""
    around.boxes[0] = around.likely[0] = FAR
    straight, targets = np.zeros((NODES, 2)), np.array([5.4, 5.4])
    around = around._replace(state=np.array([0.0, 5.4, 20.0, 0.0]), previous_input=np.zeros(2))
    small, got = 1e-3, curvature_of(merit(straight, targets, around, CONSTANTS).rollout, CONSTANTS.tree, CONSTANTS.dt)
    for n, i in np.ndindex(straight.shape):
        nudge = np.zeros_like(straight)
        nudge[n, i] = small
        ends = [gradient(merit(straight + sign * nudge, targets, around, CONSTANTS), CONSTANTS) for sign in (1, -1)]
        expected = (ends[0] - ends[1])[n, i] / (4 * small)
        assert got[n, i] == pytest.approx(expected, rel=0.2 if i == 1 else 1e-3)


def test_bounds_of_the_inputs_by_hand() -> None:
    """From 22 m/s under full braking; the first input is near the one before, by 20 m/s³ in 0.1 s."""
    nothing = np.zeros((7, 13, 0))
    around = Surroundings(STATE, np.array([-1.0, 0.02]), between(0.0, 10.8), WANTED, nothing, nothing)
    low, high = input_bounds(np.tile([-100.0, 0.0], (NODES, 1)), around, CONSTANTS)
    np.testing.assert_allclose([low[0], high[0]], [[-3, 0.02 - 2 / 22], [1, 0.02 + 2 / 22]])
    np.testing.assert_array_equal(low[1:, 0], -8.0)
    np.testing.assert_array_equal(high[1:, 0], 3.0)
    speed = 22 - 0.75 - 2.0 * np.arange(11)
    for branch in (CONSTANTS.tree.drive, CONSTANTS.tree.fail_safe):
        wheels = np.maximum(speed - 1, 0.0) * 0.1 / 2.579
        np.testing.assert_allclose(high[branch[1:], 1], np.minimum(4 / np.abs(speed), wheels))
    np.testing.assert_array_equal(low[1:, 1], -high[1:, 1])
    beyond = around._replace(previous_input=np.array([-30.0, 0.3]))
    low, high = input_bounds(np.zeros((NODES, 2)), beyond, CONSTANTS)
    np.testing.assert_allclose(low[0], [-8, 4 / 22])
    np.testing.assert_allclose(high[0], [-8, 4 / 22])
