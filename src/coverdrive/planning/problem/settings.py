"""The optimal control problem of the paper's §4: its settings."""

from pydantic import Field

from coverdrive.planning.problem.cost import CostSettings
from coverdrive.planning.problem.obstacles import ObstacleSettings
from coverdrive.planning.problem.tree import BranchSettings
from coverdrive.planning.problem.vehicle import VehicleSettings
from coverdrive.settings import Settings


class ProblemSettings(Settings):
    """Horizon, car, weights and shape of the obstacles."""

    steps: int = Field(default=12, ge=2, le=100)
    """K (authors' scripts: 3 s in steps of 0.25 s)"""
    dt: float = Field(default=0.25, ge=0.01, le=1)
    """[s] between two steps (authors' scripts)"""
    vehicle: VehicleSettings = VehicleSettings()
    """size and limits of the ego"""
    cost: CostSettings = CostSettings()
    """weights of the objective"""
    obstacles: ObstacleSettings = ObstacleSettings()
    """shape and choice of the obstacles"""
    branches: BranchSettings = BranchSettings()
    """how the drive branch and the fail-safe branch differ"""
