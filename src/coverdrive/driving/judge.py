"""The CommonRoad drivability checker in a process of its own, for its triangulation ends the process on some roads, and
looks for lanes without end on others.

Run as a module it answers, one after another, what is asked of `judged`, until nobody asks any more.
"""

import os
import pickle
import signal
import sys
from importlib import import_module
from typing import Any

from commonroad.common.solution import PlanningProblemSolution, Solution
from commonroad.planning.planning_problem import PlanningProblem, PlanningProblemSet
from commonroad.scenario.scenario import Scenario

_LONGEST = 60
"""[s] after which the process ends"""


def judged(scenario: Scenario, problem: PlanningProblem, solved: PlanningProblemSolution, triangulated: bool) -> str:
    """Why the drivability checker refuses a solution; empty if it accepts it.

    Args:
        scenario: in which it was driven.
        problem: that it solves.
        solved: the solution.
        triangulated: whether the road is judged by a triangulation, as the CommonRoad server does, else by rectangles.
    """
    boundary = import_module("commonroad_dc.boundary.boundary")
    bodies = import_module("commonroad_dc.collision.collision_detection.pycrcc_collision_dispatch")
    checker = import_module("commonroad_dc.feasibility.solution_checker")
    problems, solution = PlanningProblemSet([problem]), Solution(scenario.scenario_id, [solved])

    def on_road() -> bool:
        if triangulated:
            return not checker.boundary_collision(scenario, problems, solution)
        driven = solution.create_dynamic_obstacle()[problem.planning_problem_id].prediction
        road = boundary.create_road_boundary_obstacle(scenario, method="obb_rectangles")[1]
        return not road.collide(bodies.create_collision_object(driven))

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


def _serve() -> None:
    """Answer on the standard output, on which nobody else writes, by a string or by what was raised."""
    answers, nowhere = os.fdopen(os.dup(1), "wb"), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    while True:
        try:
            asked = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        signal.alarm(_LONGEST)
        answer: Any
        try:
            answer = judged(*asked)
        except Exception as error:  # of another package
            answer = RuntimeError(f"{type(error).__name__}: {error}")
        signal.alarm(0)
        pickle.dump(answer, answers)
        answers.flush()


if __name__ == "__main__":
    _serve()
