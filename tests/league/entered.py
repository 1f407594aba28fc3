"""What the tests enter in the league."""

import numpy as np
from simulation_fakes import ConstantPlanner

from coverdrive.league.beliefs import ConstantVelocity
from coverdrive.planning.planner import MpcPlanner, PlannerSettings


def planner() -> ConstantPlanner:
    return ConstantPlanner(acceleration=-0.5)


def theirs(settings: PlannerSettings) -> MpcPlanner:
    return MpcPlanner(settings.model_copy(update={"lane_change": 0.0}))


def belief(settings: PlannerSettings) -> ConstantVelocity:
    half_width = settings.problem.vehicle.width / 2
    return ConstantVelocity(np.full((3, 2), half_width))


def gentle(acceleration: float = -0.25) -> ConstantPlanner:
    return ConstantPlanner(acceleration)


def gentler(*, acceleration: float = -0.125) -> ConstantPlanner:
    return ConstantPlanner(acceleration)


def told(acceleration: float = 0.0, settings: PlannerSettings | None = None) -> ConstantPlanner:
    return ConstantPlanner(acceleration if settings is None else settings.lane_change)


class Agent:
    """Brakes as long as anybody is ahead."""

    def __init__(self) -> None:
        self.periods: list[float] = []

    def reset(self, period: float) -> None:
        self.periods.append(period)

    def act(self, scene, road) -> tuple[float, float]:
        return -1.0 if (scene.lon[scene.valid] > scene.lon[0]).any() else 0.0, 0.0


def nobody() -> str:
    return "nobody"


number = 3
