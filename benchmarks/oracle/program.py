"""The problem of the planner (paper, §4, with two branches) as a parametric nonlinear program in CasADi.

It reads the same tree, vehicle and obstacles as the search. Variables are the inputs and states of the N nodes, and the
slacks; first constraints are the N steps of the vehicle (= 0), then follow lateral acceleration and power (≤ 0), and
for every slack what asks for it (≤ 0). As in `coverdrive.planning.check.merit` every box of every node and both road
edges have a slack of their own, so that the objective with the smallest slacks is the merit, but for three differences:
boxes count at the end of a step alone, not where a step passes them in parts; the limits of speed and heading are
bounds, not penalties; and steering, which binds at low speeds only, is left to whoever drives the inputs, but for the
first ones. Longitudinal positions are relative to the current one.
"""

import contextlib
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.extras import require
from coverdrive.planning.check.contact import KINK
from coverdrive.planning.check.merit import input_bounds
from coverdrive.planning.problem.constants import Constants
from coverdrive.planning.problem.cost import OFF_ROAD
from coverdrive.planning.problem.obstacles import FAR, clearance, own_half_sizes, way_to_brake
from coverdrive.planning.problem.rollout import rolled
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.problem.vehicle import moved
from coverdrive.planning.surroundings import Surroundings
from coverdrive.road_ahead import LEFT, RIGHT

ca: Any = require("casadi")
with contextlib.suppress(AttributeError):  # CasADi before 3.8 has no other mode
    ca.GlobalOptions.setNumpyMode(-1)  # np.cos of a symbol is a symbol


class Program(NamedTuple):
    """The nonlinear program in symbols."""

    nlp: dict[str, Any]
    """variables x, parameters p, objective f and constraints g, as `casadi.nlpsol` takes them"""
    equalities: int
    """how many constraints, the first ones, are g = 0; the others are g ≤ 0"""
    slacks: int
    """how many variables, the last ones, are slacks; as many constraints, the last ones, ask for them"""
    asked: Any
    """`casadi.Function` of x and p: these constraints"""


def build_program(problem: ProblemSettings, constants: Constants, boxes: int, likely: int) -> Program:
    """The nonlinear program for a number of boxes.

    Args:
        problem: horizon, ego, weights and shape of the obstacles.
        constants: of the problem.
        boxes: number of all boxes.
        likely: number of those that the drive branch keeps clear of.
    """
    tree, nodes, steps = constants.tree, len(constants.tree.parent), constants.steps
    inputs, states = ca.SX.sym("inputs", 2, nodes), ca.SX.sym("states", 4, nodes)
    start, before, targets, edges = (ca.SX.sym(name, n) for name, n in (("now", 4), ("u", 2), ("to", 2), ("road", 2)))
    kinds = ca.SX.sym("likely", 6, steps * likely), ca.SX.sym("boxes", 6, steps * boxes)
    objective, gaps, limits, asked, weights, car = ca.SX(0), [], [], [], [], problem.vehicle
    for n in range(nodes):
        state, applied, parent = states[:, n], inputs[:, n], int(tree.parent[n])
        origin, last = (states[:, parent], inputs[:, parent]) if parent >= 0 else (start, before)
        gaps.append(state - ca.vertcat(*moved(tuple(ca.vertsplit(origin)), tuple(ca.vertsplit(applied)), constants.dt)))
        turn, most = origin[2] * applied[1], car.max_lateral_acceleration
        limits += [turn - most, -turn - most, applied[0] * origin[2] - car.max_power]
        errors = ca.vertcat(state[1] - targets[int(tree.safe[n])], state[2] - problem.cost.reference_speed, state[3])
        objective += ca.dot(tree.errors[n], errors**2) + ca.dot(tree.inputs[n], applied**2)
        objective += ca.dot(tree.changes[n], (applied - last) ** 2)
        own, kind = own_half_sizes(np.sqrt(state[3] ** 2 + KINK**2), car), kinds[int(tree.careful[n])]
        wide = own[1] + problem.obstacles.edge_margin
        columns = kind.shape[1] // steps
        there = kind[:, columns * (tree.moment[n] - 1) : columns * tree.moment[n]]
        asked += [
            state[1] + wide - edges[1],
            edges[0] - state[1] + wide,
            _excess(state, own, there, problem),
        ]
        weights += [OFF_ROAD] * 2 + [tree.slack[n]] * columns
    slacks = ca.SX.sym("slacks", len(weights))
    nlp = {
        "x": ca.vertcat(ca.vec(inputs), ca.vec(states), slacks),
        "p": ca.vertcat(start, before, targets, edges, *(ca.vec(kind) for kind in kinds)),
        "f": objective + ca.dot(np.array(weights), slacks**2),
        "g": ca.vertcat(*gaps, *limits, ca.vertcat(*asked) - slacks),
    }
    asking = ca.Function("asked", [nlp["x"], nlp["p"]], [nlp["g"][-len(weights) :]])
    return Program(nlp, 4 * nodes, len(weights), asking)


