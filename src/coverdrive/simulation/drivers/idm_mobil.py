"""Human drivers: car following by IDM, lane changes by MOBIL.

The Intelligent Driver Model (Treiber, Hennecke & Helbing, *Congested traffic states in empirical observations and
microscopic simulations*, 2000) gives the acceleration behind a leader; MOBIL (Kesting, Treiber & Helbing, *General
lane-changing model MOBIL for car-following models*, 2007) weighs the accelerations that a lane change brings for the
driver and for the vehicles behind. Everything is vectorised over vehicles (A) and any leading axes; a lane change to
the left and to the right are the same code.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from pydantic import Field

from coverdrive.compiled import compiled, lent
from coverdrive.settings import Settings

Values = Float[np.ndarray, "*batch A"]

FREE = 1e6
"""[m] gap to a leader that does not exist"""
TRUCK_LENGTH = 8.0
"""[m] from which a vehicle is taken for a truck or a bus"""
TRUCK_PACE = 0.8
"""times the speed that a car wants: 80 to 90 km/h where cars drive 100 to 110"""


class DriverSettings(Settings):
    """A usual driver, and how far drivers differ from it."""

    desired_speed: float = Field(default=30.0, gt=0, le=120)
    """[m/s] on the free road; 108 km/h"""
    time_gap: float = Field(default=1.4, gt=0, le=20)
    """[s] time gap to the leader (Kesting, Treiber & Helbing 2010: 1.0 to 1.5 s)"""
    minimum_gap: float = Field(default=2.0, gt=0, le=100)
    """[m] bumper to bumper at standstill (Treiber et al. 2000)"""
    acceleration: float = Field(default=1.4, gt=0, le=4)
    """[m/s²] largest acceleration (Kesting et al. 2010)"""
    deceleration: float = Field(default=2.0, gt=0, le=15)
    """[m/s²] comfortable deceleration (Kesting et al. 2010)"""
    politeness: float = Field(default=0.3, ge=0, le=10)
    """weight of the accelerations of the vehicles behind (Kesting et al. 2007: 0 to 0.5 is realistic)"""
    threshold: float = Field(default=0.1, ge=0, le=15)
    """[m/s²] advantage below which no driver changes lanes (Kesting et al. 2007)"""
    safe_deceleration: float = Field(default=4.0, gt=0, le=15)
    """[m/s²] hardest braking that a lane change may demand of the new follower (Kesting et al. 2007)"""
    spread: float = Field(default=0.12, ge=0, lt=0.3)
    """relative standard deviation of the drivers' desired speed and time gap, cut off at two of them"""


@lent
class Drivers(NamedTuple):
    """What each driver wants and accepts, in the units of `DriverSettings`."""

    desired_speed: Values
    time_gap: Values
    minimum_gap: Values
    acceleration: Values
    deceleration: Values
    politeness: Values
    threshold: Values
    safe_deceleration: Values


def of(slot: Int[np.ndarray, "*batch A"], values: Values) -> Values:
    """The values of the vehicles in other slots of the same scene."""
    scenes = values.reshape(-1, values.shape[-1])
    return scenes[np.arange(len(scenes))[:, None], slot.reshape(scenes.shape)].reshape(slot.shape)


def draw_drivers(settings: DriverSettings, random: np.random.Generator, shape: tuple[int, ...]) -> Drivers:
    """Mixed drivers: desired speed and time gap are spread around the usual ones, politeness up to twice it."""
    desired, gap = 1 + settings.spread * np.clip(random.standard_normal((2, *shape)), -2, 2)
    return Drivers(
        desired_speed=settings.desired_speed * desired,
        time_gap=settings.time_gap * gap,
        minimum_gap=np.full(shape, settings.minimum_gap),
        acceleration=settings.acceleration * random.uniform(0.8, 1.2, shape),
        deceleration=np.full(shape, settings.deceleration),
        politeness=settings.politeness * random.uniform(0, 2, shape),
        threshold=np.full(shape, settings.threshold),
        safe_deceleration=np.full(shape, settings.safe_deceleration),
    )


