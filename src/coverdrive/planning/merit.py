"""What the search makes small: the cost of a plan with every constraint as a penalty, as a sum of squares.

The slack γ_k of the paper's problem is penalised by c_k·γ_k² and appears nowhere else, so it can be put in: what is
left is a least-squares problem in the inputs. Differences from the cost of `coverdrive.planning.cost`: every path has a
slack of its own (the cost takes the largest of each step) at every part of a step in which it is passed, for either
sign of the heading where both matter; the body is long enough to be where the car gets by Euler steps and where it gets
exactly; and the limits of speed and heading, which whoever drives the inputs keeps exactly, are penalties.

K steps, U = 2K inputs, n boxes per step, C constraints in view.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from coverdrive.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.contact import MOST_PARTS, box_between, box_excess, box_of, half_sizes_of, parts_of
from coverdrive.planning.cost import input_cost, state_cost
from coverdrive.planning.course import Course, add_lat_curvature, course_of

_SPEED = 1e4
"""[s²/m²] penalty beyond the limits"""
_HEADING = 1e6
"""[1/rad²] penalty beyond the limits"""
_IN_VIEW = 1.0
"""constraints that are further from being active than this are not seen by a step"""
_HEADING_IN_VIEW = 0.2
"""[rad] the same of the limits of the heading"""
KINK = 0.05
"""[m] below which a length is smoothed"""
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
    boxes: Float[np.ndarray, "7 P n"]
    """lon, lat, half length, half width [m], speed [m/s], deceleration [m/s²] and likelihood of
    `coverdrive.planning.obstacles.Obstacles`"""


class Model(NamedTuple):
    """Merit of a motion, and what it is made of, linear in the changes of states and inputs."""

    value: float
    cost: float
    """the merit without the constraints"""
    course: Course
    """the states, and how they change with the inputs"""
    by_state: Float[np.ndarray, "K 4"]
    """half the first derivatives of the cost with respect to the states"""
    by_input: Float[np.ndarray, " U"]
    """half the first derivatives of the cost with respect to the inputs, the states apart"""
    curvature: Float[np.ndarray, " U"]
    """half the second derivatives (Gauss–Newton) of the cost with respect to every single input, states included"""
    excess: Float[np.ndarray, " C"]
    """what must not be positive: boxes, road edges, limits of speed and heading"""
    normal: Float[np.ndarray, "C 4"]
    """derivatives of the excesses with respect to the state of their step"""
    step: Int[np.ndarray, " C"]
    """index of that step"""
    weight: Float[np.ndarray, " C"]
    """of the squares of positive excesses"""


class _Constraints(NamedTuple):
    """The fields of that name of `Model`, with room for more."""

    excess: Float[np.ndarray, " most"]
    normal: Float[np.ndarray, "most 4"]
    step: Int[np.ndarray, " most"]
    weight: Float[np.ndarray, " most"]


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
    cost, by_state, by_input = _smooth(inputs, course, target, around, constants)
    curvature = constants.curvature.copy()
    add_lat_curvature(course, constants.cost.lane * constants.weight, constants.dt, curvature)
    excess, normal, step, weight = _constraints(course, around, constants)
    value = cost + penalty(excess, weight)
    return Model(value, cost, course, by_state, by_input, curvature, excess, normal, step, weight)


@compiled
def penalty(excess: Float[np.ndarray, " C"], weight: Float[np.ndarray, " C"]) -> float:
    """What the constraints add to the merit."""
    result = 0.0
    for i in range(len(excess)):
        if excess[i] > 0:
            result += weight[i] * excess[i] ** 2
    return result


@compiled
def _smooth(
    inputs: Float[np.ndarray, " U"], course: Course, target: float, around: Surroundings, constants: Constants
) -> tuple[float, Float[np.ndarray, "K 4"], Float[np.ndarray, " U"]]:
    """Cost without constraints, and half its derivatives with respect to states and inputs."""
    cost, steps = constants.cost, constants.steps
    by_state, by_input = np.zeros((steps, 4)), np.empty(len(inputs))
    value, acceleration, yaw_rate = 0.0, around.previous_input[0], around.previous_input[1]
    for k in range(steps):
        changes = inputs[k] - acceleration, inputs[steps + k] - yaw_rate
        acceleration, yaw_rate = inputs[k], inputs[steps + k]
        _, lat, speed, heading = course.states[k]
        weight = constants.weight[k]
        value += cost_of_input(acceleration, yaw_rate, changes[0], changes[1], cost)
        value += weight * cost_of_state(lat - target, speed, heading, cost)
        by_state[k, 1] = weight * cost.lane * (lat - target)
        by_state[k, 2] = weight * cost.speed * (speed - cost.reference_speed)
        by_state[k, 3] = weight * cost.heading * heading
        by_input[k] = cost.acceleration * acceleration + cost.acceleration_change * changes[0]
        by_input[steps + k] = cost.yaw_rate * yaw_rate + cost.yaw_rate_change * changes[1]
        if k > 0:
            by_input[k - 1] -= cost.acceleration_change * changes[0]
            by_input[steps + k - 1] -= cost.yaw_rate_change * changes[1]
    return value, by_state, by_input


@compiled
def _constraints(course: Course, around: Surroundings, constants: Constants) -> _Constraints:
    """The constraints in view."""
    most = constants.steps * ((1 + MOST_PARTS) * around.boxes.shape[2] + _LIMITS)
    seen = _Constraints(np.empty(most), np.empty((most, 4)), np.empty(most, np.int64), np.empty(most))
    count = _limits(course, around, constants, seen)
    count = _bodies(course, around, constants, seen, count)
    return _Constraints(seen.excess[:count], seen.normal[:count], seen.step[:count], seen.weight[:count])


@compiled
def _append(
    seen: _Constraints, count: int, step: int, excess: float, normal: tuple[float, float, float, float], weight: float
) -> int:
    """Append a constraint; returns the number of constraints."""
    seen.excess[count], seen.step[count], seen.weight[count] = excess, step, weight
    for i in range(4):
        seen.normal[count, i] = normal[i]
    return count + 1


@compiled
def _limits(course: Course, around: Surroundings, constants: Constants, seen: _Constraints) -> int:
    """Write the limits of speed and heading; returns their number."""
    vehicle, count = constants.vehicle, 0
    fastest, slowest = max(vehicle.max_speed, around.state[2]), min(0.0, around.state[2])
    widest = max(vehicle.max_heading, abs(around.state[3]))
    for k in range(constants.steps):
        speed, heading = course.states[k, 2], course.states[k, 3]
        for value, by, weight, view in (
            (speed - fastest, (0.0, 0.0, 1.0, 0.0), _SPEED, _IN_VIEW),
            (slowest - speed, (0.0, 0.0, -1.0, 0.0), _SPEED, _IN_VIEW),
            (heading - widest, (0.0, 0.0, 0.0, 1.0), _HEADING, _HEADING_IN_VIEW),
            (-widest - heading, (0.0, 0.0, 0.0, -1.0), _HEADING, _HEADING_IN_VIEW),
        ):
            if value > -view:
                count = _append(seen, count, k, value, by, weight)
    return count


@compiled
def _bodies(course: Course, around: Surroundings, constants: Constants, seen: _Constraints, count: int) -> int:
    """Append the boxes and road edges for either sign of the heading; returns the number of constraints.

    The own box is smaller for the other sign: what is far from being active for the heading is so for that as well.
    """
    vehicle, boxes, edges = constants.vehicle, around.boxes, around.edges
    for k in range(constants.steps):
        lon, lat, speed, heading = course.states[k]
        sign = 1.0 if heading >= 0 else -1.0
        other_view = _MIRRORED_IN_VIEW if abs(heading) < _TURNED else -np.inf
        own, smaller = half_sizes_of(abs(heading), vehicle), half_sizes_of(-abs(heading), vehicle)
        lag = _lag_of(course.states[k], around.state, constants.dt)
        at = (lon + lag.lon / 2, lat + lag.lat / 2, speed)
        for slot in range(boxes.shape[2]):
            for half, turn, view in ((own, sign, _IN_VIEW), (smaller, -sign, other_view)):
                larger = half[0] + lag.long / 2, half[1] + lag.wide / 2
                value, by, by_half = box_excess(at, larger, turn, box_of(boxes, k + 1, slot), view, constants)
                if value > -view:
                    by = _with_lag(by, by_half, lag, speed, heading, constants.dt)
                    count = _append(seen, count, k, value, by, constants.slack[k])
                if value <= -other_view:
                    break
            if k + 1 < constants.steps:
                count = _passing(course, k, slot, own, sign, boxes, constants, seen, count)
        for half, turn, view in ((own, sign, _IN_VIEW), (smaller, -sign, other_view)):
            half_width, widening = half[1] + constants.shape.edge_margin, turn * vehicle.length / 2
            for side, beyond in ((1.0, lat - edges[1]), (-1.0, edges[0] - lat)):
                if beyond + half_width > -view:
                    by = (0.0, side, 0.0, widening)
                    count = _append(seen, count, k, beyond + half_width, by, constants.cost.off_road)
    return count


class _Lag(NamedTuple):
    """How far a car that goes on exactly is from the plan: the body is anywhere in between."""

    lon: float
    """[m] as `coverdrive.planning.sweep.lag`"""
    lat: float
    """[m]"""
    long: float
    """[m] length of the way along lon, without a kink at 0"""
    wide: float
    """[m] the same along lat"""


@compiled
def _lag_of(state: Float[np.ndarray, " 4"], start: Float[np.ndarray, " 4"], dt: float) -> _Lag:
    lon = dt / 2 * (state[2] * np.cos(state[3]) - start[2] * np.cos(start[3]))
    lat = dt / 2 * (state[2] * np.sin(state[3]) - start[2] * np.sin(start[3]))
    return _Lag(lon, lat, np.sqrt(lon**2 + KINK**2) - KINK, np.sqrt(lat**2 + KINK**2) - KINK)


@compiled
def _with_lag(
    by: tuple[float, float, float, float], by_half: tuple[float, float], lag: _Lag, speed: float, heading: float,
    dt: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Derivatives by the state, of which the lag is a function, from those where half of the lag is added."""
    along = (by[0] + by_half[0] * lag.lon / (lag.long + KINK)) * dt / 4
    across = (by[1] + by_half[1] * lag.lat / (lag.wide + KINK)) * dt / 4
    cosine, sine = np.cos(heading), np.sin(heading)
    turning = speed * (across * cosine - along * sine)
    return by[0], by[1], by[2] + along * cosine + across * sine, by[3] + turning


@compiled
def _passing(
    course: Course,
    k: int,
    slot: int,
    own: tuple[float, float],
    sign: float,
    boxes: Float[np.ndarray, "7 P n"],
    constants: Constants,
    seen: _Constraints,
    count: int,
) -> int:
    """Append a box where it is passed between the states k and k + 1; returns the number of constraints.

    The car is in between, and where it is follows from the state k alone.
    """
    state, by_lon, by_lat = course.states[k], course.lon_by[k + 1], course.lat_by[k + 1]
    way = course.states[k + 1, 0] - state[0], course.states[k + 1, 1] - state[1]
    parts = parts_of(way, own, boxes, k + 1, slot)
    for part in range(1, parts):
        share = part / parts
        at = (state[0] + share * way[0], state[1] + share * way[1], state[2])
        value, by, _ = box_excess(at, own, sign, box_between(boxes, k + 1, slot, share), _IN_VIEW, constants)
        if value > -_IN_VIEW:
            by_speed = share * (by[0] * by_lon[0] + by[1] * by_lat[0])
            by_heading = by[3] + share * (by[0] * by_lon[1] + by[1] * by_lat[1])
            count = _append(seen, count, k, value, (by[0], by[1], by_speed, by_heading), constants.slack[k])
    return count


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
