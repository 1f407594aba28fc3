"""What the search makes small: the cost of a plan with every constraint as a penalty, as a sum of squares.

The slack γ_k of the paper's problem is penalised by c_k·γ_k² and appears nowhere else, so it can be put in: what is
left is a least-squares problem in the inputs. Differences from the cost of `coverdrive.planning.cost`: every path has a
slack of its own (the cost takes the largest of each step), and the limits of speed and heading, which whoever drives
the inputs keeps exactly, are penalties.

B motions, K steps, U = 2K inputs, n boxes per step, C = n + 6 constraints per step.
"""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from coverdrive.planning.condensed import Course, course_of, derivatives
from coverdrive.planning.obstacles import TILT, TINY, own_half_sizes
from coverdrive.planning.problem import ProblemSettings

_SPEED = 1e4
"""[s²/m²] penalty beyond the limits"""
_HEADING = 1e6
"""[1/rad²] penalty beyond the limits"""


class Surroundings(NamedTuple):
    """What a plan is made for."""

    state: Float[Array | np.ndarray, " 4"]
    """lon (0), lat [m], speed [m/s], heading [rad] now"""
    previous_input: Float[Array | np.ndarray, " 2"]
    """acceleration [m/s²] and yaw rate [rad/s] applied before"""
    edges: Float[Array | np.ndarray, " 2"]
    """[m] lat of the right and of the left edge of the road"""
    boxes: Float[Array | np.ndarray, "5 K n"]
    """lon, lat, half length, half width [m], speed [m/s] of `coverdrive.planning.obstacles.Obstacles`"""


class Constraints(NamedTuple):
    """What must not be positive: boxes, road edges, limits of speed and heading."""

    excess: Float[Array, "B K C"]
    normal: Float[Array, "B K 4 C"]
    """derivatives with respect to lon, lat, speed and heading"""


class Model(NamedTuple):
    """Merit of motions, and what it is made of, linear in the states of each step."""

    value: Float[Array, " B"]
    rows: Float[Array, "B K 4 U"]
    """derivatives of the states with respect to the inputs"""
    error: Float[Array, "B K 4"]
    """of the states from the wanted ones"""
    constraints: Constraints


def merit(
    inputs: Float[Array, "B U"], target: Float[Array, " B"], around: Surroundings, problem: ProblemSettings
) -> Model:
    """The merit of motions.

    Args:
        inputs: of the motions.
        target: [m] lat of the centre of each motion's target lane.
        around: what the plan is made for.
        problem: horizon, car and weights.
    """
    course = course_of(around.state, inputs, problem.dt)
    reference = problem.cost.reference_speed
    error = jnp.stack([0 * course.lon, course.lat - target[:, None], course.speed - reference, course.heading], -1)
    constraints = _constraints(course, around, problem)
    form, pull = input_form(problem)
    start = around.previous_input @ pull
    constant = (around.previous_input**2 * pull.sum(-1)).sum()
    violated = jnp.maximum(0.0, constraints.excess)
    value = (
        (state_weights(problem) * error**2).sum((1, 2))
        + (constraint_weights(problem, around.boxes.shape[2]) * violated**2).sum((1, 2))
        + ((inputs @ form - 2 * start) * inputs).sum(-1)
        + constant
    )
    return Model(value, derivatives(course, problem.dt), error, constraints)


def state_weights(problem: ProblemSettings) -> Float[np.ndarray, "K 4"]:
    """Weights of the squared errors of lon, lat, speed and heading."""
    cost = problem.cost
    factor = np.ones((problem.steps, 1))
    factor[-1] = cost.terminal
    return factor * np.array([0.0, cost.lane, cost.speed, cost.heading])


def constraint_weights(problem: ProblemSettings, boxes: int) -> Float[np.ndarray, "K C"]:
    """Weights of the squared violations."""
    per_box = np.tile(problem.cost.slack_weights(problem.steps)[:, None], boxes)
    road = problem.cost.off_road
    return np.concatenate([per_box, np.tile([road, road, _SPEED, _SPEED, _HEADING, _HEADING], (problem.steps, 1))], 1)


def input_form(problem: ProblemSettings) -> tuple[Float[np.ndarray, "U U"], Float[np.ndarray, "2 U"]]:
    """Cost of inputs and of their changes: uᵀ·form·u − 2·previous_inputᵀ·pull·u + constant."""
    cost, steps = problem.cost, problem.steps
    change = np.eye(steps) - np.eye(steps, k=-1)
    form, pull = np.zeros((2 * steps, 2 * steps)), np.zeros((2, 2 * steps))
    weights = ((cost.acceleration, cost.acceleration_change), (cost.yaw_rate, cost.yaw_rate_change))
    for i, (size, changes) in enumerate(weights):
        own = slice(i * steps, (i + 1) * steps)
        form[own, own] = size * np.eye(steps) + changes * change.T @ change
        pull[i, i * steps] = changes
    return form, pull


