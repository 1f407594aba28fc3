"""What the CommonRoad drivability checker says of a drive: collisions, the road, the vehicle model, start and goal.

The checker is the extra ``commonroad``. It judges the road by a triangulation where the package ``triangle`` is
installed, as the CommonRoad server does, and else by rectangles.
"""

from importlib import import_module
from importlib.util import find_spec

from commonroad.common.solution import Solution
from commonroad.planning.planning_problem import PlanningProblemSet

from coverdrive.driving.solving import Drive


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
    scenario, problems = drive.problem.scenario, PlanningProblemSet([drive.problem.problem])
    solution = Solution(scenario.scenario_id, [drive.solution()])

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
