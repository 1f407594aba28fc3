"""Where a drive is to lead: what a planning problem asks for, as wishes of the planner."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from coverdrive.arguments import finite, wholes
from coverdrive.errors import SettingError
from coverdrive.planning.rules.wish import Wish
from coverdrive.road import Road

Interval = tuple[float, float]
"""the least and the largest value"""
Curves = tuple[float, Float[np.ndarray, " R"]]
"""[m] from one place along the road to the next, and the speed [m/s] at which curves are driven at each, from 0 on"""

_SPARE, _SOONEST = 1.0, 0.1
"""[m], [s] by which one aims at the inside of a position, and that an arrival is ahead at the least"""
_INSIDE, _IN_TIME = 0.7, 0.5
"""[m/s], [s] by which one aims at the inside of a speed, and of a time"""
_STANDING, _TO_REST = 1.0, 1.0
"""[m/s] below which a speed is as good as none, and [s] before the end of a time when one aims to stand: the last bit
of speed goes slowly, as brakes are let go without a jerk, and who stands early stands in time, too"""
_LAST, _FIRMLY = 0.15, 0.5
"""[m/s] below which one brakes until one stands, and [m/s²] how hard; a plan would get slower for ever"""
_ARRIVALS, _APART = 21, 0.1
"""arrivals that are looked at, and [s] between two of them where the time is wide"""
_LONGEST = 120.0
"""[s] from the first arrival to the last that is looked at"""
_MIDDLE, _MARGIN = 0.05, 10.0
"""[m²/s⁵] cost of an arrival away from the middle of the time that is allowed, and [s] on both sides of the middle in
which times are narrow: of wider ones it is a middle part, and the wider, the more of it"""
_HARDEST = 40.0
"""[m/s²] to accelerate or brake harder makes no difference to a car"""
_RESPONSE, _CALM = 1.1, 2.3
"""[s] a planner accelerates by the difference to a speed over this time, if that is urgent, and if not"""
_SOON, _GENTLE = 3.0, 0.4
"""[s] before the arrival from which on, and [m/s²] of acceleration from which on it is urgent"""
_BEFORE_END = 4.0
"""[m] the centre of a car stays so far before the end of the map, where no position is asked for"""
_UNTURNED = 0.02
"""[rad] by which one aims at the inside of a heading"""
_STEEPEST = 0.2
"""[rad] to the road that a lane change takes at the most; another heading is that of another road"""
_OVER, _AT = 0.8, 0.4
"""[m] to the edge of a lane from the centre of who is over it, and to a place across the road from who is there"""
_TINY = 1e-3
"""[m] of a way that is divided by"""
_FASTEST, _HALVED = 60.0, 12
"""[m/s] that nobody drives between curves, and how often the speeds up to that are halved to find one"""
_ACROSS, _LAG = 3.0, 0.95
"""[s] before the arrival when one begins to move across the road with a heading, and by which a planner to whom it is
urgent is behind a place that moves"""


@dataclass(frozen=True)
class Goal:
    """Lanes, a place, a speed and a time, each if it matters; wishes, which come after safety."""

    lanes: int | tuple[int, ...] = ()
    """the lane to be in, or several of which any will do, counted from the right edge of the road from 0"""
    position: Interval | None = None
    """[m] lon of the ego's centre"""
    lat: float | None = None
    """[m] where in the lanes; None: in their middle"""
    speed: Interval | None = None
    """[m/s]"""
    heading: Interval | None = None
    """[rad] relative to the road, in which one is to arrive at the position"""
    time: Interval | None = None
    """[s] since the driver's reset at which the position is to be reached, or any one before the end of the road"""

    def __post_init__(self) -> None:
        """Refuse what nobody can reach."""
        for name in ("position", "speed", "heading", "time"):
            interval = getattr(self, name)
            if interval is not None and not _is_interval(interval):
                raise SettingError(f"the {name} of a goal is {interval}; expected its least and its largest value")
        if np.size(self.lanes):
            wholes("the lanes of a goal", self.lanes)
        if self.time is not None and not np.isfinite(self.time[0]):
            raise SettingError(f"the time of a goal is {self.time}; expected one that begins")
        if self.lat is not None:
            finite("the lat of a goal", self.lat)

    @property
    def any_lane(self) -> tuple[int, ...]:
        """The lanes, any of which will do."""
        return tuple(np.atleast_1d(np.asarray(self.lanes, dtype=int)).tolist())

    @property
    def turn(self) -> float:
        """[rad] to the road in which one arrives: as little as the heading allows."""
        if self.heading is None:
            return 0.0
        low, high = self.heading
        inside = min((high - low) / 4, _UNTURNED)
        return float(np.clip(0.0, low + inside, high - inside))

    def wish(
        self, state: Float[np.ndarray, " 4"], road: Road, time: float, usual: float, curves: Curves | None = None
    ) -> Wish:
        """What a planner is to aim at now.

        Args:
            state: of the ego in the road frame.
            road: that it drives on.
            time: [s] since the reset.
            usual: [m/s] wanted speed where nothing else is asked for.
            curves: at which speeds the road's are driven; None: they slow nobody down.

        Raises:
            SettingError: there is no such lane on this road.
        """
        lanes = self.any_lane
        if any(not 0 <= lane < road.lanes for lane in lanes):
            raise SettingError(f"the goal names the lanes {lanes}; expected some of 0 to {road.lanes - 1}")
        usual = min(usual, road.speed_limit or usual)
        speed = usual if self.speed is None else float(np.clip(usual, *self.speed))
        wish = Wish(speed, lanes, self.lat)
        if self.time is None:
            return wish
        last = max(float(road.length) - _BEFORE_END, float(state[0]))
        if self.position is None:
            if self.speed is None and state[0] + (state[2] + speed) / 2 * (self.time[0] - time) <= last:
                return wish
            return self._hurrying(wish, state, *self._on_the_way(state, time, speed, (-np.inf, last), curves))
        nearest, farthest = self.position
        if state[0] > farthest or (time >= self.time[1] and state[0] >= nearest):
            return wish
        position = nearest, max(nearest, min(farthest, last))
        needed, left = self._on_the_way(state, time, speed, position, curves)
        away = not self._inside(state, road)
        wish = self._hurrying(wish, state, needed, left, away)
        return self._turned(wish, state, road, left)

    def firmly(self, state: Float[np.ndarray, " 4"], road: Road, period: float) -> float:
        """[m/s²] at which one brakes at the least until the next plan, some time [s] later: where the goal is met by
        standing.
        """
        first, last = (-np.inf, np.inf) if self.position is None else self.position
        waits = self.time is not None and self.speed is not None and self.speed[0] <= 0 and self._stands
        there = waits and first <= state[0] <= last and 0 < state[2] < _LAST and self._inside(state, road)
        return min(_FIRMLY, float(state[2]) / period) if there else 0.0

    def _inside(self, state: Float[np.ndarray, " 4"], road: Road) -> bool:
        """Whether one is in a lane of the goal and not over its edge, or at the place in it."""
        lane, edges, lanes = int(road.lane_at(state[0], state[1])), road.edges_at(state[0]), self.any_lane
        right, left = state[1] - edges[lane], edges[lane + 1] - state[1]
        whole = (right >= _OVER or lane - 1 in lanes) and (left >= _OVER or lane + 1 in lanes)
        there = self.lat is not None and abs(state[1] - self.lat) <= _AT
        return not lanes or (lane in lanes and bool(whole or there))

    def _turned(self, wish: Wish, state: Float[np.ndarray, " 4"], road: Road, left: float) -> Wish:
        """The wish with a place that moves across the road as one does who arrives with the heading in some time [s].

        Until it is time the lane is kept from which that leads to the goal.
        """
        if self.position is None or not wish.lanes or not 0 < abs(self.turn) <= _STEEPEST:
            return wish
        sideways = float(state[2]) * np.sin(self.turn)
        middle = float(np.mean(self.position))
        edges, own = road.edges_at(middle), int(road.lane_at(state[0], state[1]))
        lane = min(self.any_lane, key=lambda each: abs(each - own))
        centre = float(edges[lane] + edges[lane + 1]) / 2
        place, before = centre if self.lat is None else self.lat, lane - int(np.sign(sideways))
        if left <= _ACROSS:
            return replace(wish, lanes=(lane,), lat=place + sideways * (_LAG - left))
        coming = (place - centre) * sideways < 0 and 0 <= before < road.lanes and road.has_lane(middle)[before]
        return replace(wish, lanes=(before if coming else lane,), lat=None if coming else place)

    def _on_the_way(
        self, state: Float[np.ndarray, " 4"], time: float, usual: float, position: Interval, curves: Curves | None
    ) -> tuple[float, float]:
        """Acceleration [m/s²] now to be at a position in time and at an allowed speed, on the gentlest way; and the
        time [s] until then.

        Of the arrivals within the time, each of which has an acceleration that is linear in time and costs its integral
        of squares, the cheapest, and rather one in the middle than at the ends. Who would drive backwards so stands in
        between instead. What curves on the way take longer is made up for between them.
        """
        assert self.time is not None
        nearest, farthest = position
        spare = min((farthest - nearest) / 2, _SPARE)
        slowest, fastest = self.speed or (0.0, np.inf)
        inside = _TO_REST if self._stands else min((self.time[1] - self.time[0]) / 4, _IN_TIME)
        end = min(self.time[1] - time, max(self.time[0] - time, 0.0) + _LONGEST)
        latest = max(end - inside, end / 2, _SOONEST)
        soonest = min(max(self.time[0] - time + inside, _SOONEST), latest)
        wide = (latest - soonest) / 2
        arrivals = _ARRIVALS if wide <= _MARGIN else round(2 * wide / _APART)
        arrival, speed = np.linspace(soonest, latest, arrivals), float(state[2])
        inside = min((fastest - slowest) / 4, _INSIDE)
        slowest, fastest = slowest + inside, fastest - inside
        freely = arrival * (speed + np.clip(usual, slowest, fastest)) / 2
        way = np.clip(freely, nearest + spare - state[0], farthest - spare - state[0])
        mean = np.maximum(way / arrival, 0.0)
        if curves is not None:
            mean = _between_curves(mean, way, float(state[0]), curves)
        last = np.clip(speed + 2 * (mean - speed) - (mean - speed) / 2 * (way != freely), slowest, fastest)
        first = (6 * mean - 4 * speed - 2 * last) / arrival
        change = 2 * (last - speed) / arrival - 2 * first
        cost = arrival * (first**2 + first * change + change**2 / 3)
        waits = (change > -first) & (first < 0) & (first**2 * arrival > 2 * change * speed)
        first[waits], cost[waits] = _with_rest(max(speed, 0.0), last[waits], np.maximum(way, (way + spare) / 2)[waits])
        beyond = np.maximum(np.abs(arrival - arrival.mean()) - max(0.0, wide - _MARGIN**2 / max(wide, _MARGIN)), 0.0)
        best = int(np.argmin(cost + _MIDDLE * beyond**2))
        return float(np.clip(first[best], -_HARDEST, _HARDEST)), float(arrival[best])

    def _hurrying(
        self, wish: Wish, state: Float[np.ndarray, " 4"], needed: float, left: float, away: bool = False
    ) -> Wish:
        """The wish with the speed [m/s] to which one accelerates as is needed, below 0 where one has to brake hard.

        It is urgent where that is not gentle [m/s²], not much time is left [s], or one is away from the lane.
        """
        urgent = bool(left < _SOON or abs(needed) > _GENTLE or away)
        speed = float(state[2]) + needed * (_RESPONSE if urgent else _CALM)
        return replace(wish, speed=speed, braking=max(0.0, -needed) if self._stands else 0.0, urgent=urgent)

    @property
    def _stands(self) -> bool:
        """Whether one is to stand in the end."""
        return self.speed is not None and self.speed[1] < _STANDING


