"""Agents: whoever says what to do in a scene, without paths to plan against, drives in every world as planners do.

Three keep a car on a road for comparison: at constant speed, or behind the leader by IDM, in the lane of the start; and
by IDM and MOBIL, as the drivers of our traffic do, with what these see and nothing else.
"""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from coverdrive.errors import blaming
from coverdrive.geometry import turned_half_extents
from coverdrive.league.beliefs import ConstantVelocity
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Status
from coverdrive.planning.planner import PlannerSettings
from coverdrive.planning.problem.constants import vehicle_of
from coverdrive.planning.problem.vehicle import VehicleSettings, allowed, step
from coverdrive.planning.solver.manoeuvres import lane_seeking
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.drivers.freeway import DECISION, PAUSE, Freeway
from coverdrive.simulation.drivers.idm_mobil import FREE, Drivers, DriverSettings, follow
from coverdrive.simulation.roads.course import Course
from coverdrive.simulation.roads.initial import EGO

_HARDEST, _FASTEST = -8.0, 3.0
"""[m/s²] of those who keep their lane"""
_HURRY = 0.5
"""times faster than in comfort that `IdmMobil` steers to its lane: a lane change takes some 5 s"""
_ARRIVED = 0.9
"""share of the way to a lane at which it is reached"""


@runtime_checkable
class Agent(Protocol):
    """Drives a car that it sees from above, the ego in slot 0 of the scene."""

    def reset(self, period: float) -> None:
        """Forget the last drive; the next one asks every ``period`` [s]."""
        ...

    def act(self, scene: Scene, road: Road) -> tuple[float, float]:
        """Acceleration [m/s²] and yaw rate [rad/s] in the frame of the road until the next call."""
        ...


class Witness:
    """Believes that everybody keeps the velocity, and remembers what it saw last."""

    fingerprint = ConstantVelocity().fingerprint

    def predict(self, scene: Scene, road: Road, ego: int, dt: float, steps: int) -> PredictedPaths:
        """As the constant velocities of bodies."""
        self.scene = scene
        return ConstantVelocity().predict(scene, road, ego, dt, steps)


