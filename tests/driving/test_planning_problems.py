"""Planning problems of a drawn scenario: what is read of them, how they are driven, and what is written."""

import os
import pickle
import re
import signal
import subprocess
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from commonroad.common.solution import CommonRoadSolutionReader
from driving_fakes import PREDICTOR
from problem_fakes import TRAFFIC, between, box, goal, written
from recordings_fakes import RADIUS, TURN, driving, on_map, scenario, state, three_lanes, vehicle
from shapely.geometry import Point

from coverdrive.driving import drivability
from coverdrive.driving.batch import TABLE, solve_all
from coverdrive.driving.drivability import refusal
from coverdrive.driving.obstacles import shape_of, told
from coverdrive.driving.planning_problem import PlanningProblem, read_problems
from coverdrive.driving.single_track import BMW, SingleTrackCar
from coverdrive.driving.solved import solve
from coverdrive.driving.solving import Drive, drive, settings_for
from coverdrive.errors import RecordingError
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.planning.rules.manners import NONE


def read(path: Path) -> PlanningProblem:
    (found,) = read_problems(path)
    assert isinstance(found, PlanningProblem)
    return found


def test_a_place_is_told_by_lane_way_time_and_speed(tmp_path: Path) -> None:
    found = read(written(tmp_path, goal(box(90.0, -5.25), between("velocity", 10.0, 16.0))))
    wanted = found.goal
    assert (wanted.lanes, wanted.lat) == ((1,), None)
    assert wanted.position == pytest.approx((87.0, 93.0), abs=0.1)
    assert (wanted.time, wanted.speed) == ((5.0, 6.0), (10.0, 16.0))
    assert (found.number, found.first, found.last) == (7, 0, 60)
    aside = read(written(tmp_path, goal(box(90.0, -6.2, width=1.6)))).goal
    assert (aside.lanes, aside.lat) == (1, pytest.approx(11 - 6.2 + 0.4, abs=0.05))


def turned(at: float, left: float, length: float, width: float) -> str:
    """A rectangle, 24° against the road."""
    along = TURN + at / RADIUS
    return box(at, left, length, width).replace(f"<orientation>{along}", f"<orientation>{along + 0.42}")


def circle(at: float, left: float, radius: float) -> str:
    (x, y), *_ = on_map(np.array([at]), left)
    shape = f"<circle><radius>{radius}</radius><center><x>{x}</x><y>{y}</y></center></circle>"
    return f"<position>{shape}</position>"


@pytest.mark.parametrize(
    ("place", "lanes", "way"),
    [
        (turned(90.0, -5.25, 50.0, 3.0), (1,), 7.4),
        (turned(90.0, -5.25, 50.0, 10.0), (1, 2), 15.9),
        (turned(90.0, -6.4, 50.0, 3.0), (1,), 7.4),
        (circle(90.0, -5.25, 5.0), (0, 1, 2), 6.6),
        (circle(90.0, -5.25, 3.8), (1,), 7.6),
    ],
)
def test_a_goal_is_as_long_as_the_way_in_its_lanes(
    place: str, lanes: tuple[int, ...], way: float, tmp_path: Path
) -> None:
    found = read(written(tmp_path, goal(place)))
    wanted, ((state, _),) = found.goal, found.goals
    assert wanted.any_lane == lanes and wanted.position is not None
    assert wanted.position[1] - wanted.position[0] == pytest.approx(way, abs=1.0)
    for lane in lanes:
        lat = found.road.centres[lane] if wanted.lat is None else wanted.lat
        ends = zip(*found.road.to_map(np.array(wanted.position), np.full(2, lat)), strict=True)
        assert all(shape_of(state.position).distance(Point(*end)) < 1.0 for end in ends)


def test_lanelets_and_the_nearest_of_several_goals(tmp_path: Path) -> None:
    far, near = goal('<position><lanelet ref="30"/></position>'), goal('<position><lanelet ref="21"/></position>')
    wanted = read(written(tmp_path, far, near)).goal
    assert wanted.lanes == (1,)
    assert wanted.position == pytest.approx((110.0, 180.0), abs=1.0)
    at_once = read(written(tmp_path, goal(first=50, last=50)))
    assert (at_once.goal.time, at_once.last) == ((5.0, 5.0), 50)
    anywhere = read(written(tmp_path, goal())).goal
    assert (anywhere.lanes, anywhere.position, anywhere.time) == ((), None, (5.0, 6.0))


