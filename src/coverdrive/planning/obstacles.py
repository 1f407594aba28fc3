"""Predicted paths as obstacles of the optimal control problem (paper §4).

At step k the own centre (lon, lat) must stay out of a superellipse around every predicted centre:
(|Δlon|/A)^p + (|Δlat|/B)^p + γ_k ≥ 1. The paper has p = 2 and A, B the sums of the semi-axes; such an ellipse does
not contain the corners of the two boxes. Here A = α·(a_i + a) and B = β·(b_i + b), a_i and b_i being half sizes of
the predicted box, a and b of the turned own box, and α^(−p) + β^(−p) = 1: the superellipse passes through the
corners, so that every pair of overlapping boxes violates the constraint. P = K + 1 is the number of states.
"""

from typing import Any, Literal

import equinox as eqx
import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field

from coverdrive.paths import PredictedPaths
from coverdrive.planning.reach import reachable_boxes
from coverdrive.planning.vehicle import VehicleSettings
from coverdrive.road import Road
from coverdrive.settings import Settings

_SMOOTHING = 0.01
"""[rad] of the smooth upper bound of |heading|; it adds 2 cm to the half width of the own car"""
_FAR = 1e4
"""[m] ahead, where the boxes of free slots are"""


class ObstacleSettings(Settings):
    """Shape and choice of the obstacles."""

    order: Literal[2, 4] = 4
    """p of the superellipse (paper: 2)"""
    lateral_inflation: float = Field(default=1.19, gt=1)
    """β: factor on the summed half widths; 2^(1/p) inflates length and width alike"""
    ignore_rear: bool = False
    """whether the vehicle directly behind in the own lane is no obstacle (paper, Remark 2)"""

    @property
    def longitudinal_inflation(self) -> float:
        """α: factor on the summed half lengths."""
        return (1 - self.lateral_inflation**-self.order) ** (-1 / self.order)


class Obstacles(eqx.Module):
    """The n boxes to stay clear of at every step; the same slot of two steps need not be the same path."""

    centres: Float[np.ndarray, "K n 2"]
    """[m] (lon, lat) at the steps k = 1 … K"""
    half_sizes: Float[np.ndarray, "K n 2"]
    """[m] half extents along lon and lat of the predicted box"""

    @property
    def slots(self) -> int:
        """Number of boxes n at every step."""
        return self.centres.shape[1]


def own_half_sizes(heading: Any, vehicle: VehicleSettings, mathematics: Any = np) -> tuple[Any, Any]:
    """Half extents of the turned own box along lon and lat, from above and smooth in the heading.

    A box of half length a and half width b turned by ψ has the half extents a·cos ψ + b·|sin ψ| and
    b·cos ψ + a·|sin ψ|; both are smaller than what is returned here.

    Args:
        heading: [rad].
        vehicle: size of the own car.
        mathematics: the module with ``sqrt`` for the heading: ``numpy`` or ``casadi``.

    Returns:
        [m] along lon and [m] along lat.
    """
    tilt = mathematics.sqrt(heading**2 + _SMOOTHING**2)
    half_length, half_width = vehicle.length / 2, vehicle.width / 2
    return half_length + half_width * tilt, half_width + half_length * tilt


def clearance(
    offset: tuple[Any, Any], half_sizes: tuple[Any, Any], own: tuple[Any, Any], settings: ObstacleSettings
) -> Any:
    """Left-hand side of the obstacle constraint without its slack: below 1 if the boxes overlap.

    Args:
        offset: [m] own centre minus predicted centre along lon and lat.
        half_sizes: [m] half extents of the predicted box along lon and lat.
        own: [m] half extents of the own box along lon and lat.
        settings: shape of the obstacles.
    """
    ahead = offset[0] / (settings.longitudinal_inflation * (half_sizes[0] + own[0]))
    aside = offset[1] / (settings.lateral_inflation * (half_sizes[1] + own[1]))
    return ahead**settings.order + aside**settings.order


