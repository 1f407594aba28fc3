"""Contact at any time, not only at the moments k·dt: bodies and boxes that move evenly within a step, in closed form.

A plan's states follow from Euler steps of dt. A car that holds the same inputs (a, w) but takes n Euler steps of
δ = dt/n each, as a simulation does, or goes on exactly (n → ∞), has the same speed v and heading ψ at every moment, and
its position is another left Riemann sum of f = (v·cos ψ, v·sin ψ). By the trapezoidal rule such a sum is the integral
less δ/2·(f_k − f_0), up to dt·δ²/12·max|f''| in every step: f is continuous, so that the ends of the steps cancel. So
after k steps it is off the plan by

    (1 − δ/dt)·dt/2·(f_k − f_0), up to the sum over the steps of dt³/6·max|f''|,

where |f_lon''| ≤ 2|a·w|·S + |v|·w², |f_lat''| ≤ 2|a·w| + |v|·w²·S and S ≥ |sin ψ|. Within the step that follows it is
farther off by ∫ v(t')·e(ψ(t')) − v·e(ψ) dt', where v(t') and ψ(t') are what a·t' and w·t' or less of either make of v
and ψ. As a cosine is between 0 and 1, and no sine changes faster than its angle, that is within

    t²/2 · [min(a, 0) − |v·w|·S, max(a, 0) + |v·w|·S] along the road,
    t²/2 · [min(v·w, 0) − |a|·S, max(v·w, 0) + |a|·S] across,

and t² ≤ t·dt makes it even in time. The half extents of the turned body are bounded evenly as well: `own_half_sizes` is
linear in |ψ|, and |ψ(t)| lies below its chord. The edges of the predicted boxes are even by definition. Two such boxes
overlap while four linear functions are positive: during one interval of time, or never.
"""

import numpy as np
from jaxtyping import Float

from coverdrive.compiled import compiled
from coverdrive.planning.constants import Constants
from coverdrive.planning.contact import half_sizes_of

SPARE = 0.1
"""[m] all around a car; less is a contact where contacts are weighed against each other, and no room for a new plan"""
NEVER = 2.0
"""a share of a step that no contact has"""
State = tuple[float, float, float, float]
"""lon [m], lat [m], speed [m/s], heading [rad]"""


@compiled
def write_edges(
    states: Float[np.ndarray, "P 4"], inputs: Float[np.ndarray, " U"], edges: Float[np.ndarray, "K 2 4"],
    constants: Constants,
) -> None:  # fmt: skip
    """Write between which edges the body is during every step: at its start (0) and at its end (1), evenly in between.

    Args:
        states: of the plan.
        inputs: of the plan.
        edges: where the rear, right, front and left edge [m] are written.
        constants: of the problem.
    """
    dt, steps = constants.dt, constants.steps
    unsure_lon = unsure_lat = 0.0
    for k in range(steps):
        speed, acceleration, yaw_rate = states[k, 2], inputs[k], inputs[steps + k]
        sine, turning = max(abs(states[k, 3]), abs(states[k + 1, 3])), speed * yaw_rate
        ahead, aside = lag(states, k, dt)
        start = (
            min(ahead, 0.0) - unsure_lon, min(aside, 0.0) - unsure_lat,
            max(ahead, 0.0) + unsure_lon, max(aside, 0.0) + unsure_lat,
        )  # fmt: skip
        within = (
            min(acceleration, 0.0) - abs(turning) * sine, min(turning, 0.0) - abs(acceleration) * sine,
            max(acceleration, 0.0) + abs(turning) * sine, max(turning, 0.0) + abs(acceleration) * sine,
        )  # fmt: skip
        _place(edges[k, 0], states[k], start, constants)
        _place(edges[k, 1], states[k + 1], start, constants)
        for i in range(4):
            edges[k, 1, i] += dt**2 / 2 * within[i]
        fastest = max(abs(speed), abs(states[k + 1, 2]))
        unsure_lon += dt**3 / 6 * (2 * abs(acceleration * yaw_rate) * sine + fastest * yaw_rate**2)
        unsure_lat += dt**3 / 6 * (2 * abs(acceleration * yaw_rate) + fastest * yaw_rate**2 * sine)


