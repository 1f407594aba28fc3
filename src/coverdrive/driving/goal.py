"""Where a drive is to lead: what a planning problem asks for, as wishes of the planner."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from coverdrive.errors import SettingError
from coverdrive.planning.wish import Wish
from coverdrive.road import Road

Interval = tuple[float, float]
"""the least and the largest value"""


@dataclass(frozen=True)
class Goal:
    """Lanes, a place, a speed and a time, each if it matters; wishes, which come after safety."""

    lanes: int | tuple[int, ...] = ()
    """the lane to be in, or several of which any will do, counted from the right edge of the road from 0"""
    position: Interval | None = None
    """[m] lon of the ego's centre"""
    speed: Interval | None = None
    """[m/s]"""
    time: Interval | None = None
    """[s] since the driver's reset at which the position is to be reached; without a position it is of no use"""

    def __post_init__(self) -> None:
        """Refuse what nobody can reach."""
        for name in ("position", "speed", "time"):
            interval = getattr(self, name)
            if interval is not None and not (len(interval) == 2 and interval[0] <= interval[1]):
                raise SettingError(f"the {name} of a goal is {interval}; expected its least and its largest value")

    def wish(self, state: Float[np.ndarray, " 4"], road: Road, time: float, usual: float) -> Wish:
        """What a planner is to aim at now.

        Args:
            state: of the ego in the road frame.
            road: that it drives on.
            time: [s] since the reset.
            usual: [m/s] wanted speed where nothing else is asked for.

        Raises:
            SettingError: there is no such lane on this road.
        """
        lanes = tuple(np.atleast_1d(np.asarray(self.lanes, dtype=int)).tolist())
        if any(not 0 <= lane < road.lanes for lane in lanes):
            raise SettingError(f"the goal names the lanes {lanes}; expected some of 0 to {road.lanes - 1}")
        speed = usual if self.speed is None else float(np.clip(usual, *self.speed))
        if self.position is not None and self.time is not None:
            nearest, farthest = self.position
            if np.isfinite(farthest - nearest):
                nearest = farthest = (nearest + farthest) / 2  # there is something to spare on both sides
            soonest, latest = (max(each - time, 0.0) for each in self.time)
            slowest = max(nearest - state[0], 0.0) / latest if latest > 0 else 0.0
            fastest = max(farthest - state[0], 0.0) / soonest if soonest > 0 else np.inf
            speed = float(np.clip(speed, slowest, fastest))
        return Wish(speed, lanes)
