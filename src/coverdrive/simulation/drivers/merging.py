"""How drivers leave a lane that ends, and how those beside it let them in.

Such a change is mandatory: it is wanted the more, the nearer the end is, and whoever wants it more accepts smaller gaps
and harsher braking. As in the model of Schakel, Knoop & van Arem (*Integrated lane change model with relaxation and
synchronization*, 2012), drivers synchronise with the lane that they want to enter, the next driver there opens a gap,
and the short time gaps that were accepted relax afterwards. Car following is the IDM
(`coverdrive.simulation.drivers.idm_mobil`), to which the end of a lane is a place to stop at (Treiber & Kesting,
*Traffic Flow Dynamics*, 2013, ch. 14). A vehicles.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Int

from coverdrive.simulation.drivers.idm_mobil import FREE, Drivers, Neighbours, Values, follow, of
from coverdrive.simulation.roads.course import Course

ZONE = 300.0
"""[m] ahead of the end of a lane from which on drivers want to leave it (Schakel et al. 2012: 295 m)"""

SHORTEST_GAP = 0.56
"""[s] time gap that is accepted at the end of a lane (Schakel et al. 2012)"""

HARSHEST = 4.0
"""[m/s²] that is accepted there of oneself and of the new follower, if the driver does not accept more anyway"""

RELAXATION = 25.0
"""[s] in which an accepted time gap becomes the usual one again (Schakel et al. 2012)"""

SPARE = 3.0
"""[m] from the place to stop at to the end of the lane"""


_AT_THE_END = 1.0
"""[m] to the place to stop at from which on nobody starts again"""


class Pressure(NamedTuple):
    """How much each driver has to leave the lane."""

    room: Values
    """[m] from the front bumper to the place to stop at; `FREE` in a lane that goes on, and while changing lanes"""
    urgency: Values
    """0 far from the end, or where a lane goes on, to 1 at the end"""


def pressure(
    course: Course, lon: Values, length: Values, lane: Int[np.ndarray, "S A"], staying: Bool[np.ndarray, "S A"]
) -> Pressure:
    """The pressure on drivers in lanes, of whom some are ``staying`` in theirs so far."""
    room = np.where(staying & (course.way_out[lane] != 0), course.ends[1][lane] - SPARE - lon - length / 2, FREE)
    return Pressure(room, np.clip(1 - room / ZONE, 0.0, 1.0))


def in_haste(drivers: Drivers, urgency: Values) -> Drivers:
    """The same drivers with the time gaps, and the braking, that they accept when they are pressed."""
    return drivers._replace(
        time_gap=np.minimum(drivers.time_gap, (1 - urgency) * drivers.time_gap + urgency * SHORTEST_GAP),
        safe_deceleration=np.maximum(
            drivers.safe_deceleration, (1 - urgency) * drivers.safe_deceleration + urgency * HARSHEST
        ),
    )


def accepts(hasty: Drivers, speed: Values, target: Neighbours) -> Bool[np.ndarray, "S A"]:
    """Whether the gap beside is large enough for a driver who has to take it."""
    leader, follower = of(target.leader, speed), of(target.follower, speed)
    own = follow(hasty, speed, target.gap, leader)
    new = Drivers(*(of(target.follower, values) for values in hasty))._replace(time_gap=hasty.time_gap)
    behind = np.where(target.rear_gap < FREE, follow(new, follower, target.rear_gap, speed), 0.0)
    near = np.minimum(target.gap, target.rear_gap) <= hasty.minimum_gap
    return ~near & (np.minimum(own, behind) >= -hasty.safe_deceleration)


def stopping(room: Values, speed: Values, drivers: Drivers) -> Values:
    """Acceleration [m/s²] that stops ahead of the end of the lane; infinite while there is time to brake later."""
    needed = speed**2 / (2 * np.maximum(room, 0.1))
    return np.where((needed > drivers.deceleration) | (room < _AT_THE_END), -needed, np.inf)


def giving_way(drivers: Drivers, speed: Values, gap: Values, other: Values) -> Values:
    """Acceleration [m/s²] towards a gap behind somebody in another lane, no harder than comfortable."""
    return np.maximum(follow(drivers, speed, gap, other), -drivers.deceleration)
