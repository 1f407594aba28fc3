"""Predicted paths as obstacles of the optimal control problem (paper §4).

At step k the ego's centre (lon, lat) must stay out of a superellipse around every predicted centre:
((|Δlon|/A)^p + (|Δlat|/B)^p)^(1/p) + γ_k ≥ 1. The paper has p = 2, no root, and for A, B the sums of the semi-axes;
such an ellipse does not contain the corners of the two boxes. Here A = α·(a_i + a) and B = β·(b_i + b), a_i and b_i
being half sizes of the predicted box, a and b of the ego's turned box, and α^(−p) + β^(−p) = 1: the superellipse
passes through the corners, so that every pair of overlapping boxes violates the constraint. The root changes no set; it
makes the slack the share of the way to the centre.

At the last step the ego's box is longer ahead by the way that it comes nearer to the other vehicle while it brakes to
its speed, should that go on as at the end of its path, at a speed or braking to a stop: whoever ends a plan free of
slack can still brake behind it. P = K + 1 is the number of states.
"""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from jaxtyping import Bool, Float, Int
from pydantic import Field

from coverdrive.compiled import compiled
from coverdrive.paths import PredictedPaths
from coverdrive.settings import Settings

TINY = 1e-12
"""keeps the root differentiable at the centre"""
_MARGIN = 1.1
"""how much nearer than to this share of touching no motion comes to a path that is left out"""
BRAKE_TO, FALL, LIKELIHOOD = 4, 5, 6
"""rows of boxes, after lon, lat [m] of their centres, half length and half width [m]: the speed [m/s] that the ego must
be able to brake to after this moment, the deceleration [m/s²] at which that falls on, and how likely the vehicle is to
take this path"""
FAR = 1e5
"""[m/s] a speed that no car has to brake to"""


class ObstacleSettings(Settings):
    """Shape and choice of the obstacles."""

    order: Literal[2, 4, 8, 16, 32] = 8
    """p of the superellipse (paper: 2); a higher order is nearer to the box"""
    margin: float = Field(default=0.01, ge=0, le=0.1)
    """by which the constraints ask for more than not touching; slack up to it costs, but is no contact"""
    edge_margin: float = Field(default=0.05, ge=0, le=1)
    """[m] by which the body is kept further inside the road than it must"""
    terminal_braking: bool = True
    """whether the end of a plan leaves the way to brake behind a vehicle that keeps its speed"""
    ignore_rear: bool = False
    """whether the vehicle directly behind in the own lane is no obstacle (paper, Remark 2)"""

    @property
    def inflation(self) -> float:
        """α = β: factor on the summed half sizes."""
        return 2 ** (1 / self.order)


def own_half_sizes(heading: Any, vehicle: Any) -> tuple[Any, Any]:
    """Half extents of the ego's turned box along lon and lat, from above and linear in the heading.

    A box of half length a and half width b turned by ψ ≥ 0 has the half extents a·cos ψ + b·sin ψ and
    b·cos ψ + a·sin ψ, which are at most a + b·ψ and b + a·ψ. For either sign of the heading the larger extents count:
    whoever needs smooth ones poses the constraint for ψ and for −ψ.

    Args:
        heading: [rad], at least 0 unless the other sign counts as well.
        vehicle: size of the ego.

    Returns:
        [m] along lon and [m] along lat.
    """
    half_length, half_width = vehicle.length / 2, vehicle.width / 2
    return half_length + half_width * heading, half_width + half_length * heading


def way_to_brake(
    speed: Any, other: Any, deceleration: Any, hardest: float, where: Callable[[Any, Any, Any], Any] = np.where
) -> Any:
    """Way [m] by which a car that brakes as hard as it can comes nearer to one that is ahead and at most as fast.

    Either both get equally fast before the one ahead stands, or both come to a stop.

    Args:
        speed: [m/s] of the car that brakes.
        other: [m/s] of the one ahead, at most that.
        deceleration: [m/s²] of the one ahead, until it stands; more than ``hardest`` counts as that.
        hardest: [m/s²] of the car that brakes.
        where: takes the second where the first holds, else the third.
    """
    deceleration = where(deceleration < hardest, deceleration, hardest)
    faster, harder = speed - other, hardest - deceleration
    before = faster * deceleration <= other * harder
    alike = faster**2 / (2 * where(harder > 0, harder, 1.0))
    standing = speed**2 / (2 * hardest) - other**2 / (2 * where(before, 1.0, deceleration))
    return where(before, alike, standing)


