"""Contact at any time, not only at the moments k·dt: bodies and boxes that move evenly within a step, in closed form.

The state at the end of a step is `coverdrive.planning.problem.vehicle.moved`; within it the velocity is f = (v·cos ψ,
v·sin ψ) with even v and ψ, so that the acceleration f' is a·(cos ψ, sin ψ) + v·w·(−sin ψ, cos ψ), which lies within

    [min(a, 0) − |v·w|·S, max(a, 0) + |v·w|·S] along the road, and
    [min(v·w, 0) − |a|·S, max(v·w, 0) + |a|·S] across, with S ≥ |sin ψ| and |v| the largest of the step.

A function whose second derivative is within [l, h] is between its chord less dt²/8·max(h, 0) and its chord plus
dt²/8·max(−l, 0). The positions at the ends of the steps are trapezoidal sums of f: whatever shorter steps the same
inputs are driven by, or exactly, they differ by no more than the sum over the steps of dt³/12·max|f''|, where
|f_lon''| ≤ 2|a·w|·S + |v|·w² and |f_lat''| ≤ 2|a·w| + |v|·w²·S. The half extents of the turned body are bounded evenly
as well: `own_half_sizes` is linear in |ψ|, and |ψ(t)| lies below its chord. The edges of the predicted boxes are even
by definition. Two such boxes overlap while four linear functions are positive: during one interval of time, or never.

That is what a clear plan must never do. How hard a plan meets what it does not keep clear of is another question, for
which the body is the turned rectangle itself, apart from a box where one of the four directions of their sides parts
them (Gottschalk, Lin, Manocha 1996).
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled
from coverdrive.geometry import turned_extents
from coverdrive.planning.check.contact import half_sizes_of
from coverdrive.planning.problem.constants import Constants
from coverdrive.planning.problem.obstacles import BRAKE_TO, FALL
from coverdrive.planning.problem.rollout import after_step
from coverdrive.road_ahead import State

NEVER = 2.0
"""a share of a step that no contact has"""
_LOOKS = 10
"""at the turned body in a step, between which it gets as deep into a box as linear interpolation says"""
_extents_of = compiled(turned_extents)


@compiled
def write_edges(
    states: Float[np.ndarray, "P 4"], inputs: Float[np.ndarray, "K 2"], edges: Float[np.ndarray, "K 2 4"],
    constants: Constants,
) -> None:  # fmt: skip
    """Write between which rear, right, front and left edges [m] the body of a plan is during every step: at its start
    (0) and at its end (1), evenly in between.
    """
    dt, unsure_lon, unsure_lat = constants.dt, 0.0, 0.0
    for k in range(constants.steps):
        acceleration, yaw_rate = inputs[k]
        sine = max(abs(states[k, 3]), abs(states[k + 1, 3]))
        fastest = max(abs(states[k, 2]), abs(states[k + 1, 2]))
        turning, bend = fastest * yaw_rate, dt**2 / 8
        unsure_lon += dt**3 / 12 * (2 * abs(acceleration * yaw_rate) * sine + fastest * yaw_rate**2)
        unsure_lat += dt**3 / 12 * (2 * abs(acceleration * yaw_rate) + fastest * yaw_rate**2 * sine)
        off = (
            -bend * (max(acceleration, 0.0) + abs(turning) * sine) - unsure_lon,
            -bend * (max(turning, 0.0) + abs(acceleration) * sine) - unsure_lat,
            bend * (max(-acceleration, 0.0) + abs(turning) * sine) + unsure_lon,
            bend * (max(-turning, 0.0) + abs(acceleration) * sine) + unsure_lat,
        )
        for at in range(2):
            state = states[k + at]
            half = half_sizes_of(abs(state[3]), constants.vehicle)
            for axis in range(2):
                edges[k, at, axis] = state[axis] - half[axis] + off[axis]
                edges[k, at, axis + 2] = state[axis] + half[axis] + off[axis + 2]


@compiled
def may_touch(edges: Float[np.ndarray, "K 2 4"], boxes: Float[np.ndarray, "7 P n"], step: int, slot: int) -> bool:
    """Whether the edges of a body, as of `write_edges`, and a box overlap at any time of a step, counted from 0."""
    first, last = 0.0, 1.0
    for axis in range(2):
        half_now, half_then = boxes[2 + axis, step, slot], boxes[2 + axis, step + 1, slot]
        for side in (-1.0, 1.0):  # the body's front is beyond the box's rear; its rear is not beyond the box's front
            own = axis + 2 if side < 0 else axis
            now = side * (boxes[axis, step, slot] - edges[step, 0, own]) + half_now
            then = side * (boxes[axis, step + 1, slot] - edges[step, 1, own]) + half_then
            if now <= 0 and then <= 0:
                return False
            if then <= 0:
                last = min(last, now / (now - then))
            elif now <= 0:
                first = max(first, now / (now - then))
    return first < last


@compiled
def contact_at(
    state: State, applied: tuple[float, float], boxes: Float[np.ndarray, "7 P n"], step: int, slot: int, grown: float,
    deep: float, constants: Constants,
) -> tuple[float, bool]:  # fmt: skip
    """The share of a step after which the turned body and a box first overlap by a depth, `NEVER` if they do not, and
    whether the box's front then meets the body's rear.

    Args:
        state: at the start of the step.
        applied: acceleration [m/s²] and yaw rate [rad/s] during the step.
        boxes: as of `coverdrive.planning.problem.obstacles.obstacles_of`.
        step: index of the step, from 0.
        slot: index of the box.
        grown: share of what the box has grown since the start of the plan: 1 for all of it, 0 for the body alone.
        deep: [m] from which on an overlap counts.
        constants: of the problem.
    """
    before = 0.0
    for look in range(_LOOKS + 1):
        share = look / _LOOKS
        body = after_step(state, applied, share * constants.dt)
        along, across, ahead = _depth(body, boxes, step, share, slot, grown, constants)
        depth = min(along, across) - deep
        if depth > 0:
            since = share if look == 0 else share - depth / (depth - before) / _LOOKS
            return since, along < across and not ahead  # what overlaps least does so for the shortest time
        before = depth
    return NEVER, False


@compiled
def _depth(
    body: State, boxes: Float[np.ndarray, "7 P n"], step: int, share: float, slot: int, grown: float,
    constants: Constants,
) -> tuple[float, float, bool]:  # fmt: skip
    """How deep [m] a body is in a box, by the directions along road and body and by those across them, below 0 where
    they are apart, and whether the box is ahead.
    """
    vehicle, rest = constants.vehicle, 1 - share
    long, wide = boxes[2, 0, slot], boxes[3, 0, slot]
    long += grown * (rest * boxes[2, step, slot] + share * boxes[2, step + 1, slot] - long)
    wide += grown * (rest * boxes[3, step, slot] + share * boxes[3, step + 1, slot] - wide)
    lon = rest * boxes[0, step, slot] + share * boxes[0, step + 1, slot] - body[0]
    lat = rest * boxes[1, step, slot] + share * boxes[1, step + 1, slot] - body[1]
    cosine, sine = np.cos(body[3]), np.sin(body[3])
    own_long, own_wide = _extents_of(vehicle.length / 2, vehicle.width / 2, body[3])
    its_long, its_wide = _extents_of(long, wide, body[3])
    along = min(own_long + long - abs(lon), its_long + vehicle.length / 2 - abs(lon * cosine + lat * sine))
    across = min(own_wide + wide - abs(lat), its_wide + vehicle.width / 2 - abs(lat * cosine - lon * sine))
    return along, across, lon > 0


@compiled
def reach(body: State, deep: float, vehicle: Any) -> Float[np.ndarray, " 4"]:
    """Rear, right, front and left edge [m] of the turned body, less what it may be ``deep`` [m] in others; ahead only
    as far as all of its front is: what is farther ahead than that, and not touched yet, is ahead.
    """
    long, wide = _extents_of(vehicle.length / 2, vehicle.width / 2, body[3])
    front = long - vehicle.width * abs(np.sin(body[3]))
    return np.array([body[0] - long + deep, body[1] - wide + deep, body[0] + front - deep, body[1] + wide - deep])


@compiled
def impact(
    state: State, applied: tuple[float, float], share: float, boxes: Float[np.ndarray, "7 P n"], step: int, slot: int,
    dt: float,
) -> float:  # fmt: skip
    """Relative speed [m/s] of ego and box after a share of a step."""
    speed, heading = state[2] + share * dt * applied[0], state[3] + share * dt * applied[1]
    along = speed * np.cos(heading) - _velocity(boxes[0, :, slot], step, share) / dt
    across = speed * np.sin(heading) - _velocity(boxes[1, :, slot], step, share) / dt
    return np.sqrt(along**2 + across**2)


@compiled
def _velocity(at: Float[np.ndarray, " P"], step: int, share: float) -> float:
    """How fast a coordinate changes [per step] after a share of a step, if it does so evenly faster or slower."""
    first, last = max(step - 1, 0), min(step + 1, len(at) - 2)
    more = (at[last + 1] - at[last]) - (at[first + 1] - at[first])
    return at[step + 1] - at[step] + (share - 0.5) * more / max(last - first, 1)


@compiled
def impact_beyond(
    state: State, edges: Float[np.ndarray, " 4"], boxes: Float[np.ndarray, "7 P n"], slot: int, braking: float
) -> float:
    """Closing speed [m/s] at which the ego meets a box that is ahead at the end and goes on; −1 if it need not.

    From its state at the end of the plan, with the rear, right, front and left edge [m] of its body, the ego goes
    straight on, braking [m/s²].
    """
    other, fall = boxes[BRAKE_TO, -1, slot], min(boxes[FALL, -1, slot], braking)
    faster, harder = state[2] - other, braking - fall
    way = boxes[0, -1, slot] - boxes[2, -1, slot] - edges[2]
    lat, half = boxes[1, -1, slot], boxes[3, -1, slot]
    if faster <= 0 or way < 0 or edges[1] >= lat + half or edges[3] <= lat - half:
        return -1.0
    left = faster**2 - 2 * harder * way
    if faster * fall > other * harder:  # it is faster until the other one stands, and maybe after that
        left = min(left, state[2] ** 2 - 2 * braking * (way + other**2 / (2 * fall)))
    return np.sqrt(left) if left > 0 else -1.0
