"""IDM and MOBIL at the wheel of the ego: the drivers of our traffic, with what they see and nothing else."""

import numpy as np

from coverdrive.geometry import turned_half_extents
from coverdrive.planning.planner import PlannerSettings
from coverdrive.planning.search import lane_seeking
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.course import Course
from coverdrive.simulation.drivers import Drivers, DriverSettings
from coverdrive.simulation.freeway import DECISION, PAUSE, Freeway
from coverdrive.simulation.initial import EGO

_HURRY = 0.5
"""times faster than in comfort that it steers to its lane: a lane change takes some 5 s"""
_ARRIVED = 0.9
"""share of the way to a lane at which it is reached"""


class IdmMobil:
    """A usual driver, who takes all others for such; implements `coverdrive.league.agents.Agent`."""

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
        edges = road.edges_at(np.array([lon]))[0]
        return acceleration, float(lane_seeking(lat, speed, heading, _centre(edges, self._target), _HURRY))

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
            usual_speed=usual["desired_speed"].copy(),
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
            edges = road.edges_at(np.array([lon]))[0]
            begun, aimed = _centre(edges, self._lane), _centre(edges, self._target)
            if (lat - begun) / (aimed - begun) >= _ARRIVED:
                self._lane, self._wait = self._target, PAUSE


def _centre(edges: np.ndarray, lane: int) -> float:
    """[m] of a lane."""
    return float(edges[lane] + edges[lane + 1]) / 2