@pytest.mark.parametrize(
    "hopeless",
    [
        goal(box(90.0, -1.75), first=5, last=8),
        goal(box(8.0, -1.75, length=4.0)),
        goal(between("velocity", 35.0, 40.0), first=20, last=60),
    ],
    ids=["too far", "behind", "too fast"],
)
def test_goals_that_cannot_be_met_come_last(tmp_path: Path, hopeless: str) -> None:
    other = goal(box(90.0, -9.0))
    found = read(written(tmp_path, hopeless, other))
    assert len(found.goals) == 2 and found.goal.lanes == (0,)
    assert read(written(tmp_path, hopeless)).goal.lanes != (0,)


def test_a_goal_that_is_over_before_the_start_comes_last(tmp_path: Path) -> None:
    over, other = goal(box(90.0, -1.75), first=0, last=10), goal(box(90.0, -9.0))
    path = written(tmp_path, over, other)
    path.write_text(re.sub(r"(<planningProblem.*?<time><exact>)0<", r"\g<1>20<", path.read_text(), flags=re.DOTALL))
    found = read(path)
    assert (found.first, found.goal.lanes) == (20, (0,))


def test_goals_off_the_road_are_left_out_if_another_one_is_on_it(tmp_path: Path) -> None:
    away = goal(box(60.0, 900.0))
    for other in (goal(box(60.0, -1.75)), goal(between("velocity", 10.0, 20.0))):
        found, alone = (read(written(tmp_path, *goals)) for goals in ((away, other), (other,)))
        assert found.goal == alone.goal and len(found.goals) == 1
    with pytest.raises(RecordingError, match="the goal is not on the road"):
        _ = read(written(tmp_path, away, away)).goal


def test_a_goal_at_the_time_of_the_start_is_refused(tmp_path: Path) -> None:
    (found,) = read_problems(written(tmp_path, goal(first=0, last=0)))
    assert isinstance(found, RecordingError) and "its goal is at 0 s after the start" in str(found)


def test_suffixes_may_be_capitals(tmp_path: Path) -> None:
    file = written(tmp_path, goal())
    assert read(file.rename(file.with_suffix(".XML"))).number == 7


def test_of_a_goal_in_parts_the_next_one_ahead_is_looked_at(tmp_path: Path) -> None:
    def parts(*some: str) -> str:
        shapes = "".join(part.removeprefix("<position>").removesuffix("</position>") for part in some)
        return goal(f"<position>{shapes}</position>")

    behind, near, far = box(20.0, -9.0, length=10.0), box(80.0, -5.25, length=10.0), box(160.0, -5.25, length=10.0)
    wanted = read(written(tmp_path, parts(far, near))).goal
    assert (wanted.lanes, wanted.lat) == ((1,), None)
    assert wanted.position == pytest.approx((75.0, 85.0), abs=0.1)
    assert read(written(tmp_path, parts(behind, near), at=40.0)).goal.lanes == (1,)
    assert read(written(tmp_path, parts(behind, near), at=20.0)).goal.lanes == (0,)
    with pytest.raises(RecordingError, match="the goal is not on the road"):
        _ = read(written(tmp_path, parts(box(20.0, 60.0), box(80.0, 60.0)))).goal


@pytest.mark.parametrize("left", [-5.26, -5.28])
def test_a_goal_may_be_a_centimetre_wide(left: float, tmp_path: Path) -> None:
    wanted = read(written(tmp_path, goal(box(90.0, left, length=0.01, width=0.01)))).goal
    assert (wanted.lanes, wanted.lat) == (1, pytest.approx(11 + left, abs=0.01))
    assert wanted.position == pytest.approx((90.0, 90.0), abs=0.02)


def test_the_recorded_ego_and_vehicles_beside_the_road_are_no_others(tmp_path: Path) -> None:
    traffic = TRAFFIC + driving(90_007, 20.1, -1.7, 14.2, 60) + driving(102, 150.0, -15.0, 10.0, 20)
    found = read(written(tmp_path, goal(), traffic=traffic))
    others = found.others(10)
    assert set(others) == {100, 101}
    (x, y, speed, heading), size = others[100]
    assert (x, y) == pytest.approx(tuple(on_map(np.array([104.0]), -1.75)[0]), abs=1e-3)
    assert (speed, size) == (14.0, (4.6, 1.9))
    assert heading == pytest.approx(TURN + 104 / RADIUS, abs=1e-3)
    assert set(found.others(40)) == {100}


