"""The ego: a Dubins car with a speed (paper §4).

State: lon [m], lat [m], speed [m/s], heading [rad]. Input: acceleration [m/s²], yaw rate [rad/s], held for dt.
`moved` is the one definition of the motion, for numbers (compiled), CasADi symbols and, by `step`, NumPy arrays;
`within_limits` is that of the limits, which every plan is driven within.
"""

from typing import Any

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.compiled import compiled
from coverdrive.road import Road
from coverdrive.road_ahead import TINY, Bend, State, bent_on
from coverdrive.scene import beside
from coverdrive.settings import Settings

SLOW = 2.0
"""[m/s] below which a car goes at walking pace"""
_SLOW_HEADING = 0.6
"""[rad] largest angle between such a car and the road, if it may not have a larger one at any speed"""


class VehicleSettings(Settings):
    """Size and limits of the ego; *CommonRoad*: `commonroad-vehicle-models` 3.0.2, vehicle 2, a BMW 320i."""

    length: float = Field(default=4.8, ge=1, le=30)
    """[m] a mid-size sedan (AASHTO Green Book 2018, passenger car: 5.8 m at the most; NGSIM US-101 median: 4.6 m)"""
    width: float = Field(default=1.9, ge=0.3, le=5)
    """[m] a mid-size sedan without mirrors"""
    max_acceleration: float = Field(default=3.0, gt=0, le=15)
    """[m/s²] brisk but ordinary (CommonRoad: up to 11.5; the authors' scripts allow 2000)"""
    max_deceleration: float = Field(default=8.0, gt=0, le=15)
    """[m/s²] full braking on dry asphalt (0.8 g; UN R13-H asks for at least 6.43 m/s²)"""
    max_power: float = Field(default=84.1, gt=0, le=1e4)
    """[W/kg] bound of acceleration · speed, above 28 m/s the tighter one (CommonRoad: 11.5 m/s² up to 7.319 m/s)"""
    wheelbase: float = Field(default=2.579, gt=0, le=20)
    """[m] (CommonRoad: a + b)"""
    max_steering: float = Field(default=1.066, gt=0, lt=np.pi / 2)
    """[rad] of the wheels, to either side (CommonRoad): tan(max_steering) / wheelbase bounds the curvature"""
    max_steering_rate: float = Field(default=0.4, gt=0, le=1e4)
    """[rad/s] of the wheels (CommonRoad)"""
    max_lateral_acceleration: float = Field(default=4.0, gt=0, le=15)
    """[m/s²] bound of speed · yaw rate; own choice, half of what the tyres of `max_deceleration` give"""
    max_jerk: float = Field(default=20.0, gt=0, le=1000)
    """[m/s³] along and across, from one plan to the next that is optimised; others, taken where no optimised one is
    clear, may change at once. Own choice: 8 m/s² of braking build up in 0.4 s"""
    max_speed: float = Field(default=45.0, gt=0, le=120)
    """[m/s] a little above the reference speed of 40 m/s"""
    max_heading: float = Field(default=0.35, gt=0, lt=np.pi / 2)
    """[rad] largest angle between the car and the road; own choice, 20°, more than a lane change at speed needs"""

    @property
    def half_sizes(self) -> Float[np.ndarray, " 2"]:
        """[m] half length and half width."""
        return np.array([self.length / 2, self.width / 2])


def slow(vehicle: VehicleSettings) -> VehicleSettings:
    """The limits of a car at walking pace."""
    return vehicle.model_copy(update={"max_heading": max(vehicle.max_heading, _SLOW_HEADING)})


def moved(state: tuple[Any, Any, Any, Any], inputs: tuple[Any, Any], dt: float) -> tuple[Any, Any, Any, Any]:
    """The Dubins car (paper §4) after inputs were held for a time; its way is the mean of those at both velocities.

    The paper takes the velocity at the start (Euler), with which a car that brakes from 40 m/s in steps of 0.25 s comes
    to rest 5 m too late. This is off by less than dt³/12·|f''| in a step, f'' being the jerk that turning makes.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad].
        inputs: acceleration [m/s²], yaw rate [rad/s].
        dt: [s].

    Returns:
        The state after dt: lon [m], lat [m], speed [m/s], heading [rad].
    """
    lon, lat, speed, heading = state
    faster, turned = speed + dt * inputs[0], heading + dt * inputs[1]
    return (
        lon + dt / 2 * (speed * np.cos(heading) + faster * np.cos(turned)),
        lat + dt / 2 * (speed * np.sin(heading) + faster * np.sin(turned)),
        faster,
        turned,
    )


def step(state: Float[np.ndarray, "*n 4"], inputs: Float[np.ndarray, "*n 2"], dt: float) -> Float[np.ndarray, "*n 4"]:
    """`moved` of states (lon, lat, speed, heading) under inputs (acceleration, yaw rate) held for dt [s]."""
    lon, lat, speed, heading = (state[..., i] for i in range(4))
    return beside(*moved((lon, lat, speed, heading), (inputs[..., 0], inputs[..., 1]), dt))


