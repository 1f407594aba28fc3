"""The driver: certified prediction and planning for a simulator or a car that is not ours.

It is told, once a period, the states of all vehicles in map coordinates, and answers with what the car is to do.
Between two calls it remembers who is who, the last plan, and how vehicles move whose positions alone are measured.
"""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from coverdrive.arguments import finite, of_kind, period_of
from coverdrive.driving.goal import Goal
from coverdrive.driving.perception import Numbers, Perception, Told
from coverdrive.errors import DataError, SettingError, blaming, during
from coverdrive.paths import PredictedPaths
from coverdrive.plan import Plan, Planner, Status
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.problem.vehicle import step
from coverdrive.recordings.checks import wrong_speed_limit
from coverdrive.recordings.tracks.smoothing import SmoothingSettings
from coverdrive.road import Road
from coverdrive.road_ahead import controls
from coverdrive.scene import Scene
from coverdrive.settings import checked, merged
from coverdrive.simulation.drives.episode import decide
from coverdrive.simulation.predictor import Belief, check_belief, check_period
from coverdrive.simulation.roads.initial import EGO


@dataclass(frozen=True, eq=False)
class Command:
    """What the car is to do until the next call, and why."""

    acceleration: float
    """[m/s²]"""
    yaw_rate: float
    """[rad/s] in the map, counter-clockwise"""
    steering: float
    """[rad] angle of the front wheels that gives the yaw rate in a kinematic single-track model"""
    plan: Plan
    """in the road frame"""
    prediction: PredictedPaths
    """what the others may do, in the road frame, by their slots in ``scene``"""
    scene: Scene
    """what was seen, in the road frame; the ego has slot 0"""
    prediction_seconds: float
    """[s] processor time of the prediction"""
    planning_seconds: float
    """[s] processor time of prediction and planning together"""
    wall_seconds: float
    """[s] wall time of the same"""