def coming(number: int, at: float, left: float, across: float, size: str = "4.6") -> str:
    """A car that drives across the road at a speed [m/s], to the left if that is positive."""
    heading = TURN + at / RADIUS + np.pi / 2 * np.sign(across)
    tags = ["initialState", *["state"] * 59]
    states = [state(at, left + across * moment / 10, abs(across), moment, tag) for moment, tag in enumerate(tags)]
    turned = [re.sub(r"(<orientation><exact>)[^<]*", rf"\g<1>{heading:.4f}", each) for each in states]
    return vehicle(number, turned).replace("<length>4.6", f"<length>{size}")


def test_who_comes_from_beside_the_road_is_told_in_time_and_who_passes_by_is_not(tmp_path: Path) -> None:
    """The road is 11 m wide; a car is told of 1 s before it comes to 1.8 m beside it, or as it reaches over."""
    beside = {
        105: coming(105, 80.0, -21.0, 5.0),
        106: coming(106, 80.0, 8.0, -4.0),
        107: coming(107, 120.0, -21.0, -5.0),
        108: driving(108, 60.0, -14.0, 10.0, 60),
        109: coming(109, 50.0, -19.0, 0.5, "18.0"),
    }
    found = read(written(tmp_path, goal(), traffic=TRAFFIC + "".join(beside.values())))
    seen = {number: [moment for moment in range(60) if number in found.others(moment)] for number in beside}
    assert seen[105][0] == 7 and seen[106][0] == 6  # after 10 − 1.8 − 5 of 5, and 8 − 1.8 − 4 of 4 metres per second
    assert not seen[107] and not seen[108]
    assert seen[109] == list(range(60))  # its nose is on the road from the beginning


def test_the_trailer_of_the_recorded_ego_is_a_part_of_it(tmp_path: Path) -> None:
    ego, trailer = driving(90_007, 20.1, -1.7, 14.2, 60), driving(103, 16.5, -1.7, 14.2, 60)
    behind = driving(104, 10.0, -1.7, 14.2, 60)
    assert set(read(written(tmp_path, goal(), traffic=TRAFFIC + ego + trailer + behind)).others(10)) == {100, 101, 104}
    assert 103 in read(written(tmp_path, goal(), traffic=TRAFFIC + trailer)).others(10)


def test_what_is_none_is_said(tmp_path: Path) -> None:
    (found,) = read_problems(written(tmp_path, goal(), left=30.0))
    assert isinstance(found, RecordingError) and "planning problem 7: the start is on no road" in str(found)
    (tmp_path / "none.xml").write_text(scenario(three_lanes(), TRAFFIC))
    with pytest.raises(RecordingError, match="no planning problem"):
        next(read_problems(tmp_path / "none.xml"))
    (row,) = (each.row for each in solve(tmp_path / "none.xml", PREDICTOR))
    assert not row["solved"] and "no planning problem" in row["reason"]


@pytest.mark.parametrize("model", ["KS", "ST"])
def test_a_lane_change_in_time_is_driven_written_and_accepted(tmp_path: Path, model) -> None:
    wanted = goal(box(95.0, -5.25, length=4.0), between("velocity", 10.0, 16.0), between("orientation", 0.65, 0.85))
    path, drives = written(tmp_path, wanted), list[Drive]()
    ((row,),) = solve_all(
        [path], lambda _: PREDICTOR, tmp_path / "out", model, draw=lambda drive, _: drives.append(drive)
    )
    (found,) = drives
    assert found.reached
    assert row["solved"] and row["reason"] == "" and row["model"] == model
    assert 50 <= len(found.cars) - 1 <= 60
    assert row["checked"] is (find_spec("commonroad_dc") is not None)
    table = tmp_path / "out" / TABLE
    assert table.read_text().splitlines()[1].startswith(f"USA_Test-1_1_T-1,7,{model},true,")
    solution = CommonRoadSolutionReader.open(str(tmp_path / "out" / "solution_USA_Test-1_1_T-1.xml"))
    (only,) = solution.planning_problem_solutions
    assert (solution.benchmark_id, only.planning_problem_id) == (f"{model}2:SA1:USA_Test-1_1_T-1:2020a", 7)
    read_again = np.array([state.position for state in only.trajectory.state_list])
    assert read_again == pytest.approx(np.array([car.pose[:2] for car in found.cars]), abs=1e-6)


