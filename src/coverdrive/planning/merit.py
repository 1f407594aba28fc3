"""What the search makes small: the cost of a plan with every constraint as a penalty, as a sum of squares.

The slack γ_k of the paper's problem is penalised by c_k·γ_k² and appears nowhere else, so it can be put in: what is
left is a least-squares problem in the inputs. Differences from the cost of `coverdrive.planning.cost`: every path has a
slack of its own (the cost takes the largest of each step), for either sign of the heading where both matter, and the
limits of speed and heading, which whoever drives the inputs keeps exactly, are penalties.

K steps, U = 2K inputs, n boxes per step, C constraints in view.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.planning.compiled import compiled
from coverdrive.planning.condensed import Course, course_of, pull_back
from coverdrive.planning.constants import Constants
from coverdrive.planning.contact import box_excess, half_sizes_of
from coverdrive.planning.cost import input_cost, state_cost

_SPEED = 1e4
"""[s²/m²] penalty beyond the limits"""
_HEADING = 1e6
"""[1/rad²] penalty beyond the limits"""
_IN_VIEW = 1.0
"""constraints that are further from being active than this are not seen by a step"""
_HEADING_IN_VIEW = 0.2
"""[rad] the same of the limits of the heading"""
_LIMITS = 8
"""constraints of every step besides the boxes"""
_TURNED = 0.15
"""[rad] beyond which the constraints for the other sign of the heading are not looked at"""
_MIRRORED_IN_VIEW = 0.3
"""``_IN_VIEW`` of the constraints for the other sign of the heading"""
cost_of_state = compiled(state_cost)
cost_of_input = compiled(input_cost)


class Surroundings(NamedTuple):
    """What a plan is made for."""

    state: Float[np.ndarray, " 4"]
    """lon (0), lat [m], speed [m/s], heading [rad] now"""
    previous_input: Float[np.ndarray, " 2"]
    """acceleration [m/s²] and yaw rate [rad/s] applied before"""
    edges: Float[np.ndarray, " 2"]
    """[m] lat of the right and of the left edge of the road"""
    boxes: Float[np.ndarray, "5 K n"]
    """lon, lat, half length, half width [m], speed [m/s] of `coverdrive.planning.obstacles.Obstacles`"""


class Model(NamedTuple):
    """Merit of a motion, and what it is made of, linear in the inputs."""

    value: float
    cost: float
    """the merit without the constraints"""
    smooth: Float[np.ndarray, "U U"]
    """half the second derivatives without the constraints (Gauss–Newton); the part below the diagonal counts"""
    slope: Float[np.ndarray, " U"]
    """half the first derivatives without the constraints"""
    excess: Float[np.ndarray, " C"]
    """what must not be positive: boxes, road edges, limits of speed and heading"""
    normal: Float[np.ndarray, "C U"]
    """derivatives of the excesses"""
    weight: Float[np.ndarray, " C"]
    """of the squares of positive excesses"""


@compiled
def merit(inputs: Float[np.ndarray, " U"], target: float, around: Surroundings, constants: Constants) -> Model:
    """The merit of a motion.

    Args:
        inputs: of the motion.
        target: [m] lat of the centre of its target lane.
        around: what the plan is made for.
        constants: of the problem.
    """
    course = course_of(around.state, inputs, constants.dt)
    excess, normal, weight = _constraints(course, around, constants)
    cost, smooth, slope = _smooth(inputs, course, target, around, constants)
    return Model(cost + penalty(excess, weight), cost, smooth, slope, excess, normal, weight)


@compiled
def penalty(excess: Float[np.ndarray, " C"], weight: Float[np.ndarray, " C"]) -> float:
    """What the constraints add to the merit."""
    result = 0.0
    for i in range(len(excess)):
        result += weight[i] * max(0.0, excess[i]) ** 2
    return result


@compiled
def _smooth(
    inputs: Float[np.ndarray, " U"], course: Course, target: float, around: Surroundings, constants: Constants
) -> tuple[float, Float[np.ndarray, "U U"], Float[np.ndarray, " U"]]:
    """Cost without constraints, half its second and half its first derivatives."""
    cost, steps = constants.cost, constants.steps
    smooth, by_inputs, slope = constants.straight.copy(), np.empty(len(inputs)), np.zeros(len(inputs))
    value, acceleration, yaw_rate = 0.0, around.previous_input[0], around.previous_input[1]
    for k in range(steps):
        changes = inputs[k] - acceleration, inputs[steps + k] - yaw_rate
        acceleration, yaw_rate = inputs[k], inputs[steps + k]
        lat_error, weight = course.lat[k] - target, constants.weight[k]
        value += cost_of_input(acceleration, yaw_rate, changes[0], changes[1], cost)
        value += weight * cost_of_state(lat_error, course.speed[k], course.heading[k], cost)
        faster = cost.speed * (course.speed[k] - cost.reference_speed)
        pull_back(course, k, (0.0, 1.0, 0.0, 0.0), constants.dt, by_inputs)
        add_square(smooth, by_inputs, weight * cost.lane)
        slope += (weight * cost.lane * lat_error) * by_inputs
        slope[: k + 1] += weight * constants.dt * faster
        slope[steps : steps + k + 1] += weight * constants.dt * cost.heading * course.heading[k]
        slope[k] += cost.acceleration * acceleration + cost.acceleration_change * changes[0]
        slope[steps + k] += cost.yaw_rate * yaw_rate + cost.yaw_rate_change * changes[1]
        if k > 0:
            slope[k - 1] -= cost.acceleration_change * changes[0]
            slope[steps + k - 1] -= cost.yaw_rate_change * changes[1]
    return value, smooth, slope


@compiled
def _constraints(
    course: Course, around: Surroundings, constants: Constants
) -> tuple[Float[np.ndarray, " C"], Float[np.ndarray, "C U"], Float[np.ndarray, " C"]]:
    """Excess, its derivatives and weight of the constraints in view."""
    most = constants.steps * (2 * around.boxes.shape[2] + _LIMITS)
    excess, normal, weight = np.empty(most), np.empty((most, 2 * constants.steps)), np.empty(most)
    count = _limits(course, around, constants, excess, normal, weight)
    count = _bodies(course, False, around, constants, excess, normal, weight, count)
    count = _bodies(course, True, around, constants, excess, normal, weight, count)
    return excess[:count], normal[:count], weight[:count]


@compiled
def _limits(
    course: Course,
    around: Surroundings,
    constants: Constants,
    excess: Float[np.ndarray, " most"],
    normal: Float[np.ndarray, "most U"],
    weight: Float[np.ndarray, " most"],
) -> int:
    """Write the limits of speed and heading; returns their number."""
    vehicle, count = constants.vehicle, 0
    fastest, slowest = max(vehicle.max_speed, around.state[2]), min(0.0, around.state[2])
    widest = max(vehicle.max_heading, abs(around.state[3]))
    for k in range(constants.steps):
        speed, heading = course.speed[k], course.heading[k]
        for value, by, penalty, view in (
            (speed - fastest, (0.0, 0.0, 1.0, 0.0), _SPEED, _IN_VIEW),
            (slowest - speed, (0.0, 0.0, -1.0, 0.0), _SPEED, _IN_VIEW),
            (heading - widest, (0.0, 0.0, 0.0, 1.0), _HEADING, _HEADING_IN_VIEW),
            (-widest - heading, (0.0, 0.0, 0.0, -1.0), _HEADING, _HEADING_IN_VIEW),
        ):
            if value > -view:
                excess[count], weight[count] = value, penalty
                pull_back(course, k, by, constants.dt, normal[count])
                count += 1
    return count


@compiled
def _bodies(
    course: Course,
    mirrored: bool,
    around: Surroundings,
    constants: Constants,
    excess: Float[np.ndarray, " most"],
    normal: Float[np.ndarray, "most U"],
    weight: Float[np.ndarray, " most"],
    count: int,
) -> int:
    """Append the boxes and road edges for the heading, or for the other sign of it; returns the number of constraints.

    Called once for all steps: handing over so many arrays takes longer than looking at the boxes of one.
    """
    vehicle, boxes, edges = constants.vehicle, around.boxes, around.edges
    view = _MIRRORED_IN_VIEW if mirrored else _IN_VIEW
    for k in range(constants.steps):
        lon, lat, speed, heading = course.lon[k], course.lat[k], course.speed[k], course.heading[k]
        if mirrored and abs(heading) >= _TURNED:
            continue
        sign = 1.0 if (heading >= 0) != mirrored else -1.0
        own = half_sizes_of(sign * heading, vehicle)
        for slot in range(boxes.shape[2]):
            value, by = box_excess((lon, lat, speed), own, sign, boxes, k, slot, view, constants)
            if value > -view:
                excess[count], weight[count] = value, constants.slack[k]
                pull_back(course, k, by, constants.dt, normal[count])
                count += 1
        half_width, widening = own[1] + constants.shape.edge_margin, sign * vehicle.length / 2
        for side, beyond in ((1.0, lat - edges[1]), (-1.0, edges[0] - lat)):
            if beyond + half_width > -view:
                excess[count], weight[count] = beyond + half_width, constants.cost.off_road
                pull_back(course, k, (0.0, side, 0.0, widening), constants.dt, normal[count])
                count += 1
    return count


@compiled
def add_square(matrix: Float[np.ndarray, "U U"], row: Float[np.ndarray, " U"], factor: float) -> None:
    """Add factor·row·rowᵀ to a matrix, on and below its diagonal."""
    for i in range(len(row)):
        scaled = factor * row[i]
        if scaled != 0:
            for j in range(i + 1):
                matrix[i, j] += scaled * row[j]


@compiled
def input_bounds(
    inputs: Float[np.ndarray, " U"], state: Float[np.ndarray, " 4"], constants: Constants
) -> tuple[Float[np.ndarray, " U"], Float[np.ndarray, " U"]]:
    """Least and largest inputs; those of the yaw rate follow from the lateral acceleration at the motion's speed."""
    steps, vehicle = constants.steps, constants.vehicle
    low, high = np.empty(len(inputs)), np.empty(len(inputs))
    speed = state[2]
    for k in range(steps):
        low[k], high[k] = -vehicle.max_deceleration, vehicle.max_acceleration
        turn = min(vehicle.max_yaw_rate, vehicle.max_lateral_acceleration / max(speed, 1.0))
        low[steps + k], high[steps + k] = -turn, turn
        speed += constants.dt * min(max(inputs[k], low[k]), high[k])
    return low, high