@compiled
def yaw_rates(
    speed: float, acceleration: float, before: tuple[float, float], elapsed: float, bend: Bend, vehicle: Any
) -> tuple[float, float]:
    """Least and largest yaw rate [rad/s] of a step that steering allows, and where it does, the lateral acceleration.

    The wheels stand still during a step: its curvature is the yaw rate over the mean speed, and that of the step before
    is known. The angle of the wheels changes by no more than the wheelbase times what the curvature does.

    Args:
        speed: [m/s] at the start of the step.
        acceleration: [m/s²] during the step.
        before: acceleration [m/s²] and yaw rate [rad/s] of the step before.
        elapsed: [s] for which inputs are held.
        bend: of the road, with which the wheels follow it.
        vehicle: limits of the ego, as `coverdrive.planning.problem.constants.Vehicle`.
    """
    stretch, ease, follow, _ = bend
    sharpest, change, along = vehicle.sharpest, vehicle.max_steering_rate * elapsed, vehicle.wheelbase * follow
    was = vehicle.wheelbase * before[1] / (ease * max(speed - elapsed / 2 * before[0], TINY))
    was = min(max(was, -sharpest - along), sharpest - along)
    mean = ease * (max(speed + elapsed / 2 * acceleration, 0.0) / vehicle.wheelbase)
    right, left = mean * max(was - change, -sharpest - along), mean * min(was + change, sharpest - along)
    most, turn = vehicle.max_lateral_acceleration / (max(abs(speed), TINY) * stretch**2), speed * follow
    return min(max(right, ease * (-most - turn)), left), max(min(left, ease * (most - turn)), right)


@compiled
def accelerations(speed: float, bend: Bend, vehicle: Any) -> tuple[float, float]:
    """Least and largest acceleration [m/s²] along the road frame at a speed [m/s] there."""
    stretch, gain = bend[0], bend[3]
    throttle = min(vehicle.max_acceleration, vehicle.max_power / max(stretch * abs(speed), TINY))
    return (-vehicle.max_deceleration - gain) / stretch, (throttle - gain) / stretch


@compiled
def within_limits(
    state: State, wish: tuple[float, float], before: tuple[float, float], elapsed: float, dt: float, bend: Bend,
    vehicle: Any,
) -> tuple[float, float]:  # fmt: skip
    """The inputs nearest to wished ones that keep the car within its limits for one step.

    A state outside the speed or heading bounds is not pushed further out, unless the wheels cannot be turned in time.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad].
        wish: acceleration [m/s²], yaw rate [rad/s].
        before: the inputs of the step before.
        elapsed: [s] from one plan to the next, for the first step of a plan; ``dt`` for others.
        dt: [s] of the step.
        bend: of the road.
        vehicle: limits of the ego.
    """
    speed, heading = state[2], state[3]
    hardest, throttle = accelerations(speed, bend, vehicle)
    lowest = max(hardest, min(0.0, -speed / dt))
    highest = min(throttle, max(0.0, (vehicle.max_speed / bend[0] - speed) / dt))
    acceleration = min(max(wish[0], lowest), highest)
    right, left = yaw_rates(speed, acceleration, before, elapsed, bend, vehicle)
    swing = bend[1] * (vehicle.max_steering_rate / vehicle.wheelbase * max(speed + dt / 2 * acceleration, 0.0))
    least = min(max(right, -_fastest_turn(vehicle.max_heading + heading, swing, dt)), left)
    most = max(min(left, _fastest_turn(vehicle.max_heading - heading, swing, dt)), right)
    return acceleration, min(max(wish[1], least), most)


def allowed(
    state: Float[np.ndarray, " 4"], wish: tuple[float, float], before: tuple[float, float], period: float, road: Road,
    vehicle: Any,
) -> tuple[float, float]:  # fmt: skip
    """`within_limits` on a road, for one period [s] after inputs that were driven for another."""
    here: Any = tuple(state.tolist())
    if here[2] < SLOW:
        vehicle = vehicle._replace(max_heading=max(vehicle.max_heading, _SLOW_HEADING))
    bend: Any = tuple(float(np.ravel(each)[0]) for each in bent_on(state[:, None], road)[:4])
    return within_limits(here, wish, before, period, period, bend, vehicle)


@compiled
def _fastest_turn(room: float, swing: float, dt: float) -> float:
    """[rad/s] from which the wheels are straight again, at ``swing`` [rad/s²], before a heading ``room`` [rad] away."""
    room = max(room, 0.0)
    return min(room / dt, max(swing * dt, np.sqrt(2 * swing * room) - swing * dt / 2))