def follow(drivers: Drivers, speed: Values, gap: Values, leader_speed: Values) -> Values:
    """Acceleration [m/s²] of the Intelligent Driver Model (Treiber et al. 2000, eqs. 2 and 3, exponent 4).

    The gap [m] is from bumper to bumper, where overlaps count as 0.1 m; without a leader it is `FREE`, and
    ``leader_speed`` arbitrary.
    """
    result = np.empty(speed.size)
    flat, free = Drivers(*(each.ravel() for each in drivers)), free_road(drivers, speed).ravel()
    _write_following(flat, free, speed.ravel(), gap.ravel(), leader_speed.ravel(), result)
    return result.reshape(speed.shape)


def free_road(drivers: Drivers, speed: Values) -> Values:
    """Acceleration [m/s²] without a leader.

    A driver above the desired speed slows down no harder than comfortably, as in the improved model (Treiber &
    Kesting, *Traffic Flow Dynamics*, 2013, eq. 11.22); below it this is the original model.
    """
    ratio = speed / drivers.desired_speed
    free = drivers.acceleration * (1 - ratio**4)
    if not (faster := ratio > 1).any():
        return free
    exponent = 4 * drivers.acceleration / drivers.deceleration
    return np.where(faster, -drivers.deceleration * (1 - np.maximum(ratio, 1.0) ** -exponent), free)


@compiled
def _write_following(
    drivers: Drivers, free: Float[np.ndarray, " n"], speed: Float[np.ndarray, " n"], gap: Float[np.ndarray, " n"],
    leader_speed: Float[np.ndarray, " n"], result: Float[np.ndarray, " n"],
) -> None:  # fmt: skip
    """Write `_following` of each driver."""
    for i in range(len(result)):
        result[i] = _following(drivers, i, free[i], speed[i], gap[i], leader_speed[i])


@compiled
def _following(drivers: Drivers, i: Any, free: float, speed: float, gap: float, leader_speed: float) -> float:
    """What the leader leaves to a driver of the acceleration [m/s²] on the free road."""
    if gap >= FREE:
        return free
    acceleration = drivers.acceleration[i]
    brake = 2 * np.sqrt(acceleration * drivers.deceleration[i])
    dynamic = speed * drivers.time_gap[i] + speed * (speed - leader_speed) / brake
    interaction = (drivers.minimum_gap[i] + max(0.0, dynamic)) / max(gap, 0.1)
    return float(free - acceleration * (interaction * interaction))


@lent
class Neighbours(NamedTuple):
    """Slots of the vehicles ahead and behind in some lane, arbitrary where there is none.

    The gaps [m] to them are from bumper to bumper, negative when overlapping, and `FREE` where there is none.
    """

    leader: Int[np.ndarray, "*batch A"]
    gap: Values
    follower: Int[np.ndarray, "*batch A"]
    rear_gap: Values


def neighbours(lon: Values, length: Values, there: Bool[np.ndarray, "*batch A A"]) -> Neighbours:
    """The nearest vehicles ahead and behind; of two at the same place the one in the higher slot is ahead.

    ``there`` says whether vehicle j (last axis) is in the lane that vehicle i looks at; itself is never looked at.
    """
    shape, slots = lon.shape, lon.shape[-1]
    found, gaps = np.zeros((2, *shape), dtype=np.int64), np.full((2, *shape), FREE)
    lons, lengths = (np.ascontiguousarray(each).reshape(-1, slots) for each in (lon, length))
    looked_at = np.ascontiguousarray(there).reshape(-1, slots, slots)
    _write_nearest(lons, lengths, looked_at, found.reshape(2, -1, slots), gaps.reshape(2, -1, slots))
    return Neighbours(found[0], gaps[0], found[1], gaps[1])