class AgentPlanner:
    """An agent as a planner: what it does now, held for the whole horizon, without knowing of any path.

    What is driven is the nearest to it that the limits of the car allow, as in the environment of Gymnasium.
    """

    dt, steps = 0.25, 12

    def __init__(self, agent: Agent, witness: Witness, vehicle: VehicleSettings | None = None):
        """Show an agent what the witness sees, which has to be the belief that it drives with."""
        self.agent, self.vehicle, self._witness = agent, vehicle or VehicleSettings(), witness

    def reset(self, period: float) -> None:
        """`Agent.reset`."""
        self._period, self._before = period, (0.0, 0.0)
        with blaming("agent", self.agent):
            self.agent.reset(period)

    def plan(self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> Plan:
        """What the agent does in the scene that was seen last."""
        with blaming("agent", self.agent):
            acceleration, yaw_rate = self.agent.act(self._witness.scene, road)
            wish = float(acceleration), float(yaw_rate)
            if not np.isfinite(wish).all():
                raise ValueError(f"expected an acceleration [m/s²] and a yaw rate [rad/s], got {wish}")
        self._before = allowed(state, wish, self._before, self._period, road, vehicle_of(self.vehicle))
        inputs, states = np.tile(self._before, (self.steps, 1)), [state]
        for acceleration, yaw_rate in inputs:
            held = max(acceleration, -states[-1][2] / self.dt), yaw_rate  # until it stands
            states.append(step(states[-1], np.array(held), self.dt))
        return Plan(np.array(states), inputs, np.zeros(self.steps), Status.INVALID_INPUT, 0.0, 0.0, self.dt)


class KeepVelocity:
    """Steers to the centre of the lane that it starts in; implements `coverdrive.league.agents.Agent`."""

    def reset(self, period: float) -> None:
        """Forget the lane."""
        self._lane: int | None = None

    def act(self, scene: Scene, road: Road) -> tuple[float, float]:
        """Keep the speed and the lane."""
        lon, lat, speed, heading = scene.states[EGO].tolist()
        if self._lane is None:
            self._lane = int(road.lane_at(lon, lat))
        centre = _centre(road, lon, self._lane)
        return self._acceleration(scene, road), float(lane_seeking(lat, speed, heading, centre, 1.0))

    def _acceleration(self, scene: Scene, road: Road) -> float:
        return 0.0


class Idm(KeepVelocity):
    """The same with the Intelligent Driver Model of a usual driver behind the nearest vehicle in the lane.

    It wants the 30 m/s of `coverdrive.simulation.drivers.idm_mobil.DriverSettings` wherever it is: who wants no more
    than the speed of the start is run into where traffic gets faster.
    """

    def __init__(self):
        """Drive as everybody does on average."""
        usual = DriverSettings()
        self._driver = Drivers(*(np.array([getattr(usual, name)]) for name in Drivers._fields))

    def _acceleration(self, scene: Scene, road: Road) -> float:
        lon, lat, speed, heading = scene.states.T
        lane = road.lane_at(lon, lat)
        ahead = np.flatnonzero(scene.valid & (lane == lane[EGO]) & (lon > lon[EGO]))
        gap, leading = FREE, 0.0
        if len(ahead):
            leader = ahead[np.argmin(lon[ahead])]
            gap = float(lon[leader] - lon[EGO] - scene.half_sizes[[leader, EGO], 0].sum())
            leading = float(speed[leader] * np.cos(heading[leader]))
        wanted = follow(self._driver, speed[[EGO]], np.array([gap]), np.array([leading]))
        return float(np.clip(wanted[0], _HARDEST, _FASTEST))


class IdmMobil:
    """A usual driver, who takes all others for such; implements `Agent`."""

    def __init__(self, settings: PlannerSettings):
        """Drive at the reference speed of a planner."""
        self._driver = DriverSettings(desired_speed=settings.problem.cost.reference_speed)
        self.reset(0.1)

    def reset(self, period: float) -> None:
        """Forget the last drive."""
        self._period, self._course = period, None
        self._until_decision = self._wait = 0.0

    def act(self, scene: Scene, road: Road) -> tuple[float, float]:
        """Follow the vehicle ahead, or begin a lane change, and steer to the lane that is aimed at."""
        lon, lat, speed, heading = scene.states[EGO].tolist()
        if self._course is None or self._course.road is not road:
            self._course = Course(road)
            self._lane = self._target = int(road.lane_at(lon, lat))
        decides = self._until_decision <= 0
        freeway = self._freeway(scene, road, self._course, decides)
        if decides:
            freeway.change_lanes()
            self._target, self._until_decision = int(freeway.target[0, EGO]), DECISION
        self._until_decision -= self._period
        freeway.advance(self._period)
        acceleration = (float(freeway.speed[0, EGO]) - speed * np.cos(heading)) / self._period
        centre = _centre(road, lon, self._target)
        return acceleration, float(lane_seeking(lat, speed, heading, centre, _HURRY))

    def _freeway(self, scene: Scene, road: Road, course: Course, decides: bool) -> Freeway:
        """The scene as the driver sees it: alone free to change lanes, all others are in those that they touch.

        A lane change that has only begun is thought over by a driver who ``decides``.
        """
        shape, states = (1, scene.vehicles), scene.states
        usual = {name: np.full(shape, getattr(self._driver, name)) for name in Drivers._fields}
        aside = turned_half_extents(scene.half_sizes, states[:, 3])[:, 1]
        right, left = (road.lane_at(states[:, 0], states[:, 1] + side * aside) for side in (-1, 1))
        if decides and right[EGO] == left[EGO] == self._lane:
            self._target = self._lane
        freeway = Freeway(
            course=course,
            drivers=Drivers(**usual),
            moody=np.zeros(shape, dtype=bool),
            length=np.array(scene.length)[None],
            width=np.array(scene.width)[None],
            valid=np.array(scene.valid)[None],
            lon=states[None, :, 0],
            speed=(states[:, 2] * np.cos(states[:, 3]))[None],
            lane=right[None],
            change_duration=np.ones(shape),  # of no account: it begins anew in every step
            wander=np.tile([0.0, 1.0, 0.0], (*shape, 1)),
        )
        freeway.target[0] = left
        freeway.wait[:] = np.inf
        self._arrive(float(states[EGO, 0]), float(states[EGO, 1]), road)
        freeway.lane[0, EGO], freeway.target[0, EGO] = self._lane, self._target
        freeway.wait[0, EGO] = self._wait
        return freeway

    def _arrive(self, lon: float, lat: float, road: Road) -> None:
        """Tell a lane change that is over."""
        self._wait = max(0.0, self._wait - self._period)
        if self._lane != self._target:
            begun, aimed = (_centre(road, lon, lane) for lane in (self._lane, self._target))
            if (lat - begun) / (aimed - begun) >= _ARRIVED:
                self._lane, self._wait = self._target, PAUSE


def _centre(road: Road, lon: float, lane: int) -> float:
    """[m] of a lane there."""
    edges = road.edges_at(lon)
    return float(edges[lane] + edges[lane + 1]) / 2