def clearance(
    offset: tuple[Any, Any],
    half_sizes: tuple[Any, Any],
    own: tuple[Any, Any],
    way: Any,
    settings: ObstacleSettings,
) -> Any:
    """Left-hand side of the obstacle constraint without its slack: below 1 if the boxes overlap.

    Args:
        offset: [m] centre of the ego minus predicted centre along lon and lat.
        half_sizes: [m] half extents of the predicted box along lon and lat.
        own: [m] half extents of the ego's box along lon and lat.
        way: [m] by which the box of the ego is longer ahead.
        settings: shape of the obstacles.
    """
    order = settings.order
    ahead = (offset[0] + way / 2) / (settings.inflation * (half_sizes[0] + own[0] + way / 2))
    aside = offset[1] / (settings.inflation * (half_sizes[1] + own[1]))
    return (ahead**order + aside**order + TINY) ** (1 / order)


def obstacles_of(
    paths: PredictedPaths, settings: ObstacleSettings
) -> tuple[Float[np.ndarray, "7 P n"], Bool[np.ndarray, " n"]]:
    """All n predicted paths as boxes to stay clear of; between two moments every one of them moves and grows evenly.

    Args:
        paths: the predicted paths at the times k·dt, k = 0 … K.
        settings: whether the end of the plan must leave the way to brake.

    Returns:
        The boxes, with rows as `BRAKE_TO` says; and which paths are the likeliest of their vehicles.
    """
    boxes, likeliest = np.empty((7, paths.points.shape[1], len(paths))), np.zeros(len(paths), dtype=bool)
    weight = np.ones(len(paths)) if paths.weight is None else np.maximum(paths.weight, TINY)
    points, half_sizes = (np.ascontiguousarray(each) for each in (paths.points, paths.half_sizes))
    _write_boxes(points, half_sizes, paths.vehicle, weight, paths.dt, settings.terminal_braking, boxes, likeliest)
    return boxes, likeliest


@compiled
def _write_boxes(
    points: Float[np.ndarray, "n P 2"], half_sizes: Float[np.ndarray, "n P 2"], vehicle: Int[np.ndarray, " n"],
    weight: Float[np.ndarray, " n"], dt: float, braking: bool, boxes: Float[np.ndarray, "7 P n"],
    likeliest: Bool[np.ndarray, " n"],
) -> None:  # fmt: skip
    """Write what `obstacles_of` returns, from paths whose ends leave the way to brake if ``braking``."""
    last, likelihood = boxes.shape[1] - 1, np.empty(len(vehicle))
    _compare(vehicle, weight, likelihood, likeliest)
    for i in range(len(vehicle)):
        for k in range(last + 1):
            for axis in range(2):
                boxes[axis, k, i], boxes[2 + axis, k, i] = points[i, k, axis], half_sizes[i, k, axis]
            boxes[BRAKE_TO, k, i], boxes[FALL, k, i], boxes[LIKELIHOOD, k, i] = FAR, 0.0, likelihood[i]
        if braking:
            before = (points[i, last - 1, 0] - points[i, max(last - 2, 0), 0]) / dt
            speed = (points[i, last, 0] - points[i, last - 1, 0]) / dt
            fall = max(0.0, before - speed)
            boxes[BRAKE_TO, last, i], boxes[FALL, last, i] = max(0.0, speed - fall / 2), fall / dt


@compiled
def _compare(
    vehicle: Int[np.ndarray, " n"], weight: Float[np.ndarray, " n"], likelihood: Float[np.ndarray, " n"],
    likeliest: Bool[np.ndarray, " n"],
) -> None:  # fmt: skip
    """Write the shares of the weights in those of their vehicles, and which is the first of the largest."""
    count, best, total = 0, np.empty(len(vehicle), np.int64), np.empty(len(vehicle))  # of each vehicle
    group = np.empty(len(vehicle), np.int64)
    for i in range(len(vehicle)):
        g = 0
        while g < count and vehicle[best[g]] != vehicle[i]:
            g += 1
        if g == count:
            count, best[g], total[g] = count + 1, i, 0.0
        elif weight[i] > weight[best[g]]:
            best[g] = i
        group[i] = g
        total[g] += weight[i]
    for i in range(len(vehicle)):
        likelihood[i], likeliest[i] = weight[i] / total[group[i]], best[group[i]] == i


