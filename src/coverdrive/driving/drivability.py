"""What the CommonRoad drivability checker says of a drive: collisions, the road, the vehicle model, start and goal.

The checker is the extra ``commonroad``. It judges the road by a triangulation where the package ``triangle`` is
installed, as the CommonRoad server does, and else by rectangles.
"""

from copy import deepcopy
from importlib import import_module
from importlib.util import find_spec

import numpy as np
from commonroad.common.solution import Solution
from commonroad.planning.planning_problem import PlanningProblemSet

from coverdrive.driving.solving import Drive

FARTHEST = 1e5
"""[m] from the origin of the map from which on a drive is judged where it is at the origin: the triangulation knows too
few digits, and ends the process"""


def refusal(drive: Drive) -> str | None:
    """Why the drivability checker refuses a drive; empty if it accepts it, None if it is not installed."""
    if find_spec("commonroad_dc") is None:
        return None
    boundary, bodies, checker = (
        import_module(f"commonroad_dc.{name}")
        for name in (
            "boundary.boundary",
            "collision.collision_detection.pycrcc_collision_dispatch",
            "feasibility.solution_checker",
        )
    )
    scenario, problem, solved = drive.problem.scenario, drive.problem.problem, drive.solution()
    if np.abs(problem.initial_state.position).max() > FARTHEST:
        back = -problem.initial_state.position
        scenario, problem = deepcopy((scenario, problem))
        for part in (scenario, problem, solved.trajectory):
            part.translate_rotate(back, 0.0)
    problems, solution = PlanningProblemSet([problem]), Solution(scenario.scenario_id, [solved])

    def on_road() -> bool:
        if find_spec("triangle"):
            return not checker.boundary_collision(scenario, problems, solution)
        body = bodies.create_collision_object(solution.create_dynamic_obstacle()[drive.problem.number].prediction)
        return not boundary.create_road_boundary_obstacle(scenario, method="obb_rectangles")[1].collide(body)

    checks = {
        "collision": lambda: not checker.obstacle_collision(scenario, problems, solution),
        "off the road": on_road,
        "not the vehicle model": lambda: all(
            feasible for feasible, *_ in checker.solution_feasible(solution, scenario.dt, problems).values()
        ),
        "another start": lambda: checker.starts_at_correct_state(solution, problems),
        "goal missed": lambda: checker.goal_reached(scenario, problems, solution),
    }
    for name, holds in checks.items():
        try:
            if not holds():
                return name
        except checker.SolutionCheckerException:
            return name
    return ""
