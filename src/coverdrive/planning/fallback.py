"""What is done when the search cannot say: the state is not known, or no search result is at hand."""

import numpy as np
from jaxtyping import Float

from coverdrive.planning.motion import Motion, drive, judged, lane_seeking_inputs
from coverdrive.planning.problem import ProblemSettings, Situation
from coverdrive.planning.vehicle import VehicleSettings
from coverdrive.road import Road

_FARTHEST = 1e9
"""[m] no road is longer"""


def braking_motion(situation: Situation, lane_centre: float, problem: ProblemSettings) -> Motion:
    """Full braking in the lane (or back to it), with its true slack and cost.

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


def plausible(state: Float[np.ndarray, " 4"], vehicle: VehicleSettings) -> bool:
    """Whether a measured state can be true: finite, and no speed or heading that a car on a road cannot have.

    Args:
        state: lon [m], lat [m], speed [m/s], heading [rad].
        vehicle: limits of the own car; up to twice its largest speed is believed.
    """
    largest = np.array([_FARTHEST, _FARTHEST, 2 * vehicle.max_speed, np.pi / 2])
    return bool((np.abs(state) <= largest).all())


def dead_reckoning(
    measured: Float[np.ndarray, " 4"], expected: Float[np.ndarray, " 4"] | None, road: Road
) -> Float[np.ndarray, " 4"]:
    """What is assumed in place of a state that cannot be true.

    Args:
        measured: the state.
        expected: where the last plan leads to, if there is one.
        road: the lanes.

    Returns:
        ``expected``; without it, a car at rest in the middle of the road, so that nothing but braking follows.
    """
    if expected is not None:
        return expected
    lon = measured[0] if abs(measured[0]) < _FARTHEST else 0.0
    return np.array([lon, (road.edges[0] + road.edges[-1]) / 2, 0.0, 0.0])
