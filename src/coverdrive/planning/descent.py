"""Sequential quadratic programming on the penalised problem: damped Gauss–Newton steps that see constraints coming.

Every step minimises the merit with states and constraints made linear (`coverdrive.planning.quadratic`), damping as in
Marquardt (J. SIAM 11, 1963). B plans descend together, each with a damping of its own.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.merit import input_bounds, merit
from coverdrive.planning.quadratic import best_step
from coverdrive.planning.surroundings import Surroundings

_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 0.1, 1e-4, 1e3
"""times the curvature of the merit"""
_CREEP = 3.0
"""[m/s] below this speed, yaw rates are kept instead"""
_PATIENCE = 2
"""iterations for which plans that are not the cheapest are followed at least"""
_GOOD = 0.75
"""share of the promised gain from which on the damping falls"""
_POOR = 0.25
"""share of the promised gain below which the damping rises"""


class Descent(NamedTuple):
    """Where the plans are on their way down."""

    inputs: Float[np.ndarray, "B N 2"]
    value: Float[np.ndarray, " B"]
    """of the merit"""
    done: Bool[np.ndarray, " B"]
    """whether the last step gained next to nothing, or none gains anything"""


@compiled
def _moved(
    inputs: Float[np.ndarray, "N 2"], change: Float[np.ndarray, "N 2"], around: Surroundings, constants: Constants
) -> Float[np.ndarray, "N 2"]:
    """Inputs after a step. Where the step changes the speed, the lateral acceleration keeps to the linear model.

    To first order this is the sum; a plan across the road then does not grow with its speed.
    """
    result, speeds = inputs + change, np.empty((len(inputs), 2))
    for n in range(len(inputs)):
        p = constants.tree.parent[n]
        before, after = (speeds[p, 0], speeds[p, 1]) if p >= 0 else (around.state[2], around.state[2])
        result[n, 1] = inputs[n, 1] + max(before, _CREEP) / max(after, _CREEP) * change[n, 1]
        speeds[n, 0], speeds[n, 1] = before + constants.dt * inputs[n, 0], after + constants.dt * result[n, 0]
    return result


@compiled
def descend(
    inputs: Float[np.ndarray, "B N 2"],
    targets: Float[np.ndarray, "B 2"],
    extra: Float[np.ndarray, " B"],
    around: Surroundings,
    constants: Constants,
    iterations: int,
    tolerance: float,
) -> Descent:
    """Improve plans step by step.

    Args:
        inputs: of the plans to start from.
        targets: [m] lat of the centres of the target lanes of each plan's branches.
        extra: cost of choosing each plan, on top of its merit.
        around: what the plan is made for.
        constants: of the problem.
        iterations: number of steps at the most.
        tolerance: a step that lowers the merit by a smaller share is the last.
    """
    plans = len(inputs)
    at, bounds = np.empty_like(inputs), [input_bounds(inputs[b], around, constants) for b in range(plans)]
    for b in range(plans):
        at[b] = np.minimum(np.maximum(inputs[b], bounds[b][0]), bounds[b][1])
    models = [merit(at[b], targets[b], around, constants) for b in range(plans)]
    value = np.array([model.value for model in models])
    damping, done = np.full(plans, _FIRST_DAMPING), np.zeros(plans, np.bool_)
    iteration = 0
    while iteration < iterations and not done.all() and (iteration < _PATIENCE or not done[np.argmin(value + extra)]):
        for b in range(plans):
            if done[b]:
                continue
            change, promised = best_step(models[b], damping[b], bounds[b][0] - at[b], bounds[b][1] - at[b], constants)
            wanted = _moved(at[b], change, around, constants)
            low, high = input_bounds(wanted, around, constants)
            trial = np.minimum(np.maximum(wanted, low), high)
            model = merit(trial, targets[b], around, constants)
            gain = value[b] - model.value
            done[b] = abs(gain) < tolerance * value[b]
            if gain > 0:
                at[b], bounds[b], models[b], value[b] = trial, (low, high), model, model.value
            if gain > _GOOD * promised:
                damping[b] = max(damping[b] / 10, _LEAST_DAMPING)
            elif not gain > _POOR * promised:
                damping[b] *= 5
                done[b] |= damping[b] > _MOST_DAMPING
        iteration += 1
    return Descent(at, value, done)
