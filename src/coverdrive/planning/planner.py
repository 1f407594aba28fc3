"""The planner that drives: in every period the cheapest clear plan among the lanes that can be reached (paper §4).

Each call packs what can be reached into arrays and runs the compiled search, again and again until it has converged or
the time is spent. See `coverdrive.planning.search` for what is searched.
"""

import math
import time
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.errors import SettingError
from coverdrive.paths import PredictedPaths
from coverdrive.planning.constants import constants_of
from coverdrive.planning.evaluate import Motion, evaluated
from coverdrive.planning.fallback import assumed_state, braking_motion, continued, plausible
from coverdrive.planning.follower import FollowerSettings, with_careful_follower, without_follower
from coverdrive.planning.merit import Surroundings
from coverdrive.planning.motion import shifted_inputs
from coverdrive.planning.obstacles import Obstacles, obstacles_of, pack, reachable
from coverdrive.planning.path_memory import PathMemory
from coverdrive.planning.plan import Plan, Status
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.search import Found, SearchSettings, Wanted, search
from coverdrive.road import Road
from coverdrive.settings import Settings

_ROUNDING = 1e-9
"""[s] of a time"""
_PATHS_BETWEEN_LOOKS = 1000
"""paths times iterations of the search between two looks at the clock"""


class PlannerSettings(Settings):
    """Everything that decides on a plan."""

    problem: ProblemSettings = ProblemSettings()
    """horizon, own car, weights and obstacles"""
    search: SearchSettings = SearchSettings()
    """how plans are found"""
    lane_change: float = Field(default=10.0, ge=0, le=1e6)
    """cost of aiming at another lane than the last plan, against dithering"""
    iterations: int = Field(default=24, ge=1, le=10_000)
    """of the search, at the most"""
    budget: float | None = Field(default=None, gt=0, le=10)
    """[s] wall time after which no further iterations are begun: in a car, half of the time between two plans is a good
    choice; without it, the same seed gives the same drive on every machine"""
    iterations_at_once: int = Field(default=8, ge=1, le=10_000)
    """iterations between two looks at the clock; fewer where there are more than 125 paths"""
    rear_last: bool = True
    """if nothing is clear, the vehicle directly behind in the own lane (paper, Remark 2) is taken to keep its distance
    as ``follower`` says, so that it does not push the own car into another, even where nothing is clear then either"""
    follower: FollowerSettings = FollowerSettings()
    """what that vehicle is trusted to do"""
    grace: float = Field(default=0.5, ge=0, le=10)
    """[s] for which a vehicle that vanished is taken to be on one of its last predicted paths, and for which the own
    car is taken to follow its last plan where its state cannot be true, or cannot have come about since. Then it brakes
    in the former case, and believes the state in the latter"""


class _Memory(NamedTuple):
    """What the planner remembers of its last call."""

    lane: int
    """the lane that the plan aimed at"""
    applied: Float[np.ndarray, " 2"]
    """acceleration [m/s²] and yaw rate [rad/s] applied since"""
    state: Float[np.ndarray, " 4"]
    """where the plan leads to by the time of the next call"""
    inputs: dict[int, Float[np.ndarray, "K 2"]]
    """inputs of the best motion to each lane, shifted to the time of the next call"""
    blind: float
    """[s] for which the own state has not been known"""