def _is_interval(values: Any) -> bool:
    try:
        least, largest = values
        return bool(least <= largest and least < np.inf and largest > -np.inf)
    except (TypeError, ValueError):
        return False


def _between_curves(
    mean: Float[np.ndarray, " n"], way: Float[np.ndarray, " n"], lon: float, curves: Curves
) -> Float[np.ndarray, " n"]:
    """Speeds [m/s] that lead as far as mean ones [m/s], 0 or more, on ways [m] from lon [m] on with slower curves."""
    spacing, speeds = curves
    first = min(int(max(lon, 0.0) / spacing), len(speeds) - 1)
    ahead = speeds[first : max(first + 1, int(np.ceil((lon + float(way.max())) / spacing)))]
    if float(ahead.min()) >= float(mean.max()):
        return mean
    behind = np.arange(1, len(ahead) + 1) * spacing <= np.maximum(way, spacing)[:, None]  # rows of the way

    def seconds(speed: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        return (spacing / np.minimum(ahead, np.maximum(speed, _TINY)[:, None]) * behind).sum(axis=1)

    slow, fast = mean.copy(), np.maximum(mean, _FASTEST)
    asked = behind.sum(axis=1) * spacing / np.maximum(mean, _TINY)
    for _ in range(_HALVED):
        middle = (slow + fast) / 2
        late = seconds(middle) > asked
        slow, fast = np.where(late, middle, slow), np.where(late, fast, middle)
    return slow


def _with_rest(
    speed: float, last: Float[np.ndarray, " n"], way: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Acceleration [m/s²] now, and cost, of who comes to rest and drives off later to come some way [m] on the whole.

    Of all ways from a speed to a last one [m/s], these have the least integral of the square of an acceleration that is
    linear in time until one stands, and from then on again.
    """
    speeds = speed**1.5 + np.maximum(last, 0.0) ** 1.5
    way = np.maximum(way, _TINY)
    return -2 * np.sqrt(speed) * speeds / (3 * way), 4 * speeds**2 / (9 * way)
