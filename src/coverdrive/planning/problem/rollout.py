"""Where the inputs of a tree of steps lead to, and what that becomes where the inputs change a little.

A node's step adds dt times its inputs to speed and heading, and dt/2 times the velocities at both ends to the position:
a small change of speed or heading moves the node itself, and all that follow, by the derivatives of its velocity.
N nodes, as in `coverdrive.planning.problem.tree`; states are lon [m], lat [m], speed [m/s], heading [rad].
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled
from coverdrive.planning.problem.tree import Tree
from coverdrive.planning.problem.vehicle import moved
from coverdrive.road_ahead import State

after_step = compiled(moved)
"""the same, compiled"""


class Rollout(NamedTuple):
    """The states at the end of every node's step, and what these positions owe to speeds and headings."""

    states: Float[np.ndarray, "N 4"]
    way: Float[np.ndarray, "N 2 2"]
    """derivatives of half a step's way along lon (0) and lat (1) with respect to the speed (0) and the heading (1)"""


@compiled
def write(row: Any, values: Any) -> None:
    """Write numbers, of an array or a tuple, into an array of as many."""
    for i in range(len(row)):
        row[i] = values[i]


@compiled
def write_rows(rows: Float[np.ndarray, "N n"], values: Float[np.ndarray, "N n"]) -> None:
    """The same of two dimensions: much less to compile than what assigning to a slice is, with its broadcasting."""
    for i in range(len(rows)):
        for j in range(rows.shape[1]):
            rows[i, j] = values[i, j]


@compiled
def state_at(states: Float[np.ndarray, "N 4"], node: int, start: Float[np.ndarray, " 4"]) -> State:
    """The state at the end of a node's step; that of node −1 is the start."""
    if node < 0:
        return start[0], start[1], start[2], start[3]
    return states[node, 0], states[node, 1], states[node, 2], states[node, 3]


@compiled
def rolled(start: Float[np.ndarray, " 4"], inputs: Float[np.ndarray, "N 2"], tree: Tree, dt: float) -> Rollout:
    """Drive the inputs from the start."""
    states = np.empty((len(inputs), 4))
    for n in range(len(inputs)):
        before = state_at(states, tree.parent[n], start)
        states[n, 0], states[n, 1], states[n, 2], states[n, 3] = after_step(before, (inputs[n, 0], inputs[n, 1]), dt)
    return rollout_of(states, dt)


@compiled
def rollout_of(states: Float[np.ndarray, "N 4"], dt: float) -> Rollout:
    """That of states which are known."""
    way = np.empty((len(states), 2, 2))
    for n in range(len(states)):
        speed, cosine, sine = states[n, 2], dt / 2 * np.cos(states[n, 3]), dt / 2 * np.sin(states[n, 3])
        way[n, 0, 0], way[n, 0, 1], way[n, 1, 0], way[n, 1, 1] = cosine, -speed * sine, sine, speed * cosine
    return Rollout(states, way)


@compiled
def changes_of(rollout: Rollout, change: Float[np.ndarray, "N 2"], tree: Tree, dt: float) -> Float[np.ndarray, "N 4"]:
    """Changes of the states, to first order, where the inputs change."""
    result = np.zeros((len(change), 4))
    for n in range(len(change)):
        write_change(result, n, (change[n, 0], change[n, 1]), rollout, tree, dt)
    return result


@compiled
def write_change(
    changes: Float[np.ndarray, "N 4"], n: int, change: tuple[float, float], rollout: Rollout, tree: Tree, dt: float
) -> None:
    """Write that of node n alone; those of the nodes before are known."""
    p, way = tree.parent[n], rollout.way
    lon = lat = speed = heading = 0.0
    if p >= 0:
        lon, lat, speed, heading = changes[p, 0], changes[p, 1], changes[p, 2], changes[p, 3]
        lon += way[p, 0, 0] * speed + way[p, 0, 1] * heading
        lat += way[p, 1, 0] * speed + way[p, 1, 1] * heading
    speed += dt * change[0]
    heading += dt * change[1]
    changes[n, 0] = lon + way[n, 0, 0] * speed + way[n, 0, 1] * heading
    changes[n, 1] = lat + way[n, 1, 0] * speed + way[n, 1, 1] * heading
    changes[n, 2], changes[n, 3] = speed, heading


@compiled
def add_pulled_back(
    rollout: Rollout, by_state: Float[np.ndarray, "N 4"], tree: Tree, dt: float, by_input: Float[np.ndarray, "N 2"]
) -> None:
    """Add what derivatives with respect to the states say about the inputs."""
    by, way = by_state.copy(), rollout.way
    for n in range(len(by) - 1, -1, -1):
        p = tree.parent[n]
        for i in range(2):
            of_way = way[n, 0, i] * by[n, 0] + way[n, 1, i] * by[n, 1]
            by_input[n, i] += dt * (by[n, 2 + i] + of_way)
            if p >= 0:
                by[p, i] += by[n, i]
                by[p, 2 + i] += by[n, 2 + i] + of_way + way[p, 0, i] * by[n, 0] + way[p, 1, i] * by[n, 1]


@compiled
def curvature_of(rollout: Rollout, tree: Tree, dt: float) -> Float[np.ndarray, "N 2"]:
    """Half the second derivatives (Gauss–Newton) of the cost with respect to every single input, states included."""
    result = tree.curvature.copy()
    for n in range(len(tree.parent)):
        j = tree.parent[n]
        while j >= 0:
            result[j, 1] += tree.errors[n, 0] * (dt * (rollout.states[n, 0] - rollout.states[j, 0])) ** 2
            j = tree.parent[j]
    return result
