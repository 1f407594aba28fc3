"""CommonRoad problems of recorded vehicles. `python benchmarks/recorded_problems.py scenarios/ made/` writes them.

Each begins where a recorded vehicle, which is taken out, begins. The goal is to be where it was when it left, 8 m by
2.4 m, within the second before that, at its speed ±3 m/s: somebody has driven it, where our car would have been on the
road and have touched nobody, and nobody has chosen it. From each scenario come the first 6 cars that change lanes, and
3 drawn ones that do not. `problems.py` solves them. Both need the extra `commonroad`.
"""

import argparse
import warnings
from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path

import numpy as np
from commonroad.common.file_reader import CommonRoadFileReader
from commonroad.common.file_writer import CommonRoadFileWriter, OverwriteExistingFile
from commonroad.common.util import Interval
from commonroad.geometry.shape import Rectangle
from commonroad.planning.goal import GoalRegion
from commonroad.planning.planning_problem import PlanningProblem, PlanningProblemSet
from commonroad.prediction.prediction import TrajectoryPrediction
from commonroad.scenario.obstacle import DynamicObstacle
from commonroad.scenario.scenario import Scenario
from commonroad.scenario.state import CustomState, InitialState
from shapely import Polygon, prepare, unary_union

from coverdrive.driving.single_track import BMW

CHANGING, KEEPING = 6, 3
"""vehicles of a scenario"""
LONGEST, SHORTEST = 6.5, 6.0
"""[m] of a car, and [s] of a problem"""
PLACE, SECOND, SPEED = (8.0, 2.4), 1.0, 3.0
"""[m] of the goal, [s] in which to be there, [m/s] by which the speed may differ"""
ROUNDING = 0.01
"""[m] by which lanes are apart that touch"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", type=Path, nargs="+", help="files, or folders of files")
    parser.add_argument("folder", type=Path, help="where problems are written")
    parser.add_argument("--seed", type=int, default=5)
    given = parser.parse_args()
    rng, count = np.random.default_rng(given.seed), 0
    given.folder.mkdir(parents=True, exist_ok=True)
    for file in [
        each for path in given.scenarios for each in (sorted(path.glob("*.xml")) if path.is_dir() else [path])
    ]:
        for scenario, problem in problems(CommonRoadFileReader(file).open()[0], rng):
            writer = CommonRoadFileWriter(scenario, problem, author="", affiliation="", source="", tags=set())
            with warnings.catch_warnings():
                warnings.filterwarnings("ignore", "<CommonRoadFileWriter/lanelet")  # most maps say no type
                writer.write_to_file(f"{given.folder}/{scenario.scenario_id}.xml", OverwriteExistingFile.ALWAYS)
            count += 1
    print(f"{count} problems are in {given.folder}")


def problems(scenario: Scenario, rng: np.random.Generator) -> Iterator[tuple[Scenario, PlanningProblemSet]]:
    """The problems of a scenario, whose lanes and obstacles remain but for the vehicle that is taken out."""
    network, road = scenario.lanelet_network, _road(scenario)
    prepare(road)
    found: dict[bool, list[DynamicObstacle]] = {True: [], False: []}
    for each in scenario.dynamic_obstacles:
        if not isinstance(each.prediction, TrajectoryPrediction) or each.obstacle_shape.length > LONGEST:
            continue
        first, last = each.initial_state, each.prediction.trajectory.final_state
        there, goal = network.find_lanelet_by_position([first.position, last.position])
        if not (there and goal) or (last.time_step - first.time_step) * scenario.dt < SHORTEST:
            continue
        if _drivable(each, scenario, road):
            found[not set(goal) & set(_onward(scenario, there))].append(each)
    drawn = [found[False][i] for i in rng.permutation(len(found[False]))[:KEEPING]]
    for number, vehicles in ((2, found[True][:CHANGING]), (3, drawn)):
        for each in vehicles:
            left = deepcopy(scenario)
            left.remove_obstacle(left.obstacle_by_id(each.obstacle_id))
            left.scenario_id.configuration_id, left.scenario_id.prediction_id = number, each.obstacle_id
            yield left, PlanningProblemSet([_problem(each, scenario.dt)])


def _problem(vehicle: DynamicObstacle, dt: float) -> PlanningProblem:
    first, last = vehicle.initial_state, vehicle.prediction.trajectory.final_state
    begin = max(last.time_step - round(SECOND / dt), first.time_step + 1)
    goal = CustomState(
        time_step=Interval(begin, last.time_step),
        position=Rectangle(*PLACE, last.position, last.orientation),
        velocity=Interval(max(0.0, last.velocity - SPEED), last.velocity + SPEED),
    )
    start = InitialState(
        time_step=first.time_step, position=first.position, orientation=first.orientation,
        velocity=max(0.0, first.velocity), acceleration=0.0, yaw_rate=0.0, slip_angle=0.0,
    )  # fmt: skip
    return PlanningProblem(90_000 + vehicle.obstacle_id, start, GoalRegion([goal]))


def _road(scenario: Scenario) -> Polygon:
    return unary_union([each.polygon.shapely_object.buffer(ROUNDING) for each in scenario.lanelet_network.lanelets])


def _drivable(vehicle: DynamicObstacle, scenario: Scenario, road: Polygon) -> bool:
    """Whether our car where the vehicle was would have been on the road and have touched nobody."""
    others = [each for each in scenario.dynamic_obstacles if each.obstacle_id != vehicle.obstacle_id]
    for state in (vehicle.initial_state, *vehicle.prediction.trajectory.state_list):
        body = Rectangle(BMW.l, BMW.w, state.position, state.orientation).shapely_object
        there = (each.occupancy_at_time(state.time_step) for each in others)
        if not road.contains(body) or any(each and body.intersects(each.shape.shapely_object) for each in there):
            return False
    return True


def _onward(scenario: Scenario, lanelets: list[int]) -> list[int]:
    """These lanelets, and all to which they lead."""
    found = list(lanelets)
    for each in found:
        found += [to for to in scenario.lanelet_network.find_lanelet_by_id(each).successor if to not in found]
    return found


if __name__ == "__main__":
    main()
