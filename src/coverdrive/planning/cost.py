"""What a plan costs (paper §4: h, Q and the slack penalty c_k·γ_k²).

The cost of a plan is the sum over the steps of lane, speed and heading errors, inputs and changes of the inputs, a
terminal cost, and penalties of the slacks. The error of the current state is left out: no plan changes it.
`state_cost` and `input_cost` are plain arithmetic, so that the optimisation problem uses them with symbols.
P = K + 1 is the number of states.
"""

from typing import Annotated, Any

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.settings import Settings


class CostSettings(Settings):
    """Weights of the squared errors; each is the cost of one unit during one step."""

    reference_speed: float = Field(default=40.0, ge=0, le=120)
    """[m/s] wanted speed (authors' scripts)"""
    lane: float = Field(default=0.5, ge=0, le=1e6)
    """[1/m²] distance from the centre of the target lane"""
    speed: float = Field(default=0.05, ge=0, le=1e6)
    """[s²/m²] difference from the reference speed"""
    heading: float = Field(default=20.0, ge=0, le=1e6)
    """[1/rad²] angle between car and road"""
    acceleration: float = Field(default=0.1, ge=0, le=1e6)
    """[s⁴/m²]"""
    yaw_rate: float = Field(default=20.0, ge=0, le=1e6)
    """[s²/rad²]"""
    acceleration_change: float = Field(default=0.2, ge=0, le=1e6)
    """[s⁴/m²] difference of the accelerations of two steps"""
    yaw_rate_change: float = Field(default=50.0, ge=0, le=1e6)
    """[s²/rad²] difference of the yaw rates of two steps"""
    terminal: float = Field(default=5.0, ge=0, le=1e6)
    """factor on the errors of the last state"""
    slack: float = Field(default=1000.0, gt=0, le=1e9)
    """cost of one unit of obstacle slack, times `slack_schedule`"""
    slack_schedule: tuple[Annotated[float, Field(ge=0, le=1e6)], ...] = Field(
        default=(400.0, 200.0, 100.0, 50.0, 10.0), min_length=1, max_length=100
    )
    """weights of the slack from the first to the last part of the horizon (authors' scripts)"""
    off_road: float = Field(default=1e7, gt=0, le=1e9)
    """[1/m²] distance by which the body leaves the road; so much that the edge is a hard one"""

    def slack_weights(self, steps: int) -> Float[np.ndarray, " K"]:
        """The weights c_k of the K steps: the schedule spread evenly over the horizon."""
        parts = np.arange(steps) * len(self.slack_schedule) // steps
        return self.slack * np.asarray(self.slack_schedule)[parts]


def state_cost(lat_error: Any, speed: Any, heading: Any, settings: CostSettings) -> Any:
    """Cost of being in a state for one step.

    Args:
        lat_error: [m] from the centre of the target lane.
        speed: [m/s].
        heading: [rad].
        settings: the weights.
    """
    return (
        settings.lane * lat_error**2
        + settings.speed * (speed - settings.reference_speed) ** 2
        + settings.heading * heading**2
    )


def input_cost(
    acceleration: Any, yaw_rate: Any, acceleration_change: Any, yaw_rate_change: Any, settings: CostSettings
) -> Any:
    """Cost of the inputs of one step and of their changes since the step before.

    Args:
        acceleration: [m/s²].
        yaw_rate: [rad/s].
        acceleration_change: [m/s²].
        yaw_rate_change: [rad/s].
        settings: the weights.
    """
    return (
        settings.acceleration * acceleration**2
        + settings.yaw_rate * yaw_rate**2
        + settings.acceleration_change * acceleration_change**2
        + settings.yaw_rate_change * yaw_rate_change**2
    )


def plan_cost(
    states: Float[Any, "*n P 4"],
    inputs: Float[Any, "*n K 2"],
    slack: Float[Any, "*n K"],
    off_road: Float[Any, "*n K"],
    previous_input: Float[Any, " 2"],
    target_lat: Float[Any, "*n"] | float,
    settings: CostSettings,
) -> Float[Any, "*n"]:
    """The objective of the optimal control problem for given plans.

    Args:
        states: lon [m], lat [m], speed [m/s], heading [rad].
        inputs: acceleration [m/s²], yaw rate [rad/s].
        slack: γ_k of the steps k = 1 … K.
        off_road: [m] by which the body leaves the road at the steps k = 1 … K.
        previous_input: the input applied before the plan starts.
        target_lat: [m] centre of the target lane.
        settings: the weights.

    Returns:
        The cost of every plan.
    """
    steps = inputs.shape[-2]
    before = np.broadcast_to(previous_input, (*inputs.shape[:-2], 1, 2))
    changes = np.diff(np.concatenate([before, inputs], axis=-2), axis=-2)
    lat_error = states[..., 1:, 1] - np.asarray(target_lat)[..., None]
    weight = np.ones(steps)
    weight[-1] = settings.terminal
    cost = weight * state_cost(lat_error, states[..., 1:, 2], states[..., 1:, 3], settings)
    cost = cost + input_cost(inputs[..., 0], inputs[..., 1], changes[..., 0], changes[..., 1], settings)
    cost = cost + settings.slack_weights(steps) * slack**2 + settings.off_road * off_road**2
    return cost.sum(axis=-1)
