"""The reference planner: the same problem as a nonlinear program, solved by IPOPT or fatrop.

It is slower than `coverdrive.planning.planner` and does not promise to be done in time; it is there to check that one
against, and as a baseline in closed loop.
"""

import time
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.paths import PredictedPaths
from coverdrive.planning.constants import constants_of
from coverdrive.planning.evaluate import Motion, evaluated
from coverdrive.planning.fallback import braking_motion
from coverdrive.planning.follower import without_follower
from coverdrive.planning.motion import drive, lane_seeking_inputs, shifted_inputs
from coverdrive.planning.obstacles import Obstacles, chosen_obstacles, obstacles_of, reachable
from coverdrive.planning.plan import Plan, Status
from coverdrive.planning.planner import check_times
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.solvers import Solver, SolverSettings, solve
from coverdrive.road import Road
from coverdrive.settings import Settings


class ReferenceSettings(Settings):
    """Problem and solver of the reference planner."""

    problem: ProblemSettings = ProblemSettings()
    """horizon, own car, weights and obstacles"""
    solver: Solver = "ipopt"
    """which one"""
    options: SolverSettings = SolverSettings()
    """when the solver is done, and when it gives up"""
    lane_change: float = Field(default=10.0, ge=0, le=1e6)
    """cost of aiming at another lane than the last plan, against dithering"""


class Memory(NamedTuple):
    """What the planner remembers of its last call."""

    lane: int
    """the lane that the plan aimed at"""
    applied: Float[np.ndarray, " 2"]
    """acceleration [m/s²] and yaw rate [rad/s] applied since"""
    inputs: dict[int, Float[np.ndarray, "K 2"]]
    """inputs of the candidate of each lane, shifted to the time of the next call"""


class ReferencePlanner:
    """Model predictive control with a general solver; implements `coverdrive.planning.plan.Planner`."""

    def __init__(self, settings: ReferenceSettings | None = None):
        """Make a planner.

        Args:
            settings: problem and solver; the defaults if left out.
        """
        self.settings = settings or ReferenceSettings()
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
        self._memory: Memory | None = None

    def plan(self, state: Float[np.ndarray, " 4"], paths: PredictedPaths, road: Road) -> Plan:
        """Plan from a state against every predicted path; the state and the paths must be finite.

        Args:
            state: lon [m], lat [m], speed [m/s], heading [rad].
            paths: predicted paths at the times k·dt of the plan, k = 0 … K.
            road: the lanes to drive on.

        Returns:
            The cheapest plan; braking, with status FALLBACK or UNSAFE, where the solver fails for every lane.

        Raises:
            SettingError: if the paths have other times than the plan.
        """
        begin = time.perf_counter()
        problem, memory = self.settings.problem, self._memory
        check_times(paths, problem)
        if problem.obstacles.ignore_rear:
            paths = without_follower(state, paths, road)
        applied = memory.applied if memory else np.zeros(2)
        edges = (float(road.edges[0]), float(road.edges[-1]))
        situation = Situation(state, applied, edges, packed(state, obstacles_of(paths, problem.obstacles), problem))
        lane = int(road.lane_of(state[1]))
        held = memory.lane if memory else lane
        found = self._candidates(situation, road, lane, [*memory.inputs.values()] if memory else [])
        target = min(
            found, key=lambda each: found[each].lasting_cost + self.settings.lane_change * (each != held), default=lane
        )
        motion = found[target] if found else braking_motion(situation, float(road.centres[lane]), problem)
        status = (Status.SOLVED if found else Status.FALLBACK) if motion.clear else Status.UNSAFE
        later = {lane: shifted_inputs(each.inputs, self._period, problem.dt) for lane, each in found.items()}
        self._memory = Memory(target, motion.inputs[0], later)
        seconds = time.perf_counter() - begin
        slack = np.zeros(problem.steps) if motion.clear else np.maximum(0.0, motion.slack - problem.obstacles.margin)
        severity = float(motion.severity)
        return Plan(motion.states, motion.inputs, slack, status, float(motion.cost), seconds, problem.dt, severity)

    def _candidates(
        self, situation: Situation, road: Road, lane: int, former: list[Float[np.ndarray, "K 2"]]
    ) -> dict[int, Motion]:
        """The plans to the own lane and to those beside it, by lane; without those for which the solver fails."""
        problem, settings = self.settings.problem, self.settings
        targets = range(max(lane - 1, 0), min(lane + 2, road.lanes))
        candidates: dict[int, Motion] = {}
        for target in targets:
            centre = float(road.centres[target])
            motions = simple_motions(situation, centre, former, problem)
            start = min(motions, key=lambda each: each.lasting_cost)
            found = solved(situation, centre, start, settings.solver, problem, settings.options)
            if found is not None:
                candidates[target] = found
        return candidates


def packed(state: Float[np.ndarray, " 4"], obstacles: Obstacles, problem: ProblemSettings) -> Obstacles:
    """The obstacles within reach, in a number of slots that is a power of two and at least 8.

    Few sizes of the nonlinear program thus serve every scene.
    """
    near = reachable(state, obstacles, problem.dt, problem.vehicle, problem.obstacles)
    slots = max(8, 1 << (max(int(near.sum()), 1) - 1).bit_length())
    return chosen_obstacles(obstacles, near, state[0], slots)


def simple_motions(
    situation: Situation, target_lat: float, former: list[Float[np.ndarray, "K 2"]], problem: ProblemSettings
) -> list[Motion]:
    """Motions that a solver may start from: steer to the lane at a constant acceleration, and former inputs.

    Args:
        situation: what the plan is made for.
        target_lat: [m] centre of the lane.
        former: inputs of former plans, shifted to now.
        problem: horizon, car and weights.
    """
    vehicle = problem.vehicle
    braking = np.linspace(-vehicle.max_deceleration, 0.0, 5)
    accelerations = np.concatenate([braking, [vehicle.max_acceleration / 2, vehicle.max_acceleration]])
    targets = np.full(len(accelerations), target_lat)
    inputs = np.reshape(former, (len(former), problem.steps, 2))

    def wanted(k: int, states: Float[np.ndarray, "m 4"]) -> Float[np.ndarray, "m 2"]:
        seeking = lane_seeking_inputs(states[: len(targets)], targets, accelerations)
        return np.concatenate([seeking, inputs[:, k]])

    count = len(targets) + len(former)
    _, driven = drive(situation.state, wanted, count, problem.steps, problem.dt, problem.vehicle)
    return evaluated(driven, np.full(count, target_lat), situation, constants_of(problem))


def solved(
    situation: Situation,
    target_lat: float,
    start: Motion,
    solver: Solver,
    problem: ProblemSettings,
    options: SolverSettings,
) -> Motion | None:
    """The plan that a solver finds, driven with the vehicle model and judged; None if the solver fails.

    Args:
        situation: what the plan is made for.
        target_lat: [m] centre of the lane.
        start: the motion that the solver starts from.
        solver: which one.
        problem: horizon, car and weights.
        options: of the solver.
    """
    solution = solve(situation, target_lat, start, solver, problem, options)
    if solution is None or not np.isfinite(solution).all():
        return None
    return evaluated(solution[None, :, 4:6], np.array([target_lat]), situation, constants_of(problem))[0]