class Driver:
    """Drives one car among vehicles that it is told of."""

    def __init__(
        self,
        predictor: Belief,
        planner: Planner | PlannerSettings | None = None,
        *,
        length: float | None = None,
        width: float | None = None,
        wanted_speed: float | None = None,
        period: float = 0.1,
        budget: float | None = None,
        smoothing: SmoothingSettings | None = None,
    ):
        """Take a seat, and compile what is needed; the planner remains as it is given.

        Args:
            predictor: of the other vehicles.
            planner: settings of our planner, one like which to make our own, or another planner; ours with its
                defaults if left out.
            length: [m] of the car; that of our planner's settings if left out. Another kind of planner, which has no
                such settings, is to know it already.
            width: [m] of the car, as well.
            wanted_speed: [m/s]; the reference speed of the planner's settings if left out. This and the budget can be
                said of our planner only.
            period: [s] between two calls of `step`.
            budget: [s] wall time after which a step begins no further iterations of its search; there is no bound if
                left out, so that a drive can be repeated exactly.
            smoothing: noises of measured positions, where vehicles are told by these alone.

        Raises:
            SettingError: a value is not allowed, or the planner does not know it.
        """
        wishes = {"length": length, "width": width, "wanted_speed": wanted_speed, "budget": budget}
        wishes = {name: finite(name, value) for name, value in wishes.items() if value is not None}
        period = period_of(period)
        if smoothing is not None:
            of_kind("smoothing", smoothing, SmoothingSettings, "SmoothingSettings")
        check_belief(predictor)
        check_period(predictor, period)
        planner = PlannerSettings() if planner is None else planner
        of_kind(
            "planner", planner, (Planner, PlannerSettings), "a planner (dt, steps, reset, plan), or settings of ours"
        )
        if type(planner) is MpcPlanner:
            planner = planner.settings
        if isinstance(planner, PlannerSettings):
            planner = MpcPlanner(adapted(planner, **wishes))
        elif unknown := [name for name in wishes if isinstance(planner, MpcPlanner) or name not in ("length", "width")]:
            raise SettingError(f"{', '.join(unknown)} can be said of our planner only; tell yours when you make it")
        self.planner: Planner = planner
        self.period, self._predictor = period, predictor
        settings = planner.settings if isinstance(planner, MpcPlanner) else adapted(PlannerSettings(grace=0), **wishes)
        self._vehicle = settings.problem.vehicle
        forget = max(settings.grace, planner.dt * planner.steps)
        size = self._vehicle.length, self._vehicle.width
        self._perception = Perception(size, period, forget, smoothing or SmoothingSettings())
        self.reset()

    def reset(self) -> None:
        """Forget the last drive; called before another one begins."""
        with blaming("planner", self.planner):
            self.planner.reset(self.period)
        self._perception.reset()
        self._steps, self._clear = 0, True
        self._road: Road | None = None

    def see(self, own: Numbers, others: Mapping[Hashable, Told], road: Road) -> Scene:
        """What a step would see, where none follows: after the end of a drive. Arguments and errors as of `step`."""
        return self._perception.scene(own, others, road)

    def step(self, own: Numbers, others: Mapping[Hashable, Told], road: Road, goal: Goal | None = None) -> Command:
        """Decide what to do until the next call, one period later.

        Args:
            own: x [m], y [m], speed [m/s], heading [rad] of the centre of the car, in map coordinates.
            others: for every other vehicle, by any name that stays the same from call to call, its state as ``own``
                or its measured position (x, y) alone, and its (length, width) [m]. Vehicles may appear and vanish.
            road: whose map coordinates these are; those of a road without a reference line are (lon, lat).
            goal: what is wanted besides the usual; its lanes wait while nothing clear is found.

        Raises:
            DataError: what is told of a vehicle cannot be true, or the road cannot be driven on.
            SettingError: the goal cannot be one on this road, or the planner takes none.
        """
        of_kind("road", road, Road, "a Road")
        if road is not self._road:
            road.check()
            for wrong in wrong_speed_limit(road.speed_limit):
                raise DataError(wrong)
            self._road = road
        of_kind("goal", goal, (Goal, type(None)), "a Goal, or None")
        scene = self.see(own, others, road)
        state, wishes = scene.states[EGO], dict[str, Any]()
        if goal is not None:
            if not isinstance(self.planner, MpcPlanner):
                raise SettingError("only our planner takes a goal; leave it out, and tell yours when you make it")
            usual = self.planner.settings.problem.cost.reference_speed
            wish = goal.wish(state, road, self._steps * self.period, usual, self.planner.curves(road))
            wishes["wish"] = wish if self._clear else replace(wish, lanes=(), lat=None)
        self._steps += 1
        with during(f"in step {self._steps}, {(self._steps - 1) * self.period:g} s after the start"):
            decision = decide(self._predictor, self.planner, scene, road, **wishes)
        self._clear = decision.plan.status is not Status.UNSAFE
        inputs = decision.plan.applied(self.period)[None]
        real = controls(step(state[None], inputs, self.period / 2), inputs, road, self._vehicle.wheelbase)
        acceleration, yaw_rate, steering = (float(each[0]) for each in real[1:])
        steering = min(max(steering, -self._vehicle.max_steering), self._vehicle.max_steering)
        if goal is not None and (firmly := goal.firmly(state, road, self.period)):
            acceleration = min(acceleration, -firmly)
        return Command(acceleration, yaw_rate, steering, decision.plan, decision.paths, scene, *decision[2:])


def adapted(settings: PlannerSettings, **wishes: float) -> PlannerSettings:
    """The settings with what is said of the car (``length``, ``width``), its ``wanted_speed`` and the ``budget``.

    Raises:
        SettingError: a value is not allowed.
    """
    vehicle = {name: wishes.get(name) for name in ("length", "width")}
    problem = {"vehicle": vehicle, "cost": {"reference_speed": wishes.get("wanted_speed")}}
    changes = {"problem": problem, "budget": wishes.get("budget")}
    return checked(PlannerSettings, merged(settings.model_dump(), changes))
