"""How many problems do others solve? `python benchmarks/other_planners.py --out rows.json us101/ roads/`.

On the same problems as `problems.py`, without the recorded ego. Of the others they are told what they do now, at
constant speed and heading, or with ``--future`` what they will do.

``commonroad-reactive-planner`` samples polynomials along the reference path of ``commonroad-route-planner``. It drives
as it is configured by default, replanning every third step, and is judged by the same checker. As installed it ends
with an error where its coordinate system ends; here what lies beyond cannot be driven, and where that ends it still,
its reference path is made longer at both ends.

FISS+ of ``fiss-planner`` drives and is judged by the benchmark of its package (`coverdrive.league.fiss`).
"""

import argparse
import json
import logging
import time
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
from commonroad.common.solution import CostFunction, PlanningProblemSolution, VehicleModel, VehicleType
from commonroad.scenario.state import KSState
from commonroad.scenario.trajectory import Trajectory

from coverdrive.certificates.bounds import clopper_pearson
from coverdrive.driving.drivability import refusal
from coverdrive.driving.planning_problem import PlanningProblem, read_problems
from coverdrive.league import fiss
from coverdrive.recordings.files.scenario import scenarios_in
from coverdrive.recordings.tracks.reading import name_of
from problems import PLACES
from results import save

HORIZON, BEYOND = 6.0, 30.0
"""[s] of its plans, its default; [m] by which its reference path is longer at either end"""


def reactive(problem: PlanningProblem, future: bool) -> tuple[str, list[float]]:
    """Drive one problem: why it is not solved, if it is not, and the times [s] of its plans."""
    seconds = list[float]()
    states: list[Any] = []
    reason = ""
    for beyond in (0.0, BEYOND):
        reason = ""
        seconds.clear()
        try:
            states = list(_states(problem, future, seconds, beyond))
            break
        except Exception as error:  # of another package: one problem that it cannot drive must not stop the others
            reason = f"not driven: {type(error).__name__}: {error}"
    if reason:
        return reason, seconds
    if len(states) < 2:
        return "no plan", seconds
    path = Trajectory(problem.first, states)
    model, car = VehicleModel.KS, VehicleType.BMW_320i
    solution = PlanningProblemSolution(problem.number, model, car, CostFunction.SA1, path)
    refused = refusal(SimpleNamespace(problem=problem, solution=lambda: solution))  # pyright: ignore[reportArgumentType]
    return "no judge" if refused is None else refused, seconds


def fiss_plus(problem: PlanningProblem, future: bool) -> tuple[str, list[float]]:
    """As `reactive`. Its benchmark drives the first problem of a file, so that it gets one with this problem alone."""
    if absent := fiss.absent():
        return f"not driven: {absent}", []
    tree, kept = (
        ElementTree.parse(problem.file),
        {problem.number, *(int(each.obstacle_id) for each in problem.scenario.obstacles)},
    )
    for element in list(tree.getroot()):
        if ("bstacle" in element.tag or element.tag == "planningProblem") and int(element.attrib["id"]) not in kept:
            tree.getroot().remove(element)
    with TemporaryDirectory() as folder:
        tree.write(Path(folder) / problem.file.name, encoding="utf-8", xml_declaration=True)
        told = fiss.FISS["fiss-future" if future else "fiss-constant-velocity"]
        trace, reason = fiss.drive(replace(problem, file=Path(folder) / problem.file.name), told)
    return reason, [] if trace is None else trace.planning_seconds.tolist()


PLANNERS = {"reactive planner": reactive, "FISS+": fiss_plus}
"""name -> how it drives a problem"""


def _states(problem: PlanningProblem, future: bool, seconds: list[float], beyond: float) -> Iterator[KSState]:
    """Every state of the car from the start on, until the goal is reached, it is too late, or there is no plan."""
    boundary = import_module("commonroad_dc.boundary.boundary").create_road_boundary_obstacle(problem.scenario)[1]
    config = import_module("commonroad_rp.utility.config").ReactivePlannerConfiguration()
    dt, start = float(problem.scenario.dt), deepcopy(problem.problem)
    config.debug.multiproc, config.debug.logging_level = False, "CRITICAL"
    config.planning.dt, config.planning.time_steps_computation = dt, round(HORIZON / dt)
    config.planning.__post_init__()
    start.initial_state.acceleration = start.initial_state.acceleration or 0.0
    config.update(problem.scenario, start)
    planner = import_module("commonroad_rp.reactive_planner").ReactivePlanner(config)
    planner.set_reference_path(coordinate_system=_coordinates(problem.scenario.lanelet_network, start, beyond))
    along = None
    while True:
        planner.reset(
            initial_state_cart=planner.x_0, initial_state_curv=along, coordinate_system=planner.coordinate_system,
            collision_checker=_others(problem, int(planner.x_0.time_step), planner.N, future, boundary),
        )  # fmt: skip
        if not seconds:
            yield _centred(planner)
        planner.set_desired_velocity(current_speed=planner.x_0.velocity)
        begun = time.perf_counter()
        found = planner.plan()
        seconds.append(time.perf_counter() - begun)
        if found is None:
            return
        for k in range(1, config.planning.replanning_frequency + 1):
            planner.x_0, along = found[0].state_list[k], (found[1][k], found[2][k])
            yield _centred(planner)
            if planner.goal_reached() or planner.x_0.time_step >= problem.last:
                return