class MpcPlanner:
    """Model predictive control against every member of every predicted set.

    It implements `coverdrive.planning.plan.Planner`. The first `reset` in a process compiles the search. A planner can
    be pickled and copied: what is compiled belongs to the process, not to the planner.
    """

    def __init__(self, settings: PlannerSettings | None = None):
        """Make a planner.

        Args:
            settings: horizon, car, weights; the defaults if left out.
        """
        self.settings = settings or PlannerSettings()
        problem = self.settings.problem
        self._constants = constants_of(problem)
        self._accelerations = self.settings.search.accelerations(problem.vehicle)
        self._budget = math.inf if self.settings.budget is None else self.settings.budget
        self._start(self.dt)

    @property
    def dt(self) -> float:
        """[s] between two points of the paths that it plans against."""
        return self.settings.problem.dt

    @property
    def steps(self) -> int:
        """Number K of its steps; it plans against paths of K + 1 points."""
        return self.settings.problem.steps

    def reset(self, period: float) -> None:
        """Forget the previous plan; called before every episode. Compiles what `plan` needs.

        Args:
            period: [s] from one call to the next, by which the last plans are shifted to start the search.
        """
        self._start(period)
        state, road = np.array([0.0, 1.8, 20.0, 0.0]), Road.straight()
        points = np.zeros((1, self.steps + 1, 2))
        points[..., 0] = 30.0
        self.plan(state, PredictedPaths(points, np.zeros(1, int), np.ones_like(points), self.dt), road)
        self._start(period)

    def _start(self, period: float) -> None:
        self._period = period
        self._shift = shifted_inputs(np.eye(self.steps), period, self.dt)
        self._memory: _Memory | None = None
        self._paths = PathMemory(self.settings.grace)

    def plan(self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> Plan:
        """Plan from a state against every predicted path.

        Args:
            state: lon [m], lat [m], speed [m/s], heading [rad], one period after the last one. `reset` comes first
                where it is another car's or another drive's.
            paths: predicted paths at the times k·dt of the plan, k = 0 … K.
            road: the lanes to drive on.

        Returns:
            The cheapest plan that is clear of all paths, else the one that violates least; its status says which. If
            the state or a path is not known, or the state has jumped, the status is BLIND and the slack 1.

        Raises:
            SettingError: if the paths have other times than the plan.
        """
        begin = time.perf_counter()
        problem = self.settings.problem
        check_times(paths, problem)
        measured = np.ascontiguousarray(state, dtype=float)
        believed, memory = plausible(measured, problem.vehicle, road), self._memory
        known, blind = bool(believed.all()), 0.0
        if known and memory is not None and memory.blind + self._period <= self.settings.grace + _ROUNDING:
            known = self._continued(measured, memory.state, paths)
        if not known and memory is not None:
            measured, blind = memory.state, memory.blind + self._period
        elif not known:
            measured, blind = assumed_state(measured, believed, problem.vehicle, road), np.inf
        paths, complete = self._paths.completed(paths, self._period)
        searching = complete and blind <= self.settings.grace + _ROUNDING
        motion, status = self._decide(measured, paths, road, searching, blind, begin)
        slack = np.zeros(problem.steps) if motion.clear else np.maximum(0.0, motion.slack - problem.obstacles.margin)
        if not (known and complete):
            status, slack = Status.BLIND, np.ones(problem.steps)
        seconds = time.perf_counter() - begin
        severity, inputs = float(motion.severity), motion.inputs
        if not motion.clear and motion.states[1, 2] <= _ROUNDING:
            inputs = self._stopping(inputs, measured[2])
        return Plan(motion.states, inputs, slack, status, float(motion.cost), seconds, problem.dt, severity)

    def _stopping(self, inputs: Float[np.ndarray, "K 2"], speed: float) -> Float[np.ndarray, "K 2"]:
        """Inputs of which the first one stops the car as early as it can, not at the end of its step."""
        hardest = -min(self.settings.problem.vehicle.max_deceleration, max(0.0, speed) / self._period)
        return np.concatenate([[[min(inputs[0, 0], hardest), inputs[0, 1]]], inputs[1:]])

    def _continued(
        self, state: Float[np.ndarray, " 4"], expected: Float[np.ndarray, " 4"], paths: PredictedPaths
    ) -> bool:
        """Whether the own car has not jumped; where all others have jumped with it, the origin has moved."""
        if continued(state, expected, self._period):
            return True
        offset = np.concatenate([self._paths.shift(paths, self._period), np.zeros(2)])
        return continued(state - offset, expected, self._period)

    def _decide(
        self,
        state: Float[np.ndarray, " 4"],
        paths: PredictedPaths,
        road: Road,
        searching: bool,
        blind: float,
        begin: float,
    ) -> tuple[Motion, Status]:
        """The chosen motion, full braking unless ``searching``; remembers what the next call needs."""
        problem = self.settings.problem
        if problem.obstacles.ignore_rear:
            paths = without_follower(state, paths, road)
        obstacles = obstacles_of(paths, problem.obstacles)
        lane = int(road.lane_of(state[1]))
        found, targets = self._search(state, obstacles, road, lane, begin) if searching else (None, [lane])
        memory = self._memory
        applied = memory.applied if memory else np.zeros(2)
        situation = Situation(state, applied, (float(road.edges[0]), float(road.edges[-1])), obstacles)
        yielded = self._yielded(state, paths, road, lane, begin) if found and not found.chosen.clear else None
        if found is None:
            motion, status = braking_motion(situation, float(road.centres[lane]), problem), Status.UNSAFE
            target, inputs = lane, {lane: motion.inputs}
        else:
            status = _status_of(found)
            if yielded is not None:
                found, status = yielded, Status.REAR if yielded.chosen.clear else Status.UNSAFE
            target = targets[found.chosen.lane]
            motion = _motion_of(found, state[0])
            if yielded is not None:
                motion = evaluated(motion.inputs[None], np.array(road.centres)[[target]], situation, self._constants)[0]
            inputs = dict(zip(targets, map(_by_step, found.arrays.best), strict=True))
        later = {lane: self._shift @ each for lane, each in inputs.items()}
        self._memory = _Memory(target, motion.inputs[0], _after(motion, self._period, problem.dt), later, blind)
        return motion, status

    def _yielded(
        self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road, lane: int, begin: float
    ) -> Found | None:
        """What is found if the vehicle directly behind keeps its distance; None if there is none that could."""
        settings = self.settings
        wanted = settings.rear_last and not settings.problem.obstacles.ignore_rear
        others = with_careful_follower(state, paths, road, settings.follower) if wanted else None
        if others is None or time.perf_counter() - begin > self._budget:
            return None
        obstacles = obstacles_of(others, settings.problem.obstacles)
        found, _ = self._search(state, obstacles, road, lane, begin)
        return found

    def _search(
        self, state: Float[np.ndarray, " 4"], obstacles: Obstacles, road: Road, lane: int, begin: float
    ) -> tuple[Found | None, list[int]]:
        """The result of the search, or None if it failed, and the target lanes; the first is the lane of the car."""
        problem, settings, memory = self.settings.problem, self.settings, self._memory
        targets = [lane, *(side for side in (lane - 1, lane + 1) if 0 <= side < road.lanes)]
        held = memory.lane if memory else lane
        lanes, straight = len(targets), np.zeros((problem.steps, 2))
        known = memory.inputs if memory else {}
        last = np.array([known.get(target, straight).T.ravel() for target in targets])
        extra = np.array([settings.lane_change * (target != held) for target in targets])
        around = self._surroundings(state, obstacles, road)
        nothing = np.zeros(2 * lanes, int), np.zeros((2 * lanes, 2 * problem.steps))
        wanted = Wanted(
            np.array(road.centres)[targets], extra, last, *nothing, min(1.0, self._period / self.dt), resumed=False
        )
        tolerance, left = settings.search.tolerance, settings.iterations
        at_once = min(settings.iterations_at_once, max(1, _PATHS_BETWEEN_LOOKS // max(1, around.boxes.shape[2])))
        while True:
            iterations = min(at_once, left)
            found = search(around, wanted, self._accelerations, iterations, tolerance, self._constants)
            left -= iterations
            if found.done or left == 0 or time.perf_counter() - begin > self._budget:
                break
            wanted = wanted._replace(lane=found.arrays.descended_lane, starts=found.arrays.descended, resumed=True)
        return (found if np.isfinite(found.chosen.cost) else None), targets

    def _surroundings(self, state: Float[np.ndarray, " 4"], obstacles: Obstacles, road: Road) -> Surroundings:
        """What the search is made for; boxes that no motion can reach are left out."""
        problem, memory = self.settings.problem, self._memory
        near = reachable(state, obstacles, problem.dt, problem.vehicle, problem.obstacles)
        boxes = np.empty((7, problem.steps + 1, int(near.sum())))
        pack(obstacles, near, float(state[0]), boxes)
        return Surroundings(
            state=np.array([0.0, *state[1:]]),
            previous_input=np.array(memory.applied) if memory else np.zeros(2),
            edges=np.array([road.edges[0], road.edges[-1]], dtype=float),
            boxes=boxes,
        )


def _by_step(inputs: Float[np.ndarray, " U"]) -> Float[np.ndarray, "K 2"]:
    """Inputs, one row for each step."""
    return inputs.reshape(2, -1).T


def _motion_of(found: Found, lon: float) -> Motion:
    """The chosen motion on the road, `lon` [m] being where the car is."""
    arrays, chosen = found.arrays, found.chosen
    states = arrays.states + np.array([lon, 0.0, 0.0, 0.0])
    inputs, cost = _by_step(arrays.inputs), chosen.cost
    of_contact = chosen.severity, chosen.harm, chosen.departure, chosen.clear
    return Motion(states, inputs, arrays.slack, arrays.off_road, cost, cost, *of_contact)


def _status_of(found: Found) -> Status:
    if not found.chosen.clear:
        return Status.UNSAFE
    return Status.SOLVED if found.chosen.optimised else Status.FALLBACK


def _after(motion: Motion, elapsed: float, dt: float) -> Float[np.ndarray, " 4"]:
    """The state that a motion leads to after some time [s] of it."""
    at = min(elapsed / dt, len(motion.states) - 1)
    before = min(int(at), len(motion.states) - 2)
    return motion.states[before] + (at - before) * (motion.states[before + 1] - motion.states[before])


def check_times(paths: PredictedPaths, problem: ProblemSettings) -> None:
    """Refuse paths whose points are not at the times of the plan.

    Raises:
        SettingError: if so.
    """
    points = paths.points.shape[1]
    if points != problem.steps + 1 or abs(paths.dt - problem.dt) > 1e-9:
        raise SettingError(
            f"the predicted paths have {points} points every {paths.dt} s, the plan needs {problem.steps + 1} every "
            f"{problem.dt} s; predict with the planner's steps and dt"
        )