@compiled
def write_exact_edges(
    states: Float[np.ndarray, "P 4"], edges: Float[np.ndarray, "K 2 4"], constants: Constants
) -> None:
    """Write the edges, as `write_edges` does, of a car that goes on exactly, not by steps."""
    for k in range(constants.steps):
        for at in range(2):
            ahead, aside = lag(states, k + at, constants.dt)
            _place(edges[k, at], states[k + at], (ahead, aside, ahead, aside), constants)


@compiled
def lag(states: Float[np.ndarray, "P 4"], moment: int, dt: float) -> tuple[float, float]:
    """How far [m] along lon and lat a car that goes on exactly is from the plan, to second order."""
    now, start = states[moment], states[0]
    along = now[2] * np.cos(now[3]) - start[2] * np.cos(start[3])
    across = now[2] * np.sin(now[3]) - start[2] * np.sin(start[3])
    return dt / 2 * along, dt / 2 * across


@compiled
def _place(
    edges: Float[np.ndarray, " 4"],
    state: Float[np.ndarray, " 4"],
    off: tuple[float, float, float, float],
    constants: Constants,
) -> None:
    """Write the edges of the body in a state, each moved off [m]."""
    half = half_sizes_of(abs(state[3]), constants.vehicle)
    for axis in range(2):
        edges[axis] = state[axis] - half[axis] + off[axis]
        edges[axis + 2] = state[axis] + half[axis] + off[axis + 2]


@compiled
def contact_at(
    edges: Float[np.ndarray, "K 2 4"], boxes: Float[np.ndarray, "7 P n"], step: int, slot: int, room: float
) -> float:
    """The share of a step after which body and box first overlap; `NEVER` if they do not.

    Args:
        edges: of the body.
        boxes: lon, lat, half length, half width [m], speed and deceleration of the boxes.
        step: index of the step, from 0.
        slot: index of the box.
        room: [m] by which the body is larger all around.
    """
    first, last = 0.0, 1.0
    for axis in range(2):
        half_now, half_then = boxes[2 + axis, step, slot] + room, boxes[2 + axis, step + 1, slot] + room
        for side in (-1.0, 1.0):  # the body's front is beyond the box's rear; its rear is not beyond the box's front
            own = axis + 2 if side < 0 else axis
            now = side * (boxes[axis, step, slot] - edges[step, 0, own]) + half_now
            then = side * (boxes[axis, step + 1, slot] - edges[step, 1, own]) + half_then
            if now <= 0 and then <= 0:
                return NEVER
            if now <= 0:
                first = max(first, now / (now - then))
            elif then <= 0:
                last = min(last, now / (now - then))
    return first if first < last else NEVER


@compiled
def impact(
    state: State, applied: tuple[float, float], share: float, boxes: Float[np.ndarray, "7 P n"], step: int, slot: int,
    dt: float,
) -> float:  # fmt: skip
    """Relative speed [m/s] of car and box after a share of a step."""
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
    state: State,
    edges: Float[np.ndarray, " 4"],
    boxes: Float[np.ndarray, "7 P n"],
    slot: int,
    braking: float,
    room: float,
) -> float:
    """Closing speed [m/s] at which the car meets a box that is ahead at the end and goes on; −1 if it need not.

    Args:
        state: of the car at the end of the plan; it goes straight on, braking.
        edges: rear, right, front and left edge [m] of its body then.
        boxes: with the speed [m/s] to brake to, and its fall [m/s²].
        slot: index of the box.
        braking: [m/s²] its deceleration.
        room: [m] by which the body is larger all around.
    """
    faster = state[2] - boxes[4, -1, slot]
    way = boxes[0, -1, slot] - boxes[2, -1, slot] - edges[2] - room
    lat, half = boxes[1, -1, slot], boxes[3, -1, slot] + room
    if faster <= 0 or way < 0 or edges[1] >= lat + half or edges[3] <= lat - half:
        return -1.0
    fall = min(boxes[5, -1, slot], braking)
    harder = braking - fall
    if faster * fall <= boxes[4, -1, slot] * harder:
        left = faster**2 - 2 * harder * way
    else:
        left = state[2] ** 2 - 2 * braking * (way + boxes[4, -1, slot] ** 2 / (2 * fall))
    return np.sqrt(left) if left > 0 else -1.0
