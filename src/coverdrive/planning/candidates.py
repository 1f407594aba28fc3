"""One candidate plan per target lane: the optimal control problem solved against the obstacles that matter.

A solver is started from the cheapest of some simple motions (steer to the lane at a constant acceleration) and of
the previous plan. It sees the boxes with the least clearance only; as long as its solution violates others, those are
added and it goes on from there. What is returned solves the problem with all boxes.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.planning.motion import Motion, drive, judged, lane_seeking_inputs
from coverdrive.planning.obstacles import chosen_obstacles, clearances
from coverdrive.planning.plan import Status
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.solvers import Solver, SolverSettings, solve
from coverdrive.settings import Settings

_STATE_TOLERANCE = 0.02
"""[m, m/s, rad] by which the states of a solver may differ from those that its inputs lead to"""
_SLACK_TOLERANCE = 1e-3


class CandidateSettings(Settings):
    """How the candidate of a lane is found."""

    solver: SolverSettings = SolverSettings()
    """when a solver is done, and when it gives up"""
    boxes: int = Field(default=8, ge=1)
    """number of boxes of every step that a solver sees at first"""
    rounds: int = Field(default=4, ge=1)
    """how often violated boxes are added before all are"""


class Candidate(NamedTuple):
    """A motion to a lane, and how it was found."""

    motion: Motion
    """with slack and cost against all obstacles"""
    status: Status
    """SOLVED or RETRIED"""


def cheapest_start(
    situation: Situation,
    target_lat: float,
    previous_inputs: list[Float[np.ndarray, "K 2"]],
    problem: ProblemSettings,
) -> Motion:
    """The motion to a lane that a solver starts from.

    Args:
        situation: what the plan is made for.
        target_lat: [m] centre of the lane.
        previous_inputs: inputs of former plans, shifted to now.
        problem: horizon, car and weights.
    """
    vehicle = problem.vehicle
    accelerations = np.concatenate(
        [np.linspace(-vehicle.max_deceleration, 0.0, 5), [vehicle.max_acceleration / 2, vehicle.max_acceleration]]
    )
    targets = np.full(len(accelerations), target_lat)
    former = np.reshape(previous_inputs, (len(previous_inputs), problem.steps, 2))

    def wanted(k: int, states: Float[np.ndarray, "m 4"]) -> Float[np.ndarray, "m 2"]:
        seeking = lane_seeking_inputs(states[: len(targets)], targets, accelerations)
        return np.concatenate([seeking, former[:, k]])

    motions = len(targets) + len(former)
    states, inputs = drive(situation.state, wanted, motions, problem.steps, problem.dt, vehicle)
    starts = judged(states, inputs, target_lat, situation, problem)
    return starts.at(int(np.argmin(starts.lasting_cost)))


def solve_lane(
    situation: Situation,
    target_lat: float,
    start: Motion,
    problem: ProblemSettings,
    settings: CandidateSettings,
) -> Candidate | None:
    """The plan to a lane, or None if no solver converges.

    Args:
        situation: what the plan is made for.
        target_lat: [m] centre of the lane.
        start: the motion that the solver starts from.
        problem: horizon, car and weights.
        settings: how the candidate is found.
    """
    values = clearances(start.states, situation.obstacles, problem.vehicle, problem.obstacles)
    rank = np.argsort(np.argsort(values, axis=1), axis=1)
    chosen = rank < settings.boxes
    status, guess = Status.SOLVED, start
    for attempt in range(settings.rounds + 1):
        seen = chosen_obstacles(situation.obstacles, chosen, situation.state[0])
        reduced = situation._replace(obstacles=seen)
        found = _solved(reduced, target_lat, guess, "fatrop", problem, settings)
        if found is None:
            status = Status.RETRIED
            found = _solved(reduced, target_lat, start, "ipopt", problem, settings)
        if found is None:
            return None
        values = clearances(found.states, situation.obstacles, problem.vehicle, problem.obstacles)
        missing = (values + found.slack[:, None] < 1 - _SLACK_TOLERANCE) & ~chosen
        if not missing.any():
            return Candidate(judged(found.states, found.inputs, target_lat, situation, problem), status)
        chosen |= missing | (attempt + 1 == settings.rounds)
        guess = judged(found.states, found.inputs, target_lat, situation, problem)
    return None


def _solved(
    situation: Situation,
    target_lat: float,
    start: Motion,
    solver: Solver,
    problem: ProblemSettings,
    settings: CandidateSettings,
) -> Motion | None:
    """What a solver finds, driven with the vehicle model; None if it fails or its result does not stand the check."""
    solution = solve(situation, target_lat, start, solver, problem, settings.solver)
    if solution is None or not np.isfinite(solution).all():
        return None
    states, inputs = drive(
        situation.state, lambda k, _: solution[None, k, 4:6], 1, problem.steps, problem.dt, problem.vehicle
    )
    if np.abs(states[0, 1:] - solution[:, :4]).max() > _STATE_TOLERANCE:
        return None
    return judged(states[0], inputs[0], target_lat, situation, problem)
