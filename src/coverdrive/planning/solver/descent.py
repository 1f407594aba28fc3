"""Sequential quadratic programming on the penalised problem: damped Gauss–Newton steps that see constraints coming.

Every step minimises the merit with states and constraints made linear (`coverdrive.planning.solver.quadratic`), damping
as in Marquardt (J. SIAM 11, 1963). B plans descend together, each with a damping of its own.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.compiled import compiled
from coverdrive.planning.check.merit import Model, input_bounds, merit, within
from coverdrive.planning.problem.constants import Constants
from coverdrive.planning.problem.rollout import write_rows
from coverdrive.planning.solver.quadratic import best_step
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


class _Reached(NamedTuple):
    """Where a plan is on its way down."""

    inputs: Float[np.ndarray, "N 2"]
    low: Float[np.ndarray, "N 2"]
    """least change of the inputs from there"""
    high: Float[np.ndarray, "N 2"]
    """largest change of the inputs from there"""
    model: Model


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
    result, speeds = np.empty_like(inputs), np.empty((len(inputs), 2))
    for n in range(len(inputs)):
        p = constants.tree.parent[n]
        before, after = (speeds[p, 0], speeds[p, 1]) if p >= 0 else (around.state[2], around.state[2])
        result[n, 0] = inputs[n, 0] + change[n, 0]
        result[n, 1] = inputs[n, 1] + max(before, _CREEP) / max(after, _CREEP) * change[n, 1]
        speeds[n, 0], speeds[n, 1] = before + constants.dt * inputs[n, 0], after + constants.dt * result[n, 0]
    return result


@compiled
def _reached(
    wanted: Float[np.ndarray, "N 2"], targets: Float[np.ndarray, " 2"], around: Surroundings, constants: Constants
) -> _Reached:
    """The inputs nearest to wanted ones that keep the bounds that follow from these."""
    low, high = input_bounds(wanted, around, constants)
    inputs = np.empty_like(wanted)
    for n in range(len(inputs)):
        for i in range(2):
            inputs[n, i] = within(wanted[n, i], low[n, i], high[n, i])
            low[n, i] -= inputs[n, i]
            high[n, i] -= inputs[n, i]
    return _Reached(inputs, low, high, merit(inputs, targets, around, constants))


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
    at = [_reached(inputs[b], targets[b], around, constants) for b in range(plans)]
    value, damping, done = np.empty(plans), np.empty(plans), np.zeros(plans, np.bool_)
    for b in range(plans):
        value[b], damping[b] = at[b].model.value, _FIRST_DAMPING
    iteration = 0
    while iteration < iterations and not done.all() and (iteration < _PATIENCE or not done[np.argmin(value + extra)]):
        for b in range(plans):
            if done[b]:
                continue
            here = at[b]
            change, promised = best_step(here.model, damping[b], here.low, here.high, constants)
            trial = _reached(_moved(here.inputs, change, around, constants), targets[b], around, constants)
            gain = value[b] - trial.model.value
            done[b] = abs(gain) < tolerance * value[b]
            if gain > 0:
                at[b], value[b] = trial, trial.model.value
            if gain > _GOOD * promised:
                damping[b] = max(damping[b] / 10, _LEAST_DAMPING)
            elif not gain > _POOR * promised:
                damping[b] *= 5
                done[b] |= damping[b] > _MOST_DAMPING
        iteration += 1
    end = np.empty_like(inputs)
    for b in range(plans):
        write_rows(end[b], at[b].inputs)
    return Descent(end, value, done)
