"""What a plan costs (paper §4: h, Q and the slack penalty c_k·γ_k²).

The cost of a plan is the sum over the steps of lane, speed and heading errors, inputs and changes of the inputs, a
terminal cost, and penalties of the slacks. The error of the current state is left out: no plan changes it. The weights
become factors of every step in `coverdrive.planning.problem.tree`.
"""

from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field

from coverdrive.settings import Settings

OFF_ROAD = 1e7
"""[1/m²] cost of the distance by which the body leaves the road; so much that the edge is a hard one"""
_URGENT_LANE, _URGENT_SPEED = 4.0, 8.0
"""factors on the weights of place and speed where these are urgent: a lane is changed in 3 s instead of 4, and a wanted
speed approached in half of the time"""

_FELT = 0.1
"""factor on the weights of heading and turning at walking pace"""


class CostSettings(Settings):
    """Weights of the squared errors; each is the cost of one unit during one step."""

    reference_speed: float = Field(default=40.0, ge=0, le=120)
    """[m/s] wanted speed (authors' scripts)"""
    curve_share: float = Field(default=0.5, gt=0, le=0.9)
    """of the largest lateral acceleration that following a curve may take at the wanted speed"""
    curve_braking: float = Field(default=1.5, gt=0, le=15)
    """[m/s²] at which it falls before a curve"""
    lane: float = Field(default=0.5, ge=0, le=1e6)
    """[1/m²] distance from the centre of the target lane"""
    speed: float = Field(default=0.1, ge=0, le=1e6)
    """[s²/m²] difference from the reference speed"""
    heading: float = Field(default=100.0, ge=0, le=1e6)
    """[1/rad²] angle between car and road"""
    acceleration: float = Field(default=0.1, ge=0, le=1e6)
    """[s⁴/m²]"""
    yaw_rate: float = Field(default=20.0, ge=0, le=1e6)
    """[s²/rad²]"""
    acceleration_change: float = Field(default=2.0, ge=0, le=1e6)
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

    def hurried(self) -> "CostSettings":
        """The weights of who has to be somewhere in time: place and speed count more, comfort as it did."""
        return self.model_copy(update={"lane": _URGENT_LANE * self.lane, "speed": _URGENT_SPEED * self.speed})

    def slow(self) -> "CostSettings":
        """The weights at walking pace: hurried, as what is gained in 3 s is little, and turning is hardly felt."""
        felt = {name: _FELT * getattr(self, name) for name in ("heading", "yaw_rate", "yaw_rate_change")}
        return self.hurried().model_copy(update=felt)

    def slack_weights(self, steps: int) -> Float[np.ndarray, " K"]:
        """The weights c_k of the K steps: the schedule spread evenly over the horizon."""
        return self.slack * np.array(self.slack_schedule)[np.arange(steps) * len(self.slack_schedule) // steps]
