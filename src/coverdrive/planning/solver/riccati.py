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
def minimiser(
    stages: Stages, held: Bool[np.ndarray, "N 2"], rollout: Rollout, tree: Tree, dt: float
) -> Float[np.ndarray, "N 2"]:
    """The change of the inputs that costs least.

    Args:
        stages: the problem, convex in the inputs.
        held: which inputs do not change.
        rollout: the motion whose changes follow from those of the inputs.
        tree: its steps.
        dt: [s].
    """
    return _played(_gains(stages, held, rollout, tree, dt), rollout, tree, dt)


@compiled
def _put_in(forms: Float[np.ndarray, "N 7 7"], n: int, old: int, factor: float, new: int) -> None:
    """Replace a variable of a form by itself plus a factor times another one."""
    for i in range(7):
        forms[n, new, i] += factor * forms[n, old, i]
    for i in range(7):
        forms[n, i, new] += factor * forms[n, i, old]


@compiled
def _gains(
    stages: Stages, held: Bool[np.ndarray, "N 2"], rollout: Rollout, tree: Tree, dt: float
) -> Float[np.ndarray, "N 2 7"]:
    """How acceleration (0) and yaw rate (1) of each node follow from what is known by then: minus the gains times it.

    The inputs known are those of the parent, but the acceleration is chosen after the yaw rate and knows it.
    """
    nodes, way = len(tree.parent), rollout.way
    gains, forms, row = np.empty((nodes, 2, 7)), np.zeros((nodes, 7, 7)), np.empty(7)
    for n in range(nodes - 1, -1, -1):
        p = tree.parent[n]
        for i in range(4):
            forms[n, i, _ONE] += stages.by_state[n, i]
            forms[n, _ONE, i] += stages.by_state[n, i]
            for j in range(4):
                forms[n, i, j] += stages.by_states[n, i, j]
        for i in range(2):  # the second half of the way, and how speed and heading grow with the inputs
            for axis in range(2):
                _put_in(forms, n, axis, way[n, axis, i], 2 + i)
            _put_in(forms, n, 2 + i, dt, 4 + i)
        for i in range(2):
            if p >= 0:  # the first half of the way
                for axis in range(2):
                    _put_in(forms, n, axis, way[p, axis, i], 2 + i)
            forms[n, 4 + i, 4 + i] += stages.by_inputs[n, i]
            forms[n, 4 + i, _ONE] += stages.by_input[n, i]
            forms[n, _ONE, 4 + i] += stages.by_input[n, i]
        for i in range(2):
            _eliminate(forms, n, i, held[n, i], tree.changes[n, i], gains, row)
        if p >= 0:
            for i in range(7):
                for j in range(7):
                    forms[p, i, j] += forms[n, i, j]
    return gains


@compiled
def _eliminate(
    forms: Float[np.ndarray, "N 7 7"], n: int, which: int, held: bool, change: float, gains: Float[np.ndarray, "N 2 7"],
    row: Float[np.ndarray, " 7"],
) -> None:  # fmt: skip
    """Put in the best value of an input; the same input of the parent takes its place in the form."""
    at = 4 + which
    per = 0.0 if held else 1 / forms[n, at, at]
    for i in range(7):
        row[i] = forms[n, at, i]
    row[at] = -change
    for i in range(7):
        gains[n, which, i] = per * row[i]
        forms[n, at, i] = forms[n, i, at] = 0.0
    forms[n, at, at] = change
    for i in range(7):
        gain = gains[n, which, i]
        for j in range(7):
            forms[n, i, j] -= gain * row[j]


@compiled
def _played(gains: Float[np.ndarray, "N 2 7"], rollout: Rollout, tree: Tree, dt: float) -> Float[np.ndarray, "N 2"]:
    """The inputs that follow from the gains, node by node."""
    nodes = len(gains)
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
