"""Sequential quadratic programming on the penalised problem: damped Gauss–Newton steps that see constraints coming.

Every step minimises the merit with states and constraints made linear (`coverdrive.planning.quadratic`), damping as in
Marquardt (J. SIAM 11, 1963). B motions descend together, each with a damping of its own.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.merit import Surroundings, input_bounds, merit
from coverdrive.planning.quadratic import best_step

_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 0.1, 1e-4, 1e3
"""times the curvature of the merit"""
_CREEP = 3.0
"""[m/s] below this speed, yaw rates are kept instead"""
_PATIENCE = 2
"""iterations for which motions that are not the cheapest are followed at least"""
_GOOD = 0.75
"""share of the promised gain from which on the damping falls"""
_POOR = 0.25
"""share of the promised gain below which the damping rises"""


class Descent(NamedTuple):
    """Where the motions are on their way down."""

    inputs: Float[np.ndarray, "B U"]
    value: Float[np.ndarray, " B"]
    """of the merit"""
    done: Bool[np.ndarray, " B"]
    """whether the last step gained next to nothing, or none gains anything"""


@compiled
def _projected(wanted: Float[np.ndarray, " U"], around: Surroundings, constants: Constants) -> Float[np.ndarray, " U"]:
    """The wanted inputs within their bounds."""
    low, high = input_bounds(wanted, around.state, constants)
    return np.minimum(np.maximum(wanted, low), high)


@compiled
def _moved(
    inputs: Float[np.ndarray, " U"], change: Float[np.ndarray, " U"], around: Surroundings, constants: Constants
) -> Float[np.ndarray, " U"]:
    """Inputs after a step. Where the step changes the speed, the lateral acceleration keeps to the linear model.

    To first order this is the sum; a motion across the road then does not grow with its speed.
    """
    steps, dt = constants.steps, constants.dt
    moved = inputs + change
    before = after = around.state[2]
    for k in range(steps):
        moved[steps + k] = inputs[steps + k] + max(before, _CREEP) / max(after, _CREEP) * change[steps + k]
        before += dt * inputs[k]
        after += dt * moved[k]
    return moved


@compiled
def descend(
    inputs: Float[np.ndarray, "B U"],
    target: Float[np.ndarray, " B"],
    extra: Float[np.ndarray, " B"],
    around: Surroundings,
    constants: Constants,
    iterations: int,
    tolerance: float,
) -> Descent:
    """Improve motions step by step.

    Args:
        inputs: of the motions to start from.
        target: [m] lat of the centre of each motion's target lane.
        extra: cost of choosing each motion, on top of its merit.
        around: what the plan is made for.
        constants: of the problem.
        iterations: number of steps at the most.
        tolerance: a step that lowers the merit by a smaller share is the last.
    """
    motions = len(inputs)
    at = np.empty_like(inputs)
    for b in range(motions):
        at[b] = _projected(inputs[b], around, constants)
    models = [merit(at[b], target[b], around, constants) for b in range(motions)]
    value = np.array([model.value for model in models])
    damping, done = np.full(motions, _FIRST_DAMPING), np.zeros(motions, np.bool_)
    iteration = 0
    while iteration < iterations and not done.all() and (iteration < _PATIENCE or not done[np.argmin(value + extra)]):
        for b in range(motions):
            if done[b]:
                continue
            change, promised = best_step(at[b], models[b], damping[b], around, constants)
            trial = _projected(_moved(at[b], change, around, constants), around, constants)
            model = merit(trial, target[b], around, constants)
            gain = value[b] - model.value
            done[b] = abs(gain) < tolerance * value[b]
            if gain > 0:
                at[b], models[b], value[b] = trial, model, model.value
            if gain > _GOOD * promised:
                damping[b] = max(damping[b] / 10, _LEAST_DAMPING)
            elif not gain > _POOR * promised:
                damping[b] *= 5
                done[b] |= damping[b] > _MOST_DAMPING
        iteration += 1
    return Descent(at, value, done)
