"""Drives planning problems of CommonRoad scenarios, without knowing what is next, and writes their solutions.

At every time step the driver is told the vehicles of that step; these follow their recorded trajectories, whatever the
ego does. The drive ends where the goal is reached, and else when it no longer can be.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from commonroad.common.solution import CommonRoadSolutionWriter, CostFunction, PlanningProblemSolution, Solution
from commonroad.scenario.trajectory import Trajectory
from jaxtyping import Float
from shapely.geometry import Point

from coverdrive.driving.driver import Driver, adapted
from coverdrive.driving.goal import Goal
from coverdrive.driving.obstacles import shape_of
from coverdrive.driving.planning_problem import PlanningProblem
from coverdrive.driving.recorder import Recorder
from coverdrive.driving.single_track import BMW, VEHICLE, ModelName, SingleTrackCar
from coverdrive.plan import Planner
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.progress import done
from coverdrive.road import Road
from coverdrive.simulation.drives.outcome import Kind
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.predictor import Belief, as_given

_LEAST_SPEED = 5.0
"""[m/s] wanted where the ego starts more slowly"""


@dataclass(frozen=True, eq=False)
class Drive:
    """How a planning problem was driven."""

    problem: PlanningProblem
    cars: tuple[SingleTrackCar, ...]
    """the ego from the start on, at every time step"""
    reached: bool
    """whether the last state is in the goal"""
    trace: Trace
    """what was seen and planned, up to the first contact"""

    @property
    def contact(self) -> str:
        """Which contact there was, if any."""
        kind = self.trace.outcome.kind
        return "" if kind is Kind.FINISHED else f"collision ({kind.value})"

    @property
    def lack(self) -> str:
        """What is missing to the goal, if anything: what the last of the states lacks that come nearest to it in time.

        Who is past the place is not as near as who is beside it.
        """
        if self.reached:
            return ""
        lacks = list[list[str]]()
        for moment, car in enumerate(self.cars, start=self.problem.first):
            lacks += [
                _lacking(self.problem, goal, wanted, car.state(moment))
                for goal, wanted in self.problem.goals
                if goal.time_step.contains(moment)
            ]
        nearest = min(reversed(lacks), key=lambda each: (len(each), "too far" in each), default=["time"])
        return f"goal missed: {', '.join(nearest)}"

    @property
    def name(self) -> str:
        """The benchmark id, as it may be part of a file's name."""
        return re.sub(r"[^\w.:-]+", "_", str(self.problem.scenario.scenario_id))[:200]

    @property
    def mean_speed(self) -> float:
        """[m/s] of the car on its own way, up to the first contact."""
        return float(np.mean([car.pose[2] for car in self.cars[: len(self.trace.scene.lon)]]))

    @property
    def seconds(self) -> float:
        """[s] from the start to the end."""
        return (len(self.cars) - 1) * float(self.problem.scenario.dt)

    def solution(self) -> PlanningProblemSolution:
        """As commonroad-io takes it."""
        first, model = self.problem.first, self.cars[0].vehicle_model
        driven = Trajectory(first, [car.state(moment) for moment, car in enumerate(self.cars, start=first)])
        return PlanningProblemSolution(self.problem.number, model, VEHICLE, CostFunction.SA1, driven)


def drive(
    problem: PlanningProblem,
    predictor: Belief,
    model: ModelName = "KS",
    planner: Planner | PlannerSettings | None = None,
) -> Drive:
    """Drive one planning problem.

    Args:
        problem: where from, and where to.
        predictor: of the other vehicles.
        model: of the ego.
        planner: settings of ours, which `settings_for` the problem are made of; the defaults if left out. Or a planner
            as it is, which is told of the goal if it is ours.
    """
    dt, car = float(problem.scenario.dt), SingleTrackCar.at(problem.problem.initial_state, model)
    planner = PlannerSettings() if planner is None else planner
    if isinstance(planner, PlannerSettings):
        planner = MpcPlanner(settings_for(problem, planner))
    ours = isinstance(planner, MpcPlanner)  # which knows its car
    length, width = (None, None) if ours else (BMW.l, BMW.w)
    driver = Driver(as_given(predictor), planner, length=length, width=width, period=dt)
    recorder, cars, reached = Recorder(driver), [car], False
    for moment in range(problem.first, problem.last):
        goal = problem.goal_from(*problem.road.to_road(*car.pose[:2])) if ours else None
        command = recorder.step(_heading_on(car.pose, problem.road), problem.others(moment), problem.road, goal)
        car = car.moved(command.acceleration, command.steering, dt)
        cars.append(car)
        done(moment + 1 - problem.first, problem.last - problem.first)
        reached = bool(problem.problem.goal.is_reached(car.state(moment + 1)))
        if reached:
            break
    recorder.end(_heading_on(car.pose, problem.road), problem.others(problem.first + len(cars) - 1))
    return Drive(problem, tuple(cars), reached, recorder.trace())


def _heading_on(pose: Float[np.ndarray, " 4"], road: Road) -> Float[np.ndarray, " 4"]:
    """The pose of a car, turned as its centre moves where it follows the bend of a road.

    A planner takes the heading for the direction of motion, which only the middle of the rear axle has: told of that of
    the body, it would let the car drift to the inside of the bend.
    """
    lon, lat = road.to_road(*pose[:2])
    bend = float(road.curvature(lon) / road.stretch(lon, lat))
    return pose + np.array([0.0, 0.0, 0.0, np.arcsin(np.clip(BMW.b * bend, -1.0, 1.0))])


def settings_for(problem: PlanningProblem, settings: PlannerSettings) -> PlannerSettings:
    """Settings of a planner for the car, which wants the speed of the start."""
    wanted = max(_LEAST_SPEED, float(problem.problem.initial_state.velocity))
    return adapted(settings, length=BMW.l, width=BMW.w, wanted_speed=wanted)


def _lacking(problem: PlanningProblem, goal: Any, wanted: Goal, state: Any) -> list[str]:
    """What a state lacks for a goal, also as we want it, besides the time."""
    lacking = list[str]()
    if goal.has_value("position") and not shape_of(goal.position).intersects(Point(*state.position)):
        lon, lat = problem.road.to_road(*state.position)
        low, high = wanted.position or (lon, lon)
        if problem.lane_of(lon, lat) not in wanted.any_lane:
            lacking.append("other lane")
        if not low <= lon <= high:
            lacking.append("not far enough" if lon < low else "too far")
        lacking = lacking or ["beside it"]
    if goal.has_value("velocity") and not goal.velocity.contains(state.velocity):
        lacking.append("speed")
    if goal.has_value("orientation") and not goal.orientation.contains(state.orientation):
        lacking.append("heading")
    return lacking


def solution_of(drives: Sequence[Drive]) -> str:
    """The solution of one scenario, of whose planning problems these are the drives, in the official XML format."""
    scenario = drives[0].problem.scenario
    seconds = float(np.sum([each.trace.wall_seconds.sum() for each in drives]))
    solution = Solution(scenario.scenario_id, [each.solution() for each in drives], computation_time=seconds)
    return CommonRoadSolutionWriter(solution).dump()