@pytest.mark.parametrize(
    ("wanted", "lack"),
    [
        (goal(box(180.0, -1.75)), "not far enough"),
        (goal(box(90.0, -9.0), first=4, last=5), "other lane, not far enough"),
        (goal(box(40.0, -0.4, length=4.0, width=0.4), first=5, last=20), "beside it"),
        (goal(box(55.0, -1.75, length=70.0), between("velocity", 30.0, 31.0), first=20, last=21), "speed"),
        (goal(box(55.0, -1.75, length=70.0), between("orientation", 0.0, 0.2), first=20, last=21), "heading"),
        (goal(between("orientation", 0.0, 0.2), first=20, last=21), "heading"),
    ],
)
def test_what_is_lacking_is_said(tmp_path: Path, wanted: str, lack: str) -> None:
    problem = read(written(tmp_path, wanted))
    planner = MpcPlanner(settings_for(problem, PlannerSettings(manners=NONE)))
    found = drive(problem, PREDICTOR, planner=planner)
    assert (found.reached, found.lack, found.contact) == (False, f"goal missed: {lack}", "")


def test_who_hurries_behind_others_in_vain_touches_nobody(tmp_path: Path) -> None:
    found = drive(read(written(tmp_path, goal(box(180.0, -1.75)))), PREDICTOR)
    assert (found.reached, found.contact) == (False, "")
    assert "not far enough" in found.lack


def test_a_contact_is_no_solution(tmp_path: Path) -> None:
    standing = "".join(driving(100 + lane, 30.0, left, 0.0, 60) for lane, left in enumerate((-1.75, -5.25, -9.0)))
    (found,) = solve(written(tmp_path, goal(), traffic=standing), PREDICTOR)
    assert not found.row["solved"] and found.row["reason"].startswith("collision")


def test_the_checker_refuses_what_is_wrong(tmp_path: Path) -> None:
    found = drive(read(written(tmp_path, goal())), PREDICTOR)
    if find_spec("commonroad_dc") is None:
        pytest.skip("needs the extra commonroad")
    assert refusal(found) == ""
    jumping = [*found.cars[:20], *found.cars[22:]]
    aside = [SingleTrackCar(car.model, car.values + np.array([0, 2.5, 0, 0, 0])) for car in found.cars[9:]]
    for cars, problem in (
        (jumping, "not the vehicle model"),
        ([*found.cars[:9], *aside], "off the road"),
        (found.cars[:9], "goal missed"),
    ):
        assert refusal(type(found)(found.problem, tuple(cars), True, found.trace)) == problem


JUDGE = """
import os, pickle, signal, sys
while True:
    *_, triangulated = pickle.load(sys.stdin.buffer)
    if triangulated or {dies}:
        os.kill(os.getpid(), signal.SIGSEGV)
    sys.stdout.buffer.write(pickle.dumps({answer}))
    sys.stdout.buffer.flush()
"""


