"""FISS+ of the package ``fiss-planner``, by its own benchmark of CommonRoad's problems.

It follows its plans exactly, as a VW Vanagon without a vehicle model, and its benchmark judges: contacts by the
drivability checker, the road by rectangles, the goal as commonroad-io says.
"""

import warnings
from importlib import import_module
from importlib.util import find_spec

import numpy as np

from coverdrive.bridges.world import Car, Observation, watched
from coverdrive.driving.planning_problem import PlanningProblem
from coverdrive.simulation.drives.trace import Trace

FISS = {"fiss-future": "ground_truth", "fiss-constant-velocity": "constant_velocity"}
"""what it is told of the others, by the names of entrants: what they will do, or what they do now"""

_REASONS = {"success": "", "off_road": "off the road", "no_plan": "no plan", "timeout": "goal missed"}


def absent() -> str:
    """What is to be installed, if anything."""
    if find_spec("fiss_planner"):
        return ""
    return 'it needs fiss-planner; install it with `pip install "fiss-planner[commonroad]"`'


def drive(problem: PlanningProblem, told: str) -> tuple[Trace | None, str]:
    """Drive the first planning problem of a scenario.

    Args:
        problem: this one.
        told: one of the values of `FISS`.

    Returns:
        What was driven, as it was seen from outside, or None; and why the problem is not solved, if it is not.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            benchmark = import_module("fiss_planner.commonroad.benchmark")
            row, record = benchmark.run_scenario(str(problem.file), benchmark.Options(prediction=told), record=True)
    except Exception as error:  # of another package: one scenario that it cannot read must not stop the league
        return None, f"not driven: {type(error).__name__}: {error}"
    place, heading, dt = np.array(record["ego"]), np.array(record["yaw"]), float(problem.scenario.dt)
    reason = _REASONS.get(row["status"], str(row["status"]))
    if len(place) < 2:
        return None, reason
    speed = [*(step["ego"][3] for step in record["steps"]), float(np.hypot(*(place[-1] - place[-2]))) / dt]
    seen = [
        Observation((*place[k], speed[k], heading[k]), problem.others(problem.first + k), problem.road)
        for k in range(len(place))
    ]
    seconds = [1e-3 * step["plan_ms"] for step in record["steps"]]
    length, width = record["vehicle"]
    return watched(Car(length, width, dt), seen, seconds), reason
