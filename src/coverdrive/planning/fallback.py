"""What the own car does when no solver converges: brake as hard as it can and stay in its lane (or return to it)."""

import numpy as np
from jaxtyping import Float

from coverdrive.planning.motion import Motion, drive, judged, lane_seeking_inputs
from coverdrive.planning.problem import ProblemSettings, Situation


def braking_motion(situation: Situation, lane_centre: float, problem: ProblemSettings) -> Motion:
    """The braking manoeuvre with its true slack and cost.

    Args:
        situation: what the plan is made for.
        lane_centre: [m] lat of the centre of the lane to stay in.
        problem: horizon, car, weights and shape of the obstacles.
    """
    target, deceleration = np.array([lane_centre]), np.array([-problem.vehicle.max_deceleration])
    states, inputs = drive(
        situation.state,
        lambda _, states: lane_seeking_inputs(states, target, deceleration),
        motions=1,
        steps=problem.steps,
        dt=problem.dt,
        vehicle=problem.vehicle,
    )
    return judged(states[0], inputs[0], lane_centre, situation, problem)


def blind_motion(state: Float[np.ndarray, " 4"], problem: ProblemSettings) -> Motion:
    """Full braking without steering for a state that is not known; slack 1 and infinite cost say so.

    Args:
        state: the state, with numbers that are not finite.
        problem: horizon and limits of the car.
    """
    steps = problem.steps
    return Motion(
        states=np.tile(state, (steps + 1, 1)),
        inputs=np.tile([-problem.vehicle.max_deceleration, 0.0], (steps, 1)),
        slack=np.ones(steps),
        off_road=np.zeros(steps),
        cost=np.array(np.inf),
        lasting_cost=np.array(np.inf),
    )
