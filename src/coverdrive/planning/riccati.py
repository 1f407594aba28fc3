"""Quadratic problems over the horizon, solved from the last step to the first (dynamic programming, Riccati).

What the rest of a motion costs at the least is a quadratic form of the state and of the inputs before. One step back,
the state is put in as what it was before the step and the inputs, and the inputs are eliminated. The effort grows with
the number of steps, not with its cube as where all inputs are solved for at once. K steps, U = 2K inputs.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.compiled import compiled
from coverdrive.planning.course import Course


class Stages(NamedTuple):
    """A quadratic problem: half the derivatives, first and second, of what the changes of states and inputs cost."""

    by_state: Float[np.ndarray, "K 4"]
    by_states: Float[np.ndarray, "K 4 4"]
    by_input: Float[np.ndarray, " U"]
    by_inputs: Float[np.ndarray, " U"]
    """diagonal; the weights of the changes from one step to the next are part of it"""
    of_change: tuple[float, float]
    """weights of the squared differences of the accelerations and of the yaw rates of two steps"""


@compiled
def minimiser(stages: Stages, held: Bool[np.ndarray, " U"], course: Course, dt: float) -> Float[np.ndarray, " U"]:
    """The change of the inputs that costs least.

    Args:
        stages: the problem, convex in the inputs.
        held: which inputs do not change.
        course: the motion whose changes follow from those of the inputs.
        dt: [s].
    """
    return _played(_gains(stages, held, course, dt), course, dt)


@compiled
def _gains(stages: Stages, held: Bool[np.ndarray, " U"], course: Course, dt: float) -> Float[np.ndarray, "K 2 7"]:
    """How the acceleration (0) and the yaw rate (1) of each step follow from what is known by then.

    They are minus the gains times lon, lat, speed, heading, acceleration, yaw rate and 1, where the acceleration and
    the yaw rate are those of the step before; but the acceleration is chosen after the yaw rate and knows it.

    In the form, pij is the coefficient of the variables i and j in the order above, and qi the linear one of i. They
    are numbers of their own because loops over an array of 7 × 7 take two and a half times as long.
    """
    steps, (of_change_4, of_change_5) = len(course.states), stages.of_change
    gains = np.empty((steps, 2, 7))
    p00 = p10 = p11 = p20 = p21 = p22 = p30 = p31 = p32 = p33 = q0 = q1 = q2 = q3 = 0.0
    p40 = p41 = p42 = p43 = p44 = p50 = p51 = p52 = p53 = p54 = p55 = q4 = q5 = 0.0
    for k in range(steps - 1, -1, -1):
        # what the state after the step costs
        one, two = stages.by_state[k], stages.by_states[k]
        p00, p10, p20, p30, q0 = p00 + two[0, 0], p10 + two[1, 0], p20 + two[2, 0], p30 + two[3, 0], q0 + one[0]
        p11, p21, p31, q1 = p11 + two[1, 1], p21 + two[2, 1], p31 + two[3, 1], q1 + one[1]
        p22, p32, q2 = p22 + two[2, 2], p32 + two[3, 2], q2 + one[2]
        p33, q3 = p33 + two[3, 3], q3 + one[3]
        # speed and heading grow by dt times the inputs
        p44, p54 = p44 + dt * (2 * p42 + dt * p22), p54 + dt * (p43 + p52 + dt * p32)
        p55 += dt * (2 * p53 + dt * p33)
        p40, p41, p42, p43, q4 = p40 + dt * p20, p41 + dt * p21, p42 + dt * p22, p43 + dt * p32, q4 + dt * q2
        p50, p51, p52, p53, q5 = p50 + dt * p30, p51 + dt * p31, p52 + dt * p32, p53 + dt * p33, q5 + dt * q3
        # lon and lat grow with the speed and the heading before
        (lon_2, lon_3), (lat_2, lat_3) = course.lon_by[k], course.lat_by[k]
        by_20, by_21 = lon_2 * p00 + lat_2 * p10, lon_2 * p10 + lat_2 * p11
        by_30, by_31 = lon_3 * p00 + lat_3 * p10, lon_3 * p10 + lat_3 * p11
        p22 += 2 * (lon_2 * p20 + lat_2 * p21) + (lon_2 * by_20 + lat_2 * by_21)
        p32 += (lon_2 * p30 + lat_2 * p31) + (lon_3 * p20 + lat_3 * p21) + (lon_3 * by_20 + lat_3 * by_21)
        p33 += 2 * (lon_3 * p30 + lat_3 * p31) + (lon_3 * by_30 + lat_3 * by_31)
        p20, p21, p30, p31 = p20 + by_20, p21 + by_21, p30 + by_30, p31 + by_31
        p42, p43 = p42 + (lon_2 * p40 + lat_2 * p41), p43 + (lon_3 * p40 + lat_3 * p41)
        p52, p53 = p52 + (lon_2 * p50 + lat_2 * p51), p53 + (lon_3 * p50 + lat_3 * p51)
        q2, q3 = q2 + (lon_2 * q0 + lat_2 * q1), q3 + (lon_3 * q0 + lat_3 * q1)
        # what the inputs cost
        p44, q4 = p44 + stages.by_inputs[k], q4 + stages.by_input[k]
        p55, q5 = p55 + stages.by_inputs[steps + k], q5 + stages.by_input[steps + k]
        # the best acceleration put in; the one of the step before takes its place
        per = 0.0 if held[k] else 1 / p44
        g0, g1, g2, g3, g5, g = per * p40, per * p41, per * p42, per * p43, per * p54, per * q4
        _write(gains[k, 0], (g0, g1, g2, g3, -per * of_change_4, g5, g))
        p00, p10, p20, p30, q0 = p00 - g0 * p40, p10 - g1 * p40, p20 - g2 * p40, p30 - g3 * p40, q0 - g * p40
        p11, p21, p31, q1 = p11 - g1 * p41, p21 - g2 * p41, p31 - g3 * p41, q1 - g * p41
        p22, p32, q2 = p22 - g2 * p42, p32 - g3 * p42, q2 - g * p42
        p33, q3 = p33 - g3 * p43, q3 - g * p43
        p50, p51, p52, p53 = p50 - g5 * p40, p51 - g5 * p41, p52 - g5 * p42, p53 - g5 * p43
        p55, q5 = p55 - g5 * p54, q5 - g * p54
        p40, p41, p42, p43 = of_change_4 * g0, of_change_4 * g1, of_change_4 * g2, of_change_4 * g3
        p44, p54, q4 = of_change_4 - of_change_4 * per * of_change_4, of_change_4 * g5, of_change_4 * g
        # the same for the yaw rate
        per = 0.0 if held[steps + k] else 1 / p55
        g0, g1, g2, g3, g4, g = per * p50, per * p51, per * p52, per * p53, per * p54, per * q5
        _write(gains[k, 1], (g0, g1, g2, g3, g4, -per * of_change_5, g))
        p00, p10, p20, p30, q0 = p00 - g0 * p50, p10 - g1 * p50, p20 - g2 * p50, p30 - g3 * p50, q0 - g * p50
        p11, p21, p31, q1 = p11 - g1 * p51, p21 - g2 * p51, p31 - g3 * p51, q1 - g * p51
        p22, p32, q2 = p22 - g2 * p52, p32 - g3 * p52, q2 - g * p52
        p33, q3 = p33 - g3 * p53, q3 - g * p53
        p40, p41, p42, p43 = p40 - g4 * p50, p41 - g4 * p51, p42 - g4 * p52, p43 - g4 * p53
        p44, q4 = p44 - g4 * p54, q4 - g * p54
        p50, p51, p52, p53 = of_change_5 * g0, of_change_5 * g1, of_change_5 * g2, of_change_5 * g3
        p55, p54, q5 = of_change_5 - of_change_5 * per * of_change_5, of_change_5 * g4, of_change_5 * g
    return gains


@compiled
def _write(row: Float[np.ndarray, " 7"], gains: tuple[float, float, float, float, float, float, float]) -> None:
    for i in range(7):
        row[i] = gains[i]


@compiled
def _played(gains: Float[np.ndarray, "K 2 7"], course: Course, dt: float) -> Float[np.ndarray, " U"]:
    """The inputs that follow from the gains, step by step."""
    steps = len(course.states)
    result = np.empty(2 * steps)
    lon = lat = speed = heading = acceleration = yaw_rate = 0.0
    for k in range(steps):
        yaw_rate = _chosen(gains[k, 1], (lon, lat, speed, heading, acceleration, yaw_rate))
        acceleration = _chosen(gains[k, 0], (lon, lat, speed, heading, acceleration, yaw_rate))
        result[k], result[steps + k] = acceleration, yaw_rate
        lon += course.lon_by[k, 0] * speed + course.lon_by[k, 1] * heading
        lat += course.lat_by[k, 0] * speed + course.lat_by[k, 1] * heading
        speed += dt * acceleration
        heading += dt * yaw_rate
    return result


@compiled
def _chosen(gain: Float[np.ndarray, " 7"], known: tuple[float, float, float, float, float, float]) -> float:
    of_position, of_motion = gain[0] * known[0] + gain[1] * known[1], gain[2] * known[2] + gain[3] * known[3]
    return -((of_position + of_motion) + (gain[4] * known[4] + gain[5] * known[5] + gain[6]))