@compiled
def _write_nearest(
    lon: Float[np.ndarray, "S A"], length: Float[np.ndarray, "S A"], there: Bool[np.ndarray, "S A A"],
    found: Int[np.ndarray, "2 S A"], gaps: Float[np.ndarray, "2 S A"],
) -> None:  # fmt: skip
    """Write the nearest vehicles ahead (0) and behind (1), of equally near ones the first, and the gaps to them."""
    for scene in range(len(lon)):
        for i in range(lon.shape[1]):
            nearest_ahead = nearest_behind = np.inf
            for j in range(lon.shape[1]):
                if j == i or not there[scene, i, j]:
                    continue
                distance = lon[scene, j] - lon[scene, i]
                bumper = (length[scene, j] + length[scene, i]) / 2
                if distance > 0 or (distance == 0 and j > i):
                    if distance < nearest_ahead:
                        nearest_ahead, found[0, scene, i], gaps[0, scene, i] = distance, j, distance - bumper
                elif -distance < nearest_behind:
                    nearest_behind, found[1, scene, i], gaps[1, scene, i] = -distance, j, -distance - bumper


def lane_change_advantage(
    drivers: Drivers, speed: Values, length: Values, current: Neighbours, target: Neighbours
) -> Values:
    """Advantage [m/s²] of changing from the current to the target lane by MOBIL; −inf where the change is unsafe.

    A driver changes lanes when the advantage is positive: own gain plus politeness times the gain of the new and
    the old follower, less the threshold (Kesting et al. 2007, eqs. 2 and 3, symmetric rules).
    """
    scenes = -1, speed.shape[-1]
    result = np.empty(speed.size).reshape(scenes)
    free, own, long = (each.reshape(scenes) for each in (free_road(drivers, speed), speed, length))
    now, then = (Neighbours(*(each.reshape(scenes) for each in lane)) for lane in (current, target))
    _write_advantage(Drivers(*(each.reshape(scenes) for each in drivers)), free, own, long, now, then, result)
    return result.reshape(speed.shape)


@compiled
def _write_advantage(
    drivers: Drivers, free: Float[np.ndarray, "S A"], speed: Float[np.ndarray, "S A"], length: Float[np.ndarray, "S A"],
    current: Neighbours, target: Neighbours, result: Float[np.ndarray, "S A"],
) -> None:  # fmt: skip
    """Write the advantage of each driver."""
    for s in range(len(result)):
        for i in range(result.shape[1]):
            at, gap, rear_gap = (s, i), target.gap[s, i], target.rear_gap[s, i]
            own_after = _following(drivers, at, free[at], speed[at], gap, speed[s, target.leader[at]])
            own_gain = own_after - _following(
                drivers, at, free[at], speed[at], current.gap[at], speed[s, current.leader[at]]
            )
            safe = own_after >= -drivers.safe_deceleration[at]
            safe &= gap > drivers.minimum_gap[at] and rear_gap > drivers.minimum_gap[at]
            new_gain = old_gain = 0.0
            if rear_gap < FREE:
                new = s, target.follower[at]
                new_after = _following(drivers, new, free[new], speed[new], rear_gap, speed[at])
                joined = _joined(gap, rear_gap, length[at])
                before = _following(drivers, new, free[new], speed[new], joined, speed[s, target.leader[at]])
                new_gain = new_after - before
                safe &= new_after >= -drivers.safe_deceleration[new]
            if current.rear_gap[at] < FREE:
                old = s, current.follower[at]
                joined = _joined(current.gap[at], current.rear_gap[at], length[at])
                old_after = _following(drivers, old, free[old], speed[old], joined, speed[s, current.leader[at]])
                old_gain = old_after - _following(drivers, old, free[old], speed[old], current.rear_gap[at], speed[at])
            gain = own_gain + drivers.politeness[at] * (new_gain + old_gain) - drivers.threshold[at]
            result[at] = gain if safe else -np.inf


@compiled
def _joined(gap: float, rear_gap: float, length: float) -> float:
    """The gap [m] between the vehicles ahead and behind once the one between them is gone."""
    return gap + rear_gap + length if gap < FREE and rear_gap < FREE else FREE