def clearances(
    states: Float[np.ndarray, "*m P 4"],
    obstacles: Obstacles,
    vehicle: VehicleSettings,
    settings: ObstacleSettings,
) -> Float[np.ndarray, "*m K n"]:
    """Left-hand sides of all obstacle constraints, without their slacks, at the steps k = 1 … K.

    Args:
        states: lon [m], lat [m], speed [m/s], heading [rad].
        obstacles: the boxes to stay clear of.
        vehicle: size of the own car.
        settings: shape of the obstacles.
    """
    lon, lat, heading = (states[..., 1:, i, None] for i in (0, 1, 3))
    offset = (lon - obstacles.centres[..., 0], lat - obstacles.centres[..., 1])
    half_sizes = (obstacles.half_sizes[..., 0], obstacles.half_sizes[..., 1])
    return clearance(offset, half_sizes, own_half_sizes(heading, vehicle), settings)


def smallest_slack(values: Float[np.ndarray, "*m K n"]) -> Float[np.ndarray, "*m K"]:
    """The smallest slack γ_k of every step with which constraints of these left-hand sides hold."""
    return np.maximum(0.0, 1.0 - values.min(axis=-1, initial=1.0))


def reachable_obstacles(
    state: Float[np.ndarray, " 4"], paths: PredictedPaths, vehicle: VehicleSettings, settings: ObstacleSettings
) -> Obstacles:
    """The paths that the own car could meet at all within the horizon, as obstacles.

    Leaving out the others loses nothing: their constraints hold whatever the car does.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad] now.
        paths: the predicted paths at the times k·dt, k = 0 … K.
        vehicle: size and limits of the own car.
        settings: shape of the obstacles.
    """
    centres = np.moveaxis(paths.points[:, 1:], 0, 1)
    half_sizes = np.moveaxis(paths.half_sizes[:, 1:], 0, 1)
    reach_centres, reach_half_sizes = reachable_boxes(state, centres.shape[0], paths.dt, vehicle)
    own = np.array(own_half_sizes(max(abs(state[3]), vehicle.max_heading), vehicle))
    inflation = np.array([settings.longitudinal_inflation, settings.lateral_inflation])
    distance = np.abs(centres - reach_centres[:, None]) - reach_half_sizes[:, None]
    meets = np.all(distance < inflation * (half_sizes + own), axis=-1).any(axis=0)
    return Obstacles(centres[:, meets], half_sizes[:, meets])


def chosen_obstacles(obstacles: Obstacles, chosen: Bool[np.ndarray, "K n"], lon: float) -> Obstacles:
    """The chosen boxes of every step, in a number of slots that is a power of two and at least 8.

    Few sizes of the optimisation problem thus serve every scene; free slots hold boxes that are out of reach.

    Args:
        obstacles: the boxes to choose from.
        chosen: which of them, step by step.
        lon: [m] where the own car is.
    """
    steps = chosen.shape[0]
    slots = max(8, 1 << (int(chosen.sum(axis=1).max(initial=1)) - 1).bit_length())
    centres = np.tile([lon + _FAR, 0.0], (steps, slots, 1))
    half_sizes = np.full((steps, slots, 2), _FAR / 10)
    step, box = np.nonzero(chosen)
    slot = (np.cumsum(chosen, axis=1) - 1)[step, box]
    centres[step, slot] = obstacles.centres[step, box]
    half_sizes[step, slot] = obstacles.half_sizes[step, box]
    return Obstacles(centres, half_sizes)


def without_rear(state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> PredictedPaths:
    """The paths without those of the vehicle directly behind in the own lane (paper, Remark 2)."""
    now = paths.points[:, 0]
    same_lane = np.asarray(road.lane_of(now[:, 1]) == road.lane_of(state[1:2]))
    gap = np.where(same_lane & (now[:, 0] < state[0]), state[0] - now[:, 0], np.inf)
    if not np.isfinite(gap).any():
        return paths
    return paths.of(paths.vehicle != paths.vehicle[np.argmin(gap)])
