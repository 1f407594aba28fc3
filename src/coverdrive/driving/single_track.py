"""The car that drives in a CommonRoad scenario: a BMW 320i, as two of the CommonRoad vehicle models.

KS is the kinematic single-track model, whose tyres do not slip, ST the single-track model, in which they do (Althoff,
Koschi & Manzinger, *CommonRoad: Composable benchmarks for motion planning on roads*, 2017). Inputs of both are the rate
of the steering angle and the acceleration, held for a time step. The position of a CommonRoad state is the centre of
gravity, which is taken for that of the body; that of KS is the middle of the rear axle, ``b`` behind it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from commonroad.common.solution import VehicleModel, VehicleType
from commonroad.scenario.state import KSState, STState
from jaxtyping import Float
from vehiclemodels.parameters_vehicle2 import parameters_vehicle2
from vehiclemodels.vehicle_dynamics_ks import vehicle_dynamics_ks
from vehiclemodels.vehicle_dynamics_st import vehicle_dynamics_st

ModelName = Literal["KS", "ST"]

BMW: Any = parameters_vehicle2()
"""parameters of vehicle 2 of `commonroad-vehicle-models`"""
VEHICLE = VehicleType.BMW_320i

_DYNAMICS: dict[ModelName, Callable[..., list[float]]] = {"KS": vehicle_dynamics_ks, "ST": vehicle_dynamics_st}
_SUBSTEP, _FINE = 0.005, 0.001
"""[s] of Runge and Kutta's method, and where tyres slip at a low speed: what they do then dies away within so short a
time that longer steps make it grow"""
_SLOW = 0.5
"""[m/s] of such a speed"""
_ROUNDING = 1e-9
"""[m/s] that are none"""
_SHORT, _FARTHER = 0.22, 0.75
"""[s] in longer periods the wheels, which turn evenly until the end, turn farther by this share of their way: with all
of it they would have the angle in the mean, but swing to and fro from one period to the next"""


@dataclass(frozen=True, eq=False)
class SingleTrackCar:
    """The car at one moment."""

    model: ModelName
    values: Float[np.ndarray, " n"]
    """x, y [m] of the reference point, steering angle [rad], speed [m/s], heading [rad], and for ST yaw rate [rad/s]
    and slip angle [rad]"""

    @staticmethod
    def at(initial: Any, model: ModelName) -> "SingleTrackCar":
        """The car in the initial state of a planning problem, its wheels straight."""
        heading, back = float(initial.orientation), BMW.b if model == "KS" else 0.0
        place = np.asarray(initial.position) - back * np.array([np.cos(heading), np.sin(heading)])
        more = [] if model == "KS" else [float(getattr(initial, name, 0.0)) for name in ("yaw_rate", "slip_angle")]
        return SingleTrackCar(model, np.array([*place, 0.0, float(initial.velocity), heading, *more]))

    @property
    def pose(self) -> Float[np.ndarray, " 4"]:
        """x [m], y [m], speed [m/s], heading [rad] of the centre, as a `coverdrive.driving.driver.Driver` takes it."""
        x, y, _, speed, heading = self.values[:5]
        ahead = BMW.b if self.model == "KS" else 0.0
        return np.array([x + ahead * np.cos(heading), y + ahead * np.sin(heading), speed, heading])

    def moved(self, acceleration: float, steering: float, period: float) -> "SingleTrackCar":
        """The car one period [s] later, its wheels turned towards an angle [rad] as fast as they can, and evenly."""
        fastest = BMW.steering.v_max * (1 - 1e-6)
        if period > _SHORT:
            steering += _FARTHER * (steering - self.values[2])
        rate = float(np.clip((steering - self.values[2]) / period, -fastest, fastest))
        acceleration = max(acceleration, -self.values[3] / period)
        slow = self.model == "ST" and min(self.values[3], self.values[3] + acceleration * period) < _SLOW
        steps, dynamics = max(1, round(period / (_FINE if slow else _SUBSTEP))), _DYNAMICS[self.model]
        dt, values, inputs = period / steps, self.values, [rate, acceleration]

        def slope(at: np.ndarray) -> np.ndarray:
            return np.array(dynamics(at.tolist(), inputs, BMW))

        for _ in range(steps):
            first = slope(values)
            second = slope(values + dt / 2 * first)
            third = slope(values + dt / 2 * second)
            values = values + dt / 6 * (first + 2 * second + 2 * third + slope(values + dt * third))
        values[3] = 0.0 if abs(values[3]) < _ROUNDING else values[3]
        return SingleTrackCar(self.model, values)

    def state(self, moment: int) -> Any:
        """As a state of a CommonRoad solution, at a time step."""
        x, y, speed, heading = self.pose
        known = {"velocity": speed, "orientation": heading, "steering_angle": self.values[2]}
        if self.model == "KS":
            return KSState(moment, np.array([x, y]), **known)
        more = {"yaw_rate": self.values[5], "slip_angle": self.values[6]}
        return STState(moment, np.array([x, y]), **known, **more)

    @property
    def vehicle_model(self) -> VehicleModel:
        """Its name in a CommonRoad solution."""
        return VehicleModel[self.model]
