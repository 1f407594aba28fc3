"""How well an episode went: one function per measure, each from a trace alone.

n steps, A vehicle slots.
"""

import numpy as np
from jaxtyping import Float

from coverdrive.geometry import axis_gap, turned_half_extents
from coverdrive.planning.plan import Status
from coverdrive.simulation.initial import OWN
from coverdrive.simulation.motion import half_sizes_of, states_of
from coverdrive.simulation.outcome import contacts
from coverdrive.simulation.trace import Trace

_SETTLED = 0.25
"""share of a lane's width: nearer than this to its centre, the own car counts as having reached the lane"""


def mean_speed(trace: Trace) -> float:
    """Mean speed of the own car [m/s]."""
    return float(trace.scene.speed[:, OWN].mean())


def distance(trace: Trace) -> float:
    """How far the own car came along the road [m]."""
    return float(trace.scene.lon[-1, OWN] - trace.scene.lon[0, OWN])


def lane_changes(trace: Trace) -> int:
    """How often the own car reached another lane's centre, up to a quarter of the lane's width."""
    lat = np.asarray(trace.scene.lat[:, OWN])
    lane = np.asarray(trace.road.lane_of(lat))
    width = np.diff(np.asarray(trace.road.edges))[lane]
    settled = np.abs(lat - np.asarray(trace.road.centres)[lane]) < _SETTLED * width
    return int(np.count_nonzero(np.diff(lane[settled])))


def overtakes(trace: Trace) -> int:
    """How many vehicles were ahead of the own car at the start and are behind it at the end, by their centres."""
    ahead = np.asarray(trace.scene.lon) > np.asarray(trace.scene.lon)[:, [OWN]]
    return int((ahead[0] & ~ahead[-1] & trace.scene.valid[-1]).sum())


def road_departure(trace: Trace) -> float:
    """How far the own car's body got beyond the edges of the road [m]; 0 if it stayed on it."""
    lat = trace.scene.lat[:, OWN]
    extent = turned_half_extents(half_sizes_of(trace.scene)[:, OWN], trace.scene.heading[:, OWN])[:, 1]
    beyond = np.maximum(trace.road.edges[0] - (lat - extent), lat + extent - trace.road.edges[-1])
    return float(max(0.0, beyond.max()))


def minimum_gap(trace: Trace) -> float:
    """Least distance [m] of the own car's body to another, as boxes along the road; infinite without another."""
    gap, _ = _apart(trace)
    return float(np.hypot(*np.moveaxis(np.maximum(gap, 0.0), -1, 0)).min(initial=np.inf))


def minimum_time_to_collision(trace: Trace) -> float:
    """Least time [s] to contact of the own car, at any moment, if all kept their velocity; infinite if never.

    Bodies are boxes along the road; the velocities are vectors, so that contact from the side counts as well.
    """
    gap, separation = _apart(trace)
    states = states_of(trace.scene)
    velocity = states[..., [2]] * np.stack([np.cos(states[..., 3]), np.sin(states[..., 3])], axis=-1)
    closing = -np.sign(separation) * (velocity - velocity[:, [OWN]])[_others(trace)]
    reach = 2 * np.abs(separation) - gap
    with np.errstate(divide="ignore", invalid="ignore"):
        enter = np.where(gap < 0, -np.inf, np.where(closing > 0, gap / closing, np.inf))
        leave = np.where(closing == 0, np.where(gap < 0, np.inf, -np.inf), reach / closing)
    del leave
    return float(enter.max(-1).min(initial=np.inf))
