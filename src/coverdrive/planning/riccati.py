"""Quadratic problems over the horizon, solved from the last step to the first (dynamic programming, Riccati).

What the rest of a motion costs at the least is a quadratic form of the state and of the inputs before. One step back,
the state is put in as what it was before the step and the inputs, and the inputs are eliminated. The effort grows with
the number of steps, not with its cube as where all inputs are solved for at once. K steps, U = 2K inputs.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.planning.compiled import compiled
from coverdrive.planning.course import Course

_ACCELERATION, _YAW_RATE, _ONE, _SIZE = 4, 5, 6, 7
"""Forms have the variables lon, lat, speed, heading, acceleration, yaw rate and the constant 1, for linear terms."""


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
    steps, by_lon, by_lat = len(course.states), course.lon_by, course.lat_by
    form, gains = np.zeros((_SIZE, _SIZE)), np.empty((steps, 2, _SIZE))
    for k in range(steps - 1, -1, -1):
        for i in range(4):
            for j in range(4):
                form[i, j] += stages.by_states[k, i, j]
            form[i, _ONE] += stages.by_state[k, i]
            form[_ONE, i] += stages.by_state[k, i]
        for i in range(_SIZE):
            form[i, 4] += dt * form[i, 2]
            form[i, 5] += dt * form[i, 3]
            form[i, 2] += by_lon[k, 0] * form[i, 0] + by_lat[k, 0] * form[i, 1]
            form[i, 3] += by_lon[k, 1] * form[i, 0] + by_lat[k, 1] * form[i, 1]
        for i in range(_SIZE):
            form[4, i] += dt * form[2, i]
            form[5, i] += dt * form[3, i]
            form[2, i] += by_lon[k, 0] * form[0, i] + by_lat[k, 0] * form[1, i]
            form[3, i] += by_lon[k, 1] * form[0, i] + by_lat[k, 1] * form[1, i]
        for which, at in ((0, _ACCELERATION), (1, _YAW_RATE)):
            i = which * steps + k
            form[at, at] += stages.by_inputs[i]
            form[at, _ONE] += stages.by_input[i]
            form[_ONE, at] += stages.by_input[i]
        for which, at in ((0, _ACCELERATION), (1, _YAW_RATE)):
            _eliminate(form, at, stages.of_change[which], held[which * steps + k], gains[k, which])
    return _played(gains, course, dt)


@compiled
def _eliminate(
    form: Float[np.ndarray, "7 7"], at: int, of_change: float, held: bool, gain: Float[np.ndarray, " 7"]
) -> None:
    """Put in for an input what costs least, and put the same input of the step before in its place.

    The input is −``gain`` times the variables, with the input before in its own place.
    """
    inverse = 0.0 if held else 1 / form[at, at]
    for j in range(_SIZE):
        gain[j] = inverse * form[at, j]
    gain[at] = -inverse * of_change
    for i in range(_SIZE):
        if i != at:
            for j in range(_SIZE):
                form[i, j] -= gain[i] * form[at, j]
    for i in range(_SIZE):
        form[i, at] = form[at, i] = of_change * gain[i]
    form[at, at] += of_change


@compiled
def _played(gains: Float[np.ndarray, "K 2 7"], course: Course, dt: float) -> Float[np.ndarray, " U"]:
    """The inputs that follow from the gains, step by step."""
    steps, by_lon, by_lat = len(course.states), course.lon_by, course.lat_by
    result, now = np.empty(2 * steps), np.zeros(_SIZE)
    now[_ONE] = 1.0
    for k in range(steps):
        for which, at in ((1, _YAW_RATE), (0, _ACCELERATION)):
            value = 0.0
            for i in range(_SIZE):
                value -= gains[k, which, i] * now[i]
            now[at] = result[which * steps + k] = value
        now[0] += by_lon[k, 0] * now[2] + by_lon[k, 1] * now[3]
        now[1] += by_lat[k, 0] * now[2] + by_lat[k, 1] * now[3]
        now[2] += dt * now[_ACCELERATION]
        now[3] += dt * now[_YAW_RATE]
    return result