def _excess(state: Any, own: tuple[Any, Any], boxes: Any, problem: ProblemSettings) -> Any:
    """The slacks that boxes ask for at a state."""
    lon, lat, half_length, half_width, speed, deceleration = (boxes[i, :].T for i in range(6))
    hardest, shape = problem.vehicle.max_deceleration, problem.obstacles
    way = way_to_brake(state[2], ca.fmin(state[2], speed), deceleration, hardest, ca.if_else)
    return 1 + shape.margin - clearance((state[0] - lon, state[1] - lat), (half_length, half_width), own, way, shape)


def padded(boxes: Float[np.ndarray, "7 P n"]) -> Float[np.ndarray, "7 P m"]:
    """Boxes filled up to a power of two, at least 4, with some far ahead: few programs serve every scene."""
    n = boxes.shape[2]
    free = np.ones((*boxes.shape[:2], max(4, 1 << max(n - 1, 0).bit_length()) - n))
    free[[0, 4]] = FAR
    return np.concatenate([boxes, free], axis=-1)


def parameters(targets: Float[np.ndarray, " 2"], around: Surroundings) -> Float[np.ndarray, " p"]:
    """The parameters of the program, in its order.

    Args:
        targets: [m] lat of the centre of the target lane of the drive branch (0) and of the fail-safe branch (1).
        around: what the plan is made for, with as many boxes as the program has.
    """
    boxes = (np.moveaxis(each[:6, 1:], 0, -1).ravel() for each in (around.likely, around.boxes))
    return np.concatenate([around.state, around.previous_input, targets, around.road.rows[0, [RIGHT, LEFT]], *boxes])


def bounds(
    program: Program, around: Surroundings, constants: Constants
) -> tuple[Float[np.ndarray, " V"], Float[np.ndarray, " V"]]:
    """Lower and upper bounds of the variables; a current state beyond a bound widens it, so that a plan exists.

    Args:
        program: says how many slacks there are.
        around: what the plan is made for.
        constants: of the problem.
    """
    vehicle, nodes = constants.vehicle, len(constants.tree.parent)
    (_, _, speed, heading), slack = around.state, np.zeros(program.slacks)
    inputs = np.tile([[vehicle.max_deceleration], [vehicle.max_acceleration]], nodes)
    turn = np.sqrt(vehicle.max_lateral_acceleration * np.tan(vehicle.max_steering) / vehicle.wheelbase)  # at any speed
    inputs = np.stack([inputs * [[-1], [1]], np.tile([[-turn], [turn]], nodes)], axis=-1)
    first_low, first_high = input_bounds(np.zeros((nodes, 2)), around, constants)
    inputs[:, 0] = first_low[0], first_high[0]
    widest = max(vehicle.max_heading, abs(heading))
    states = (-np.inf, -np.inf, min(0.0, speed), -widest), (np.inf, np.inf, max(vehicle.max_speed, speed), widest)
    low, high = (np.concatenate([inputs[i].ravel(), np.tile(states[i], nodes)]) for i in range(2))
    return np.concatenate([low, slack]), np.concatenate([high, slack + np.inf])


def start_values(
    program: Program, inputs: Float[np.ndarray, "N 2"], given: Float[np.ndarray, " p"], around: Surroundings,
    constants: Constants,
) -> Float[np.ndarray, " V"]:  # fmt: skip
    """Driven inputs as values of the variables, with the smallest slacks.

    Args:
        program: which one.
        inputs: acceleration [m/s²] and yaw rate [rad/s] of every node.
        given: values of the parameters.
        around: what the plan is made for.
        constants: of the problem.
    """
    states = rolled(around.state, inputs, constants.tree, constants.dt).states
    values = np.concatenate([inputs.ravel(), states.ravel(), np.zeros(program.slacks)])
    values[-program.slacks :] = np.maximum(0.0, np.asarray(program.asked(values, given)).ravel())
    return values