def _coordinates(network: Any, problem: Any, beyond: float) -> Any:
    """Along the planner's own reference path, longer by a way [m]; what lies beside is nowhere instead of an error."""
    theirs: Any = import_module("commonroad_rp.utility.utils_coordinate_system")
    path = theirs.create_initial_ref_path(network, problem)
    if beyond > 0:
        first, last = (beyond * (one - other) / np.hypot(*(one - other)) for one, other in (path[:2], path[:-3:-1]))
        path = np.concatenate([[path[0] + first], path, [path[-1] + last]])
    system = theirs.create_coordinate_system(path)

    class Ending(type(system)):  # pyright: ignore[reportUntypedBaseClass]
        def convert_to_cartesian_coords(self, s: float, d: float) -> Any:
            try:
                return super().convert_to_cartesian_coords(s, d)
            except Exception:  # its kinds differ between versions
                return None

    system.__class__ = Ending
    return system


def _others(problem: PlanningProblem, now: int, steps: int, future: bool, boundary: Any) -> Any:
    """A collision checker of the road's edge and the others from a time step on."""
    bodies: Any = import_module("commonroad_dc.pycrcc")
    checker, dt = bodies.CollisionChecker(), float(problem.scenario.dt)
    checker.add_collision_object(boundary)
    seen = problem.others(now)
    coming = [problem.others(now + k) for k in range(steps + 1)] if future else []
    for name, ((x, y, speed, heading), (length, width)) in seen.items():
        way = dt * speed * np.array([np.cos(heading), np.sin(heading)])
        moving = bodies.TimeVariantCollisionObject(now)
        for k in range(steps + 1):
            if future and name not in coming[k]:
                break
            place = coming[k][name][0] if future else (x + k * way[0], y + k * way[1], speed, heading)
            moving.append_obstacle(bodies.RectOBB(length / 2, width / 2, place[3], *place[:2]))
        checker.add_collision_object(moving)
    return checker


def _centred(planner: Any) -> KSState:
    """The state of the planner, at the centre of the car."""
    state = planner.x_0.shift_state_to_center(planner.x_0, planner.vehicle_params.wb_rear_axle)
    return KSState(
        time_step=int(state.time_step), position=state.position, velocity=float(state.velocity),
        orientation=float(state.orientation), steering_angle=float(state.steering_angle),
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", type=Path, nargs="+")
    parser.add_argument("--future", action="store_true", help="it is told what the others will do")
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        help="a JSON file of all rows, written as they are made; those that are there are not driven again",
    )
    parser.add_argument("--save", help="name of the file in benchmarks/results")
    given = parser.parse_args()
    logging.disable(logging.CRITICAL)
    rows = json.loads(given.out.read_text(encoding="utf-8")) if given.out.exists() else []
    there = {(row["scenario"], row["problem"]) for row in rows}
    for file in scenarios_in(given.scenarios):
        for problem in read_problems(file):
            row: dict[str, Any] = {"scenario": name_of(file), "problem": getattr(problem, "number", None)}
            if tuple(row.values()) in there:
                continue
            for name, drive in PLANNERS.items():
                driven = isinstance(problem, PlanningProblem)
                reason, seconds = drive(problem, given.future) if driven else (f"not driven: {problem}", [])
                rows.append(row | {"planner": name, "reason": reason, "seconds": seconds})
                print(*row.values(), f"{name}: {reason or 'solved'}", flush=True)
            given.out.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    found = {name: by_place([row for row in rows if row["planner"] == name]) for name in PLANNERS}
    for name, places in found.items():
        print(name, {place: f"{each['solved']} of {each['problems']}" for place, each in places.items()})
    if given.save:
        save(given.save, found)


def by_place(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Of those on US-101, and of those elsewhere, if there are any: how many are solved, and why the others are not."""
    found = dict[str, Any]()
    for here, name in PLACES.items():
        if part := [row for row in rows if row["scenario"].startswith("USA_US101") == here]:
            solved, seconds = sum(not row["reason"] for row in part), [each for row in part for each in row["seconds"]]
            found[name] = {
                "problems": len(part),
                "solved": solved,
                "share": [solved / len(part), *clopper_pearson(solved, len(part))],
                "step [ms], median": 1e3 * float(np.median(seconds)) if seconds else None,
                "not solved": [[row["scenario"], row["problem"], row["reason"]] for row in part if row["reason"]],
            }
    return found


if __name__ == "__main__":
    main()
