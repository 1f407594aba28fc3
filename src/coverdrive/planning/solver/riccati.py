"""Quadratic problems over a tree of steps, solved from its ends to its start (dynamic programming, Riccati).

What the rest of a plan costs at the least is a quadratic form of the state and of the inputs before; where branches
meet, their forms add up. One step back, the state is put in as what it was before the step and the inputs, and the
inputs are eliminated: the effort grows with the number of nodes, not with its cube as where all are solved for at once.

The variables of a form are lon, lat, speed, heading, acceleration, yaw rate and 1.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.compiled import compiled
from coverdrive.planning.problem.rollout import Rollout, write_change
from coverdrive.planning.problem.tree import Tree

_ONE = 6
"""index of the 1"""


class Stages(NamedTuple):
    """A quadratic problem: half the derivatives, first and second, of what the changes of states and inputs cost."""

    by_state: Float[np.ndarray, "N 4"]
    by_states: Float[np.ndarray, "N 4 4"]
    by_input: Float[np.ndarray, "N 2"]
    by_inputs: Float[np.ndarray, "N 2"]
    """diagonal; the weights of the changes from one step to the next are part of it"""


@compiled
def _place(i: int, j: int) -> int:
    """Where the coefficient of two variables stands: a form is symmetric, so that half of it is kept."""
    return i * (i + 1) // 2 + j if i >= j else j * (j + 1) // 2 + i


@compiled
def _put_in(form: Float[np.ndarray, " 28"], old: int, factor: float, new: int) -> None:
    """Replace a variable of a form by itself plus a factor times another one."""
    both = form[_place(old, new)]
    for i in range(7):
        if i != new:
            form[_place(new, i)] += factor * form[_place(old, i)]
    form[_place(new, new)] += factor * (2 * both + factor * form[_place(old, old)])


@compiled
def _gains(
    stages: Stages, held: Bool[np.ndarray, "N 2"], rollout: Rollout, tree: Tree, dt: float
) -> Float[np.ndarray, "N 2 7"]:
    """How acceleration (0) and yaw rate (1) of each node follow from what is known by then: minus the gains times it.

    The inputs known are those of the parent, but the acceleration is chosen after the yaw rate and knows it.
    """
    nodes, way = len(tree.parent), rollout.way
    gains, forms = np.empty((nodes, 2, 7)), np.zeros((nodes, 28))
    for n in range(nodes - 1, -1, -1):
        p, form = tree.parent[n], forms[n]
        for i in range(4):
            form[_place(_ONE, i)] += stages.by_state[n, i]
            for j in range(i + 1):
                form[_place(i, j)] += stages.by_states[n, i, j]
        for i in range(2):  # the second half of the way, and how speed and heading grow with the inputs
            for axis in range(2):
                _put_in(form, axis, way[n, axis, i], 2 + i)
            _put_in(form, 2 + i, dt, 4 + i)
        for i in range(2):
            if p >= 0:  # the first half of the way
                for axis in range(2):
                    _put_in(form, axis, way[p, axis, i], 2 + i)
            form[_place(4 + i, 4 + i)] += stages.by_inputs[n, i]
            form[_place(_ONE, 4 + i)] += stages.by_input[n, i]
        for i in range(2):
            _eliminate(form, 4 + i, held[n, i], tree.changes[n, i], gains[n, i])
        if p >= 0:
            for i in range(28):
                forms[p, i] += form[i]
    return gains


@compiled
def _eliminate(
    form: Float[np.ndarray, " 28"], which: int, held: bool, change: float, gains: Float[np.ndarray, " 7"]
) -> None:
    """Put in the best value of an input; the same input of the parent takes its place in the form."""
    per = 0.0 if held else 1 / form[_place(which, which)]
    for i in range(7):
        gains[i] = -change if i == which else form[_place(which, i)]
        form[_place(which, i)] = change if i == which else 0.0
    for i in range(7):
        for j in range(i + 1):
            form[_place(i, j)] -= per * gains[i] * gains[j]
    for i in range(7):
        gains[i] *= per


@compiled
def minimiser(
    stages: Stages, held: Bool[np.ndarray, "N 2"], rollout: Rollout, tree: Tree, dt: float
) -> Float[np.ndarray, "N 2"]:
    """The change of the inputs that costs least in a problem that is convex in them, where some are ``held``.

    The rollout is the motion whose changes follow from those of the inputs, in the steps of ``dt`` [s] of a tree.
    """
    gains, nodes = _gains(stages, held, rollout, tree, dt), len(tree.parent)
    result, states, known = np.empty((nodes, 2)), np.zeros((nodes, 4)), np.zeros(7)
    known[_ONE] = 1.0
    for n in range(nodes):
        p = tree.parent[n]
        for i in range(6):
            known[i] = 0.0 if p < 0 else states[p, i] if i < 4 else result[p, i - 4]
        for i in (1, 0):
            chosen = 0.0
            for j in range(7):
                chosen -= gains[n, i, j] * known[j]
            result[n, i] = known[4 + i] = chosen
        write_change(states, n, (result[n, 0], result[n, 1]), rollout, tree, dt)
    return result