def test_a_judge_that_dies_of_a_road_is_asked_for_less(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if find_spec("commonroad_dc") is None or find_spec("triangle") is None:
        pytest.skip("needs the extra commonroad, and triangle")
    found = drive(read(written(tmp_path, goal())), PREDICTOR)

    def said(answer: str, dies: bool = False) -> str | None:
        call = [sys.executable, "-c", JUDGE.format(answer=answer, dies=dies)]
        monkeypatch.setattr(drivability, "_CALL", call)
        monkeypatch.setattr(drivability, "_judges", judges := dict[int, subprocess.Popen[bytes]]())
        try:
            return refusal(found)
        finally:
            drivability._dismiss(judges[os.getpid()])

    assert said("'off the road'") == "off the road"
    with pytest.raises(RuntimeError, match="too far"):
        said("RuntimeError('too far')")
    assert said("''", dies=True) is None


def test_a_judge_that_comes_to_no_end_is_ended() -> None:
    endless = (
        "import coverdrive.driving.judge as judge; judge._LONGEST = 1; "
        "judge.judged = lambda *_: next(each for each in iter(int, 1) if each); judge._serve()"
    )
    ended = subprocess.run([sys.executable, "-c", endless], input=pickle.dumps((1,)), capture_output=True, timeout=60)
    assert (ended.returncode, ended.stdout) == (-signal.SIGALRM, b"")


class Start:
    """The state of a start."""

    position, orientation, velocity = np.array([3.0, -2.0]), 0.4, 12.0


def test_models_of_the_car() -> None:
    kinematic, slipping = (SingleTrackCar.at(Start, model) for model in ("KS", "ST"))
    for _ in range(30):
        kinematic, slipping = (car.moved(0.5, 0.02, 0.1) for car in (kinematic, slipping))
    assert kinematic.pose[2:] == pytest.approx([13.5, 0.4 + np.tan(0.02) / (BMW.a + BMW.b) * 12.75 * 3], abs=0.015)
    assert slipping.pose == pytest.approx(kinematic.pose, abs=0.5)
    assert slipping.pose[3] < kinematic.pose[3]
    stopped = kinematic.moved(-8.0, 0.0, 2.0)
    assert stopped.pose[2] == pytest.approx(0.0, abs=1e-9)
    turned = SingleTrackCar.at(Start, "KS").moved(0.0, 1.0, 0.1)
    assert turned.values[2] == pytest.approx(0.1 * BMW.steering.v_max, rel=1e-5)
    assert SingleTrackCar.at(Start, "KS").pose == pytest.approx([3.0, -2.0, 12.0, 0.4])


@pytest.mark.parametrize(("speed", "acceleration"), [(0.0, 1.5), (0.3, 0.0), (2.0, -2.0)])
def test_slipping_tyres_make_little_difference_at_low_speeds(speed: float, acceleration: float) -> None:
    start = SimpleNamespace(position=np.zeros(2), orientation=0.0, velocity=speed)
    kinematic, slipping = (SingleTrackCar.at(start, model) for model in ("KS", "ST"))
    for _ in range(20):
        kinematic, slipping = (car.moved(acceleration, 0.05, 0.1) for car in (kinematic, slipping))
    assert slipping.pose == pytest.approx(kinematic.pose, abs=0.1)


@pytest.mark.parametrize("period", [0.3, 0.5])
def test_in_long_periods_the_wheels_turn_about_as_planned_in_the_mean(period: float) -> None:
    car, wanted, angles = SingleTrackCar.at(Start, "KS"), 0.01, [0.0]
    for _ in range(6):
        car = car.moved(0.0, wanted, period)
        angles.append(float(car.values[2]))
    means = (np.array(angles[:-1]) + angles[1:]) / 2
    assert means == pytest.approx(wanted, rel=0.13)
    assert angles[-1] == pytest.approx(wanted, rel=0.2)


def shapes(pose: tuple[float, float, float], corners: np.ndarray) -> tuple[Any, Any, Any]:
    """An area of 4 by 1 m at a pose, an obstacle of 5 by 2 m, and one with these corners, in any commonroad-io."""
    *centre, heading = pose
    if find_spec("commonroad.geometry.shape"):
        old = import_module("commonroad.geometry.shape")
        return old.Rectangle(4.0, 1.0, np.array(centre), heading), old.Rectangle(5.0, 2.0), old.Polygon(corners)
    area = import_module("commonroad.geometry.occupancy.rect_occupancy").RectOccupancy(Point(centre), 1.0, 4.0, heading)
    rectangle = import_module("commonroad.geometry.obstacle_shapes.rect_obstacle_shape").RectObstacleShape(2.0, 5.0)
    drawn = import_module("commonroad.geometry.obstacle_shapes.polygon_obstacle_shape").PolygonObstacleShape
    return area, rectangle, drawn(tuple(map(tuple, corners.tolist())))


def test_uncertain_states_are_told_as_a_box_around_all_that_they_can_be() -> None:
    from commonroad.common.util import AngleInterval, Interval
    from commonroad.scenario.state import InitialState

    rng, heading, spread = np.random.default_rng(0), 0.7, 0.3
    angles = AngleInterval(heading - spread, heading + spread)
    triangle = np.array([[-2.0, -1.0], [3.0, -1.0], [0.0, 2.0]])
    place, rectangle, polygon = shapes((10.0, 5.0, heading), triangle)
    state = InitialState(0, place, angles, Interval(8.0, 12.0))
    for shape, corners in ((rectangle, [(2.5, 1.0), (2.5, -1.0), (-2.5, 1.0), (-2.5, -1.0)]), (polygon, triangle)):
        (x, y, speed, turned), size = told(state, shape)
        assert (speed, turned) == pytest.approx((10.0, heading))
        along, across = (np.array([np.cos(angle), np.sin(angle)]) for angle in (heading, heading + np.pi / 2))
        inside = np.array([
            (np.array([10.0, 5.0]) + rng.choice([-2.0, 2.0]) * along + rng.choice([-0.5, 0.5]) * across)
            + np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ corner
            for angle in heading + rng.choice([-spread, 0.0, spread], 400)
            for corner in corners
        ])  # fmt: skip
        seen = np.abs((inside - (x, y)) @ np.array([along, across]).T).max(axis=0)
        assert seen == pytest.approx(np.array(size) / 2, abs=0.02)