def input_bounds(
    inputs: Float[Array, "B U"], around: Surroundings, problem: ProblemSettings
) -> tuple[Float[Array, "B U"], Float[Array, "B U"]]:
    """Least and largest inputs; those of the yaw rate follow from the lateral acceleration at the motion's speed."""
    steps, vehicle = problem.steps, problem.vehicle
    accelerations = jnp.clip(inputs[:, :steps], -vehicle.max_deceleration, vehicle.max_acceleration)
    gained = problem.dt * (jnp.cumsum(accelerations, -1) - accelerations)
    speed = jnp.maximum(around.state[2] + gained, 1.0)
    turn = jnp.minimum(vehicle.max_yaw_rate, vehicle.max_lateral_acceleration / speed)
    least = jnp.full_like(turn, -vehicle.max_deceleration)
    largest = jnp.full_like(turn, vehicle.max_acceleration)
    return jnp.concatenate([least, -turn], -1), jnp.concatenate([largest, turn], -1)


def _constraints(course: Course, around: Surroundings, problem: ProblemSettings) -> Constraints:
    vehicle, (_, _, speed, heading) = problem.vehicle, around.state
    tilt = jnp.sqrt(course.heading**2 + TILT**2)
    own = own_half_sizes(course.heading, vehicle, jnp)
    turning = course.heading / tilt
    excess, normal = _boxes(course, own, turning, around.boxes, problem)
    fastest, slowest = jnp.maximum(vehicle.max_speed, speed), jnp.minimum(0.0, speed)
    widest = jnp.maximum(vehicle.max_heading, jnp.abs(heading))
    half_width = own[1] + problem.obstacles.edge_margin
    fixed = jnp.stack(
        [
            course.lat + half_width - around.edges[1],
            around.edges[0] - course.lat + half_width,
            course.speed - fastest,
            slowest - course.speed,
            course.heading - widest,
            -widest - course.heading,
        ],
        -1,
    )
    none, one = 0 * turning, 0 * turning + 1
    widening = vehicle.length / 2 * turning
    fixed_normal = jnp.stack(
        [
            jnp.stack([none, none, none, none, none, none], -1),
            jnp.stack([one, -one, none, none, none, none], -1),
            jnp.stack([none, none, one, -one, none, none], -1),
            jnp.stack([widening, widening, none, none, one, -one], -1),
        ],
        2,
    )
    return Constraints(jnp.concatenate([excess, fixed], -1), jnp.concatenate([normal, fixed_normal], -1))


def _boxes(
    course: Course,
    own: tuple[Array, Array],
    turning: Array,
    boxes: Float[Array | np.ndarray, "5 K n"],
    problem: ProblemSettings,
) -> tuple[Float[Array, "B K n"], Float[Array, "B K 4 n"]]:
    """Slack of every box, negative outside, and its derivatives."""
    vehicle, settings = problem.vehicle, problem.obstacles
    order, inflation = settings.order, settings.inflation
    excess = jnp.maximum(0.0, course.speed[..., None] - boxes[4])
    half_way, braking = excess**2 / (4 * vehicle.max_deceleration), excess / (2 * vehicle.max_deceleration)
    long = inflation * (boxes[2] + own[0][..., None] + half_way)
    wide = inflation * (boxes[3] + own[1][..., None])
    ahead = (course.lon[..., None] + half_way - boxes[0]) / long
    aside = (course.lat[..., None] - boxes[1]) / wide
    ahead_low, aside_low = ahead ** (order - 1), aside ** (order - 1)
    power = ahead_low * ahead + aside_low * aside + TINY
    norm = _root(power, order)
    factor = -norm / power
    by_ahead, by_aside = factor * ahead_low / long, factor * aside_low / wide
    tilting = -inflation / 2 * turning[..., None]
    by_heading = tilting * (by_ahead * ahead * vehicle.width + by_aside * aside * vehicle.length)
    by_speed = by_ahead * (1 - inflation * ahead) * braking
    return 1 + settings.margin - norm, jnp.stack([by_ahead, by_aside, by_speed, by_heading], axis=2)


def _root(values: Array, order: int) -> Array:
    """The root of an order that is a power of two."""
    return values if order == 1 else _root(jnp.sqrt(values), order // 2)
