"""The tree of steps that a plan is: branches that share their beginning, and what every step of them costs.

The *drive* branch is what is wanted, against what is likely; the *fail-safe* branch keeps clear of every member of
every set. They have the first steps in common, because nobody knows before the next plan which one will be driven
(contingency MPC: Alsterda, Gerdes 2021; branch MPC: Chen, Rosolia et al. 2022; fail-safe planning: Pek, Althoff 2021).
Every node is a step from the state of its parent to its own one. K steps a branch, N nodes.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from pydantic import Field

from coverdrive.planning.problem.cost import CostSettings
from coverdrive.settings import Settings

_ROUNDING = 1e-9
"""of a number of steps"""


class BranchSettings(Settings):
    """How the two branches of a plan differ."""

    fail_safe: bool = True
    """whether there are two branches; else the plan is one that keeps clear of every member, as in the paper"""
    latency: float = Field(default=0.0, ge=0, le=1)
    """[s] from the next plan until it is driven; by then the branches still have everything in common"""
    comfort: float = Field(default=0.6, gt=0, le=1)
    """factor on the costs of the fail-safe branch, which is hardly ever driven far; it has no wanted speed"""
    tube: float = Field(default=0.3, ge=0, le=1)
    """share of the uncertainty around the likeliest path of every vehicle that the drive branch keeps clear of"""

    def shared(self, period: float, steps: int, dt: float) -> int:
        """How many of K ``steps`` of ``dt`` [s] the branches share, for a ``period`` [s] from one plan to the next."""
        return begun(period + self.latency, steps, dt) if self.fail_safe else steps


def begun(time: float, steps: int, dt: float) -> int:
    """How many of K ``steps`` of ``dt`` [s] begin before a time [s]; at least one."""
    return min(max(int(np.ceil(time / dt - _ROUNDING)), 1), steps)


class Tree(NamedTuple):
    """Nodes, each after its parent, and the factors on the squares that they cost."""

    parent: Int[np.ndarray, " N"]
    """index of the node before; −1: now"""
    moment: Int[np.ndarray, " N"]
    """k = 1 … K at the end of the node's step"""
    careful: Bool[np.ndarray, " N"]
    """whether every member counts there, or only what is likely"""
    safe: Bool[np.ndarray, " N"]
    """whether the node belongs to the fail-safe branch alone"""
    errors: Float[np.ndarray, "N 3"]
    """[1/m²], [s²/m²], [1/rad²] of the distance from the lane's centre, the speed error and the heading"""
    inputs: Float[np.ndarray, "N 2"]
    """[s⁴/m²], [s²/rad²] of acceleration and yaw rate"""
    changes: Float[np.ndarray, "N 2"]
    """the same of their difference from those of the parent"""
    slack: Float[np.ndarray, " N"]
    """c_k of the obstacle slacks; the largest of them all along the fail-safe branch, which must be clear"""
    curvature: Float[np.ndarray, "N 2"]
    """half the second derivatives of the costs of inputs, speed and heading with respect to every single input"""
    least_curvature: float
    """smallest eigenvalue of half their second derivatives with respect to all inputs"""
    drive: Int[np.ndarray, " K"]
    """nodes of the drive branch, shared ones included"""
    fail_safe: Int[np.ndarray, " K"]
    """nodes of the fail-safe branch, shared ones included"""


def tree_of(cost: CostSettings, branches: BranchSettings, shared: int, steps: int, dt: float) -> Tree:
    """The tree of two branches of K ``steps`` of ``dt`` [s] that have the first ``shared`` in common."""
    own = np.arange(shared, steps)
    nodes = np.arange(steps + len(own))
    safe, moment = nodes >= steps, np.concatenate([np.arange(1, steps + 1), own + 1])
    parent = nodes - 1
    parent[steps:][:1] = shared - 1
    comfort = np.where(safe, branches.comfort, 1.0)[:, None]
    errors = comfort * np.where(moment == steps, cost.terminal, 1.0)[:, None] * [cost.lane, cost.speed, cost.heading]
    errors[safe, 1] = 0.0
    inputs = comfort * [cost.acceleration, cost.yaw_rate]
    changes = comfort * [cost.acceleration_change, cost.yaw_rate_change]
    change = np.eye(len(nodes)) - (parent[:, None] == nodes)
    summed, slack = dt * np.linalg.inv(change), cost.slack_weights(steps)
    bends = [
        np.diag(inputs[:, i]) + change.T @ (changes[:, i, None] * change) + summed.T @ (errors[:, 1 + i, None] * summed)
        for i in range(2)
    ]
    return Tree(
        parent=parent,
        moment=moment,
        careful=safe | (nodes < shared),
        safe=safe,
        errors=errors,
        inputs=inputs,
        changes=changes,
        slack=np.where(safe, slack.max(), slack[moment - 1]),
        curvature=np.stack([np.diag(each) for each in bends], axis=-1),
        least_curvature=float(min(np.linalg.eigvalsh(each)[0] for each in bends)),
        drive=nodes[:steps],
        fail_safe=np.concatenate([nodes[:shared], nodes[steps:]]),
    )


def shift_of(tree: Tree, elapsed: float, dt: float) -> Float[np.ndarray, "N N"]:
    """The map from the inputs of a tree to those of one that begins ``elapsed`` [s] later.

    A step's inputs become the means of the old ones over it; after the end of a branch its last inputs are held on.
    """
    result = np.zeros((len(tree.parent), len(tree.parent)))
    for branch in (tree.fail_safe, tree.drive):  # the shared steps go on as the drive branch does
        result[branch] = 0.0
        result[np.ix_(branch, branch)] = held_on(len(branch), elapsed, dt)
    return result


def held_on(steps: int, elapsed: float, dt: float) -> Float[np.ndarray, "K K"]:
    """`shift_of` of a single branch of K steps."""
    ends = elapsed / dt + np.arange(steps + 1)
    known = np.arange(steps + 1)
    integral = np.tril(np.ones((steps + 1, steps)), k=-1)  # of unit inputs until each end
    until = np.stack([np.interp(ends, known, column) for column in integral.T], axis=-1)
    until[:, -1] += np.maximum(ends - steps, 0.0)
    return np.diff(until, axis=0)
