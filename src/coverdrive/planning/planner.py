"""The planner of the paper's §4: in each period the cheapest plan among the lanes that can be reached.

For the lane of the car and those beside it the optimal control problem is solved against every predicted path; the
cheapest plan wins. A plan to another lane than that of the last plan must be cheaper by a margin.
"""

import time
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.errors import SettingError
from coverdrive.paths import PredictedPaths
from coverdrive.planning.candidates import CandidateSettings, cheapest_starts, solve_lane
from coverdrive.planning.fallback import blind_motion, braking_motion
from coverdrive.planning.motion import Motion, shifted_inputs
from coverdrive.planning.obstacles import reachable_obstacles, without_rear
from coverdrive.planning.plan import Plan, Status
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.solvers import Solver
from coverdrive.road import Road
from coverdrive.settings import Settings


class PlannerSettings(Settings):
    """Everything that decides on a plan."""

    problem: ProblemSettings = ProblemSettings()
    """horizon, own car, weights and obstacles"""
    candidate: CandidateSettings = CandidateSettings()
    """how the plan to one lane is found"""
    lane_change: float = Field(default=10.0, ge=0)
    """cost of aiming at another lane than the last plan, against dithering"""


class _Memory(NamedTuple):
    """What the planner remembers of its last call."""

    lane: int
    """the lane that the plan aimed at"""
    applied: Float[np.ndarray, " 2"]
    """acceleration [m/s²] and yaw rate [rad/s] applied since"""
    inputs: list[Float[np.ndarray, "K 2"]]
    """inputs of the candidates of all lanes, shifted to the time of the next call"""


class Candidate(NamedTuple):
    """The plan to one lane."""

    motion: Motion
    """with slack and cost against all obstacles"""
    status: Status
    """SOLVED or RETRIED"""


class MpcPlanner:
    """Model predictive control against every member of every predicted set.

    It implements `coverdrive.planning.plan.Planner`. The first plans in a process compile the problem. A planner can
    be pickled and copied: what is compiled belongs to the process, not to the planner.
    """

    def __init__(self, settings: PlannerSettings | None = None):
        """Make a planner.

        Args:
            settings: horizon, car, weights; the defaults if left out.
        """
        self.settings = settings or PlannerSettings()
        self.reset(self.dt)

    @property
    def dt(self) -> float:
        """[s] between two points of the paths that it plans against."""
        return self.settings.problem.dt

    @property
    def steps(self) -> int:
        """Number K of its steps; it plans against paths of K + 1 points."""
        return self.settings.problem.steps

    def reset(self, period: float) -> None:
        """Forget the previous plan; called before every episode.

        Args:
            period: [s] from one call to the next, by which the last plans are shifted to start the search.
        """
        self._period = period
        self._memory: _Memory | None = None

    def plan(self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> Plan:
        """Plan from a state against every predicted path.

        Args:
            state: lon [m], lat [m], speed [m/s], heading [rad].
            paths: predicted paths at the times k·dt of the plan, k = 0 … K.
            road: the lanes to drive on.

        Returns:
            The cheapest plan. Its status is FALLBACK if no solver converges or if a number of the state or of the
            paths is not finite; then its slack is 1 where nothing is known.

        Raises:
            SettingError: if the paths have other times than the plan.
        """
        begin = time.perf_counter()
        problem = self.settings.problem
        _check_times(paths, problem)
        state = np.asarray(state, dtype=float)
        if np.isfinite(state).all():
            motion, status = self._decide(state, paths, road)
        else:
            motion, status = blind_motion(state, problem), Status.FALLBACK
            self._memory = None
        seconds = time.perf_counter() - begin
        return Plan(motion.states, motion.inputs, motion.slack, status, float(motion.cost), seconds, problem.dt)

    def _decide(self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> tuple[Motion, Status]:
        """The cheapest candidate, or the fallback; remembers what the next call needs."""
        problem = self.settings.problem
        finite = np.isfinite(np.concatenate([paths.points, paths.half_sizes], axis=-1))
        known = np.asarray(finite.all(axis=(1, 2)))
        situation = self._situation(state, paths.of(known), road)
        lane = int(road.lane_of(state[1]))
        candidates = self._candidates(situation, road, lane) if known.all() else {}
        if candidates:
            target = self._cheapest(candidates, self._memory.lane if self._memory else lane)
            motion, status = candidates[target]
        else:
            target, status = lane, Status.FALLBACK
            motion = braking_motion(situation, float(road.centres[lane]), problem)
            if not known.all():
                motion = motion._replace(slack=np.ones(problem.steps))
        inputs = [candidate.motion.inputs for candidate in candidates.values()]
        later = [shifted_inputs(each, self._period, problem.dt) for each in inputs]
        self._memory = _Memory(target, motion.inputs[0], later)
        return motion, status

    def _situation(self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> Situation:
        """What the candidates are made for."""
        problem = self.settings.problem
        if problem.obstacles.ignore_rear:
            paths = without_rear(state, paths, road)
        return Situation(
            state=state,
            previous_input=self._memory.applied if self._memory else np.zeros(2),
            road_edges=(float(road.edges[0]), float(road.edges[-1])),
            obstacles=reachable_obstacles(state, paths, problem.vehicle, problem.obstacles),
        )

    def _candidates(self, situation: Situation, road: Road, lane: int) -> dict[int, Candidate]:
        """The candidates to the own lane and to those beside it, by lane; without those that no solver finds.

        The robust solver is called for the lane of the last plan, and for all lanes if the fast one solves none.
        """
        problem, settings = self.settings.problem, self.settings.candidate
        former, held = (self._memory.inputs, self._memory.lane) if self._memory else ([], lane)
        targets = range(max(lane - 1, 0), min(lane + 2, road.lanes))
        centres = {target: float(road.centres[target]) for target in targets}
        found = cheapest_starts(situation, list(centres.values()), former, problem)
        starts = dict(zip(targets, found, strict=True))
        candidates: dict[int, Candidate] = {}

        def attempt(target: int, solver: Solver, status: Status) -> None:
            motion = solve_lane(situation, centres[target], starts[target], solver, problem, settings)
            if motion is not None:
                candidates[target] = Candidate(motion, status)

        for target in targets:
            attempt(target, "fatrop", Status.SOLVED)
        for target in targets:
            if target not in candidates and (target == held or not candidates):
                attempt(target, "ipopt", Status.RETRIED)
        return candidates

    def _cheapest(self, candidates: dict[int, Candidate], held: int) -> int:
        """The lane of the cheapest candidate; a lane other than the held one costs extra."""
        return min(
            candidates,
            key=lambda lane: candidates[lane].motion.lasting_cost + self.settings.lane_change * (lane != held),
        )


def _check_times(paths: PredictedPaths, problem: ProblemSettings) -> None:
    """Refuse paths whose points are not at the times of the plan."""
    points = paths.points.shape[1]
    if points != problem.steps + 1 or abs(paths.dt - problem.dt) > 1e-9:
        raise SettingError(
            f"the predicted paths have {points} points every {paths.dt} s, the plan needs {problem.steps + 1} every "
            f"{problem.dt} s; predict with the planner's steps and dt"
        )