def shrink_tubes(boxes: Float[np.ndarray, "7 P n"], share: float) -> None:
    """Let boxes grow from now on by a share of what they do, and be all that is to be kept clear of."""
    now = boxes[2:4, :1]
    boxes[2:4] = now + share * (boxes[2:4] - now)
    boxes[LIKELIHOOD] = 1.0


def reachable(
    state: Float[np.ndarray, " 4"], boxes: Float[np.ndarray, "7 P n"], dt: float, vehicle: Any,
    settings: ObstacleSettings,
) -> Bool[np.ndarray, " n"]:  # fmt: skip
    """The boxes that some motion of the ego can come near at any time; leaving out the others loses nothing."""
    low, high = reachable_range(state, boxes.shape[1], dt, vehicle)
    half_length = own_half_sizes(max(abs(state[3]), vehicle.max_heading), vehicle)[0]
    half_length += (vehicle.max_deceleration + vehicle.max_lateral_acceleration) * dt**2 / 2  # held inputs in a step
    brake = max(state[2], vehicle.max_speed) ** 2 / (2 * vehicle.max_deceleration)
    near = np.zeros(boxes.shape[2], dtype=bool)
    _mark_near(boxes, low, high, float(half_length), float(brake), settings.inflation, near)
    return near


def reachable_range(
    state: Float[np.ndarray, " 4"], moments: int, dt: float, vehicle: Any
) -> tuple[Float[np.ndarray, " P"], Float[np.ndarray, " P"]]:
    """[m] least and largest lon at the times k·dt [s]; speed and heading take their extremes each on its own."""
    lon, speed, heading = float(state[0]), float(state[2]), max(abs(float(state[3])), vehicle.max_heading)
    low, high = np.empty((2, moments))
    braking = -vehicle.max_deceleration, min(speed, 0.0)
    faster = vehicle.max_acceleration, max(speed, vehicle.max_speed)
    _write_range(lon, speed, float(np.cos(heading)), braking, faster, dt, low, high)
    return low, high


@compiled
def _write_range(
    lon: float, speed: float, along: float, braking: tuple[float, float], faster: tuple[float, float], dt: float,
    low: Float[np.ndarray, " P"], high: Float[np.ndarray, " P"],
) -> None:  # fmt: skip
    """Write between which lon [m] the ego is at the times k·dt [s] if it brakes or accelerates, given both limits."""
    for k in range(len(low)):
        least = _way(speed, *braking, k, dt)
        low[k], high[k] = lon + min(least, along * least), lon + _way(max(speed, 0.0), *faster, k, dt)


@compiled
def _way(speed: float, acceleration: float, bound: float, k: int, dt: float) -> float:
    """Way [m] by the time k·dt [s] at an acceleration [m/s²] that ends at a speed [m/s]."""
    changing = min(k * dt, (bound - speed) / acceleration)
    return bound * k * dt - (bound - speed) * changing + acceleration / 2 * changing**2


@compiled
def _mark_near(
    boxes: Float[np.ndarray, "7 P n"], low: Float[np.ndarray, " P"], high: Float[np.ndarray, " P"], half_length: float,
    brake: float, inflation: float, near: Bool[np.ndarray, " n"],
) -> None:  # fmt: skip
    """Tell which boxes an ego of this half length [m] comes near between the ends.

    Both move evenly in a step, but for what the half length has room for: what is ahead, or behind, at its start and at
    its end is so all the while.
    """
    for slot in range(len(near)):
        was_ahead = was_behind = False
        for k in range(len(low)):
            lon, reach = boxes[0, k, slot], boxes[2, k, slot] + half_length
            way = brake if boxes[BRAKE_TO, k, slot] < FAR else 0.0
            room = _MARGIN * inflation * reach + (inflation - 1) * way
            ahead, behind = lon >= high[k] + room + way, lon <= low[k] - room
            near[slot] |= not ((ahead and (was_ahead or k == 0)) or (behind and (was_behind or k == 0)))
            was_ahead, was_behind = ahead, behind
