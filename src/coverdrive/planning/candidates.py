"""One candidate plan per target lane: the optimal control problem solved against the obstacles that matter.

A solver is started from the cheapest of some simple motions (steer to the lane at a constant acceleration) and of
the previous plan. It sees the boxes with the least clearance only; as long as its solution violates others, those are
added and it goes on from there. What is returned solves the problem with all boxes.
"""

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.planning.motion import Motion, drive, judged, lane_seeking_inputs
from coverdrive.planning.obstacles import chosen_obstacles, clearances
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.solvers import Solver, SolverSettings, solve
from coverdrive.planning.vehicle import VehicleSettings
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


def cheapest_starts(
    situation: Situation,
    target_lats: list[float],
    previous_inputs: list[Float[np.ndarray, "K 2"]],
    problem: ProblemSettings,
) -> list[Motion]:
    """The motion to each lane that a solver starts from.

    Args:
        situation: what the plan is made for.
        target_lats: [m] centres of the lanes.
        previous_inputs: inputs of former plans, shifted to now; each is a start for every lane.
        problem: horizon, car and weights.
    """
    accelerations = _start_accelerations(problem.vehicle)
    targets = np.repeat(target_lats, len(accelerations))
    repeated = np.tile(accelerations, len(target_lats))
    former = np.reshape(previous_inputs, (len(previous_inputs), problem.steps, 2))

    def wanted(k: int, states: Float[np.ndarray, "m 4"]) -> Float[np.ndarray, "m 2"]:
        seeking = lane_seeking_inputs(states[: len(targets)], targets, repeated)
        return np.concatenate([seeking, former[:, k]])

    motions = len(targets) + len(former)
    states, inputs = drive(situation.state, wanted, motions, problem.steps, problem.dt, problem.vehicle)
    to_any = np.arange(len(targets), motions)
    starts: list[Motion] = []
    for lane, target_lat in enumerate(target_lats):
        to_lane = np.arange(len(accelerations)) + lane * len(accelerations)
        own = np.concatenate([to_lane, to_any])
        judgement = judged(states[own], inputs[own], target_lat, situation, problem)
        starts.append(judgement.at(int(np.argmin(judgement.lasting_cost))))
    return starts


def _start_accelerations(vehicle: VehicleSettings) -> Float[np.ndarray, " n"]:
    """The constant accelerations [m/s²] that are tried: from full braking to full throttle."""
    braking = np.linspace(-vehicle.max_deceleration, 0.0, 5)
    return np.concatenate([braking, [vehicle.max_acceleration / 2, vehicle.max_acceleration]])


def solve_lane(
    situation: Situation,
    target_lat: float,
    start: Motion,
    solver: Solver,
    problem: ProblemSettings,
    settings: CandidateSettings,
) -> Motion | None:
    """The plan to a lane, or None if the solver does not converge to one.

    Args:
        situation: what the plan is made for.
        target_lat: [m] centre of the lane.
        start: the motion that the solver starts from.
        solver: which one.
        problem: horizon, car and weights.
        settings: how the candidate is found.
    """
    values = clearances(start.states, situation.obstacles, problem.vehicle, problem.obstacles)
    chosen = np.argsort(np.argsort(values, axis=1), axis=1) < settings.boxes
    for attempt in range(settings.rounds + 1):
        seen = chosen_obstacles(situation.obstacles, chosen, situation.state[0])
        reduced = situation._replace(obstacles=seen)
        found = _solved(reduced, target_lat, start, solver, problem, settings)
        if found is None:
            return None
        values = clearances(found.states, situation.obstacles, problem.vehicle, problem.obstacles)
        missing = (values + found.slack[:, None] < 1 - _SLACK_TOLERANCE) & ~chosen
        start = judged(found.states, found.inputs, target_lat, situation, problem)
        if not missing.any():
            return start
        chosen |= missing | (attempt + 1 == settings.rounds)
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
