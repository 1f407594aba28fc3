"""How well an episode went: the measures of a trace that take more than one line; m moments, B other vehicles."""

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.distances import FREE, Kept, kept
from coverdrive.geometry import body_distance, boxes_overlap, turned_half_extents
from coverdrive.plan import Status
from coverdrive.simulation.drives.outcome import contacts
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.roads.initial import EGO

_LOOKS = 21
"""moments of a step at which contact is looked for"""
_SETTLED = 0.25
"""share of a lane's width: nearer than this to its centre, the ego counts as having reached the lane"""


def lane_changes(trace: Trace) -> int:
    """How often the ego reached another lane's centre, up to a quarter of the lane's width."""
    lon, lat = (np.asarray(each[:, EGO]) for each in (trace.scene.lon, trace.scene.lat))
    lane, edges = trace.road.lane_at(lon, lat), trace.road.edges_at(lon)
    right, left = (np.take_along_axis(edges, lane[:, None] + side, 1)[:, 0] for side in (0, 1))
    settled = np.abs(lat - (right + left) / 2) < _SETTLED * (left - right)
    return int(np.count_nonzero(np.diff(lane[settled])))


def overtakes(trace: Trace) -> int:
    """How many vehicles were ahead of the ego at the start and are behind it at the end, by their centres."""
    ahead = np.asarray(trace.scene.lon) > np.asarray(trace.scene.lon)[:, [EGO]]
    return int((ahead[0] & ~ahead[-1] & trace.scene.valid[0] & trace.scene.valid[-1]).sum())


def road_departure(trace: Trace) -> float:
    """How far the ego's body got beyond the edges of the road [m]; 0 if it stayed on it."""
    lat = trace.scene.lat[:, EGO]
    extent = turned_half_extents(trace.scene.half_sizes[:, EGO], np.asarray(trace.scene.heading)[:, EGO])[:, 1]
    edges = trace.road.edges_at(trace.scene.lon[:, EGO])
    beyond = np.maximum(edges[:, 0] - (lat - extent), lat + extent - edges[:, -1])
    return float(max(0.0, beyond.max()))


def gaps(trace: Trace) -> Float[np.ndarray, " m"]:
    """Distance [m] of the ego's body to the nearest other one at every moment; infinite without another."""
    scene, half_sizes = trace.scene, trace.scene.half_sizes
    centre, heading = trace.road.bodies_to_map(scene.lon, scene.lat, scene.heading)
    others = np.arange(scene.vehicles) != EGO
    own, other = ((centre[:, slots], heading[:, slots], half_sizes[:, slots]) for slots in (np.array([EGO]), others))
    there = np.asarray(scene.valid)[:, others]
    return body_distance(*own, *other).min(-1, initial=np.inf, where=there)


def distances(trace: Trace) -> Kept:
    """How near the ego was to others at every moment."""
    return Kept(*(each[:, 0] for each in kept(trace.scene, trace.road, np.array([EGO]))))


def traffic_collisions(trace: Trace) -> int:
    """Number of pairs of uncontrolled vehicles that overlap at any moment."""
    touched = np.any(contacts(trace.scene, trace.road), axis=0)
    touched[EGO] = touched[:, EGO] = False
    return int(np.triu(touched).sum())


def jerk(trace: Trace) -> tuple[float, float]:
    """Root mean square of the ego's jerk [m/s³] along and across its way, from the inputs that were applied.

    A plan's acceleration, and its yaw rate times the speed, hold for one step; jerk is their change from step to step.
    """
    change = np.diff(_accelerations(trace), axis=0) / float(trace.time[1] - trace.time[0])
    if len(change) == 0:
        return 0.0, 0.0
    along, across = np.sqrt((change**2).mean(0)).tolist()
    return along, across


def hardest_braking(trace: Trace) -> float:
    """Largest deceleration of the ego [m/s²]."""
    return float(max(0.0, -_accelerations(trace)[:, 0].min()))


def hardest_braking_behind(trace: Trace, near: Kept) -> float:
    """Largest deceleration [m/s²] of the nearest vehicle behind the ego in its lane, while less than `FREE` behind it.

    What the ego asks of others: it is 0 where nobody follows, or nobody brakes. Who is further behind is free of it.
    Who is ``near`` is what `distances` says.
    """
    step, follower = np.arange(len(trace)), near.follower[:-1]
    follows = (near.left[:-1] < FREE) & np.asarray(trace.scene.valid)[step + 1, follower]
    change = np.diff(np.asarray(trace.scene.speed), axis=0)[step, follower] / float(trace.time[1] - trace.time[0])
    return float(max(0.0, -change.min(initial=0.0, where=follows)))


def _accelerations(trace: Trace) -> Float[np.ndarray, "n 2"]:
    """Acceleration [m/s²] of the ego along and across its way in every step."""
    period = float(trace.time[1] - trace.time[0])
    applied = np.stack([plan.applied(period) for plan in trace.plans])
    speed = np.asarray(trace.scene.speed)[:-1, EGO]
    along = np.maximum(applied[:, 0], np.minimum(0.0, -speed / period))  # braking ends at rest
    return np.stack([along, applied[:, 1] * speed], axis=-1)


def clear_plans(trace: Trace) -> Bool[np.ndarray, " n"]:
    """Which plans were called clear of every path."""
    return np.array([plan.status in (Status.SOLVED, Status.FALLBACK) for plan in trace.plans])


def lost_clear(trace: Trace) -> int:
    """How often no clear plan was found one step after a clear one, whose rest should have been clear."""
    clear = clear_plans(trace)
    return int((clear[:-1] & ~clear[1:]).sum())


def clear_contacts(trace: Trace) -> int:
    """In how many steps the ego, driving what was called clear, touched a predicted box at any time; must be 0."""
    (at, paths), states = trace.all_paths, trace.scene.states[:, EGO]
    body, share = trace.scene.half_sizes[at, EGO], np.linspace(0.0, 1.0, _LOOKS)[:, None, None]
    middle, half = (states[at, :2] + states[at + 1, :2]) / 2, np.abs(states[at + 1, :2] - states[at, :2]) / 2
    last = int(np.ceil((trace.time[1] - trace.time[0]) / paths.dt - 1e-9)) + 1
    moved = np.ptp(paths.points[:, :last], axis=1) + paths.half_sizes[:, :last].max(1)
    reach = half + moved + np.hypot(body[:, :1], body[:, 1:])
    near = (np.abs(middle - paths.points[:, 0]) < reach).all(1)  # most are not, and need no look
    near &= clear_plans(trace)[at]
    at, body, points, half_sizes = at[near], body[near], paths.points[near], paths.half_sizes[near]
    own = states[at] + share * (states[at + 1] - states[at])
    gone = share[..., 0] * (trace.time[at + 1] - trace.time[at]) / paths.dt
    before = np.minimum(gone.astype(int), points.shape[1] - 2)
    row, gone = np.arange(len(at)), (gone - before)[..., None]
    points, half_sizes = (
        each[row, before] + gone * (each[row, before + 1] - each[row, before]) for each in (points, half_sizes)
    )
    touching = boxes_overlap(own[..., :2], own[..., 3], body, points, np.zeros(points.shape[:-1]), half_sizes)
    return len(np.unique(at[touching.any(0)]))
