"""What a plan is made for: where the ego is, the road ahead of it, and the boxes of those around it.

P moments, n boxes of every member, m of what is likely.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import lent
from coverdrive.paths import PredictedPaths
from coverdrive.planning.problem.obstacles import obstacles_of, reachable, shrink_tubes
from coverdrive.planning.problem.road_table import RoadTable, on_road
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.rules.manners import NONE, MannersSettings, widen, wished
from coverdrive.planning.rules.wish import NO_WISH, Wish
from coverdrive.road_ahead import RoadAhead


@lent
class Surroundings(NamedTuple):
    """What a plan is made for."""

    state: Float[np.ndarray, " 4"]
    """lon (0), lat [m], speed [m/s], heading [rad] now"""
    previous_input: Float[np.ndarray, " 2"]
    """acceleration [m/s²] and yaw rate [rad/s] applied before"""
    road: RoadAhead
    """how it bends, its edges and speeds"""
    wanted: Float[np.ndarray, " P"]
    """[m/s] speed at every moment"""
    boxes: Float[np.ndarray, "7 P n"]
    """`coverdrive.planning.problem.obstacles.obstacles_of` every member, those apart that the ego cannot come near"""
    likely: Float[np.ndarray, "7 P m"]
    """the same of what is likely, and the boxes of `coverdrive.planning.rules.manners.widen`"""
    sideways: float = np.inf
    """[m/s] across the road that the drive branch is not to exceed"""


def surroundings_of(
    state: Float[np.ndarray, " 4"], applied: Float[np.ndarray, " 2"], paths: PredictedPaths, table: RoadTable,
    problem: ProblemSettings, wish: Wish = NO_WISH, manners: MannersSettings = NONE,
) -> Surroundings:  # fmt: skip
    """What a plan is made for, along the road from where the ego is, after these inputs."""
    lon, shape = float(state[0]), problem.obstacles
    paths = on_road(paths, lon, table)
    every, likeliest = obstacles_of(paths, shape)
    near = reachable(state, every, problem.dt, table.reaching, shape)
    every[0] -= lon
    apart = likeliest & (paths.vehicle >= 0) & wished(every, state, problem.vehicle.width, manners)
    which, asked = (near & likeliest).nonzero()[0], apart.nonzero()[0]
    likely = every.take(np.concatenate([which, asked]), axis=2)
    shrink_tubes(likely, problem.branches.tube)
    widen(likely, len(which), state, problem, manners)
    return Surroundings(
        state=np.array([0.0, *state[1:]]),
        previous_input=np.array(applied),
        road=table.ahead(lon),
        wanted=table.wanted_from(lon, float(state[2]), problem, wish.speed, wish.braking, wish.urgent),
        boxes=every.compress(near, axis=2),
        likely=likely,
        sideways=manners.fastest_sideways,
    )
