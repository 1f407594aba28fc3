"""Manners: the distances to others that a plan keeps where it can, though it would be clear without them; and how fast
it changes lanes.

Everybody is in a second box, which reaches as far ahead and behind as its vehicle comes in the wished time headway, and
farther if the ego is faster: neither comes the ego that near to whoever is ahead, nor leaves it less to those behind
it in a lane that it enters. Behind somebody who is nearer than that in its way, or comes into it, all of this is asked
for only as far as the ego gets by slowing down calmly. To be in such a box costs along the drive branch; it is never a
contact, and never decides whether a plan is clear. Whoever is directly behind in the ego's own lane keeps the distance
itself.
Through a short gap that would be hurried; so sideways, along the drive branch, the ego is not to be faster than people
are.
"""

from typing import Literal

import numpy as np
from jaxtyping import Bool, Float
from pydantic import Field

from coverdrive.compiled import compiled
from coverdrive.planning.problem.obstacles import BRAKE_TO, FALL, FAR, LIKELIHOOD
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.settings import Settings

_WEIGHT = 1000.0
"""cost of being in the middle of such a box for a step: as much as 100 m/s less than wanted"""

_EASE = 2.0
"""[m/s²] at which the ego is taken to slow down for others; comfortable"""
_STANDING, _ROOM = 0.5, 3.0
"""[m/s] of who stands now, and [m] behind it besides what is kept clear, so that there is room to pull out"""


class MannersSettings(Settings):
    """How near the ego comes to others if it need not."""

    like: Literal["human", "regulation", "paper"] = "human"
    """people, as the numbers below say; these with the time headways of UN Regulation No. 157 (1 s at standstill, a
    tenth more for every 10 km/h, 1.6 s from 60 km/h on); or the paper, which has no such wishes"""
    headway: float = Field(default=0.72, ge=0, le=10)
    """[s] time headway of people in nine of ten moments, as recorded on US-101; a fit to recordings takes theirs"""
    beside: float = Field(default=0.98, ge=0, le=10)
    """[m] to those alongside, as well"""
    time_to_collision: float = Field(default=3.7, ge=0, le=60)
    """[s] until contact if all keep their velocity, as well"""
    sideways: float = Field(default=1.71, gt=0, le=10)
    """[m/s] that people reach at the most in nine of ten lane changes, as well"""

    @property
    def fastest_sideways(self) -> float:
        """[m/s] that is not to be exceeded."""
        return np.inf if self.like == "paper" else self.sideways


NONE = MannersSettings(like="paper")
"""nothing is wished for"""


def wished(
    boxes: Float[np.ndarray, "7 P n"], state: Float[np.ndarray, " 4"], width: float, manners: MannersSettings
) -> Bool[np.ndarray, " n"]:
    """Of which vehicles the ego is to keep a distance: of nobody, or of all but the one behind in its way.

    Args:
        boxes: where vehicles are likely to be, lon from that of the ego.
        state: of the ego.
        width: [m] of the ego.
        manners: what is wished for.
    """
    if manners.like == "paper":
        return np.zeros(boxes.shape[2], dtype=bool)
    return (boxes[0, 0] >= 0) | (np.abs(boxes[1, 0] - state[1]) >= boxes[3, 0] + width / 2)


def widen(
    boxes: Float[np.ndarray, "7 P n"],
    first: int,
    state: Float[np.ndarray, " 4"],
    problem: ProblemSettings,
    manners: MannersSettings,
) -> None:
    """Let boxes, from the first of these on, become those that an ego in a state is not to be in.

    Of the problem the slack weights count, of which the last row says the share that being in a box costs.
    """
    slack = problem.cost.slack_weights(problem.steps)
    headway = -1.0 if manners.like == "regulation" else manners.headway
    own = state[1], state[2], problem.vehicle.length, problem.vehicle.width, problem.obstacles.inflation
    _widen(boxes, first, own, slack, headway, manners.time_to_collision, manners.beside, problem.dt)


@compiled
def _headway(asked: float, speed: float) -> float:
    """[s] behind who drives at a speed [m/s], of the regulation if none is asked for."""
    return asked if asked >= 0 else min(max(1 + 0.036 * speed, 1.0), 1.6)  # 5.2.3.3: a tenth more for every 10 km/h


@compiled
def _widen(
    boxes: Float[np.ndarray, "7 P n"], begin: int, own: tuple[float, float, float, float, float],
    slack: Float[np.ndarray, " K"], headway: float, time_to_collision: float, beside: float, dt: float,
) -> None:  # fmt: skip
    """Let boxes reach as far as is wished for; of the ego lat, speed, length, width and the inflation are given."""
    moments = boxes.shape[1]
    lat, own_speed, length, width, inflation = own
    for i in range(begin, boxes.shape[2]):
        stands = boxes[0, 1, i] - boxes[0, 0, i] < _STANDING * dt
        for k in range(moments):
            ahead = boxes[0, 0, i] >= 0 and abs(boxes[1, k, i] - lat) < boxes[3, k, i] + width / 2
            first, last = max(k - 1, 0), min(k + 1, moments - 1)
            speed = max((boxes[0, last, i] - boxes[0, first, i]) / (dt * (last - first)), 0.0)
            closing = max(own_speed - _EASE * dt * k - speed, 0.0)
            reach = _headway(headway, speed) * speed + time_to_collision * closing
            if ahead:
                reach = max(reach, _ROOM if stands else 0.0)
                time = min(dt * k, own_speed / _EASE)
                eased = (own_speed - _EASE * time / 2) * time
                reach = min(reach, max((boxes[0, k, i] - eased) / inflation - boxes[2, k, i] - length / 2, 0.0))
            boxes[2, k, i] += reach
            boxes[3, k, i] += beside
            boxes[BRAKE_TO, k, i], boxes[FALL, k, i] = FAR, 0.0
            if k > 0:
                boxes[LIKELIHOOD, k, i] = _WEIGHT / slack[k - 1] if slack[k - 1] > 0 else 0.0
