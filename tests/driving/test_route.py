"""Problems on roads that split, end lanes in their middle or bend sharply."""

import re
from pathlib import Path

import numpy as np
import pytest
from driving_fakes import PREDICTOR
from problem_fakes import between, box, goal, problem
from recordings_fakes import driving, lanelet, on_map, points, scenario

from coverdrive.driving.goal import Goal
from coverdrive.driving.planning_problem import PlanningProblem, read_problems
from coverdrive.driving.route import within_reach
from coverdrive.driving.single_track import ModelName
from coverdrive.driving.solved import solve
from coverdrive.driving.solving import drive
from coverdrive.errors import RecordingError

AT = np.linspace(90.0, 200.0, 30)
ASIDE = -20 * ((AT - 90) / 110) ** 2
"""[m] to the left of the road that goes on, the branch leaves it"""


SIGN = (
    '<trafficSign id="900"><trafficSignElement><trafficSignID>R2-1</trafficSignID>'
    "<additionalValue>9</additionalValue></trafficSignElement></trafficSign>"
)
"""of 9 m/s"""

NOBODY = driving(100, -500.0, -1.75, 0.0, 20)


def split(before: str = "", limits: str = "") -> str:
    """A lane that splits after 90 m: one goes on, and is the longer one, one leaves to the right."""
    fork = lanelet(10, 0.0, 90.0, 0.0, 3.5, f'{before}<successor ref="11"/><successor ref="12"/>')
    onwards = lanelet(11, 90.0, 300.0, 0.0, 3.5, '<predecessor ref="10"/>')
    return fork + onwards + branch(limits)


def branch(limits: str) -> str:
    return lanelet(12, 90.0, 200.0, ASIDE, 3.5, f'<predecessor ref="10"/>{limits}')


def read(folder: Path, lanelets: str, *goals: str, traffic: str = "", **start: float) -> PlanningProblem:
    (found,) = read_problems(written(folder, lanelets, *goals, traffic=traffic, **start))
    assert isinstance(found, PlanningProblem), str(found)
    return found


def written(folder: Path, lanelets: str, *goals: str, traffic: str = "", **start: float) -> Path:
    path = folder / "USA_Test-1_1_T-1.xml"
    path.write_text(scenario(lanelets, (traffic or driving(100, 5.0, -1.75, 10.0, 40)) + problem(*goals, **start)))
    return path


@pytest.mark.parametrize("aside", [False, True])
def test_the_route_follows_the_goal(tmp_path: Path, aside: bool) -> None:
    at = 160.0
    left = float(np.interp(at, AT, ASIDE)) * aside - 1.75
    found = read(tmp_path, split(), goal(box(at, left)))
    (middle,) = on_map(np.array([at]), left)
    lon, lat = found.road.to_road(*middle)
    right, *_, leftmost = found.road.edges_at(lon)
    assert right + 1.5 < lat < leftmost - 1.5
    assert found.goal.position is not None and found.goal.position[0] < lon < found.goal.position[1]


def test_the_limit_is_that_of_the_route(tmp_path: Path) -> None:
    lanelets = split(limits='<trafficSignRef ref="900"/>') + SIGN
    assert read(tmp_path, lanelets, goal(box(160.0, -1.75))).road.speed_limit is None
    left = float(np.interp(160.0, AT, ASIDE)) - 1.75
    assert read(tmp_path, lanelets, goal(box(160.0, left))).road.speed_limit == pytest.approx(9.0)


@pytest.mark.parametrize("stated", ["-3", "0", "NaN", "900"])
def test_a_limit_that_is_none_is_said(stated: str, tmp_path: Path) -> None:
    fork = '<successor ref="11"/><successor ref="12"/>'
    lanelets = split().replace(fork, f'{fork}<trafficSignRef ref="900"/>') + SIGN.replace(">9<", f">{stated}<")
    (found,) = read_problems(written(tmp_path, lanelets, goal(box(160.0, -1.75))))
    assert re.search(rf"problem 7: the speed limit is {stated.lower()} m/s; expected more than 0", str(found))


def test_the_branch_is_driven(tmp_path: Path) -> None:
    left = float(np.interp(110.0, AT, ASIDE)) - 1.75
    path = written(tmp_path, split(), goal(box(110.0, left, length=8.0), last=80), at=40.0)
    (found,) = solve(path, PREDICTOR)
    assert found.row["solved"], found.row["reason"]


def arc(radius: float, turn: float, straight: float, number: int = 1) -> str:
    """One lane, straight on along x for some way [m], then an arc to the left by an angle [rad]."""

    def bound(left: float) -> str:
        angle = np.linspace(0.0, turn, 60)
        x = np.append(np.linspace(0.0, straight, 40)[:-1], straight + (radius - left) * np.sin(angle))
        y = np.append(np.full(39, left), radius - (radius - left) * np.cos(angle))
        return "".join(f"<point><x>{a:.4f}</x><y>{b:.4f}</y></point>" for a, b in zip(x, y, strict=True))

    return (
        f'<lanelet id="{number}"><leftBound>{bound(1.75)}</leftBound><rightBound>{bound(-1.75)}</rightBound></lanelet>'
    )


def started(x: float, speed: float, *goals: str) -> str:
    return (
        '<planningProblem id="7"><initialState><time><exact>0</exact></time>'
        f"<position><point><x>{x}</x><y>0</y></point></position><orientation><exact>0</exact></orientation>"
        f"<velocity><exact>{speed}</exact></velocity><yawRate><exact>0</exact></yawRate><slipAngle><exact>0</exact>"
        f"</slipAngle></initialState>{''.join(goals)}</planningProblem>"
    )


@pytest.mark.parametrize("last", [60, 600, 6000])
def test_a_junction_far_ahead_does_not_matter(last: int, tmp_path: Path) -> None:
    path, wanted = tmp_path / "USA_Test-1_1_T-1.xml", goal(first=50, last=last)
    path.write_text(scenario(arc(6.0, 1.5, 180.0), driving(100, -500.0, 0.0, 0.0, 20) + started(100.0, 10.0, wanted)))
    (found,) = read_problems(path)
    assert isinstance(found, PlanningProblem)
    lon, lat = found.road.to_road(100.0, 0.0)
    assert found.road.length - lon > 50.0 and lat == pytest.approx(1.75, abs=0.1)


@pytest.mark.parametrize(
    ("left", "why"),
    [
        (0.0, "the goal is 447 m away; from 20 m/s one gets 138 m in its 5 s at most"),
        (30.0, "the goal is not on the road"),
    ],
)
def test_a_goal_too_far_ahead_is_said_to_be(left: float, why: str, tmp_path: Path) -> None:
    path = tmp_path / "USA_Test-1_1_T-1.xml"
    place = (
        "<position><rectangle><length>6</length><width>2</width><orientation>0</orientation><center><x>500</x>"
        f"<y>{left}</y></center></rectangle></position>"
    )
    wanted = goal(place, first=0, last=50)
    path.write_text(scenario(arc(50.0, 0.1, 600.0), driving(100, -500.0, 0.0, 0.0, 20) + started(50.0, 20.0, wanted)))
    (found,) = read_problems(path)
    assert isinstance(found, PlanningProblem)
    with pytest.raises(RecordingError, match=why):
        _ = found.goal


def test_a_goal_beyond_a_sharp_curve_is_said_to_be(tmp_path: Path) -> None:
    path = tmp_path / "USA_Test-1_1_T-1.xml"
    place = "<position><circle><radius>2</radius><center><x>192</x><y>12</y></center></circle></position>"
    path.write_text(scenario(arc(12.0, 3.0, 180.0), started(100.0, 10.0, goal(place, first=50, last=100))))
    (found,) = solve(path, PREDICTOR)
    why = r"lanes lead to the goal, but a road can be drawn along them for \d+ m only; expected no curves below 20 m"
    assert re.search(why, found.row["reason"]), found.row["reason"]


@pytest.mark.parametrize("aside", [40.0, 400.0])
def test_of_roads_that_are_too_sharp_the_one_at_the_start_is_said(aside: float, tmp_path: Path) -> None:
    path, wanted = tmp_path / "USA_Test-1_1_T-1.xml", goal(first=20, last=40)
    longer = re.sub(r"<y>([^<]*)", lambda y: f"<y>{float(y[1]) + aside}", arc(6.0, 6.0, 2.0, number=2))
    path.write_text(scenario(longer + arc(4.0, 3.0, 1.0), started(1.0, 10.0, wanted)))
    (found,) = read_problems(path)
    assert "on no road of the map; a curve of 2 m radius, 4 m after the road's beginning" in str(found)


def test_a_loop_of_25_m_is_driven_slowly(tmp_path: Path) -> None:
    x, y = 30.0 + 25.0 * np.sin(0.9), 25.0 - 25.0 * np.cos(0.9)
    place = (
        f"<position><rectangle><length>5</length><width>2.5</width><orientation>0.9</orientation><center><x>{x}</x>"
        f"<y>{y}</y></center></rectangle></position>"
    )
    wanted = goal(place, between("orientation", 0.7, 1.1), first=20, last=80)
    path = tmp_path / "USA_Test-1_1_T-1.xml"
    path.write_text(scenario(arc(25.0, 1.6, 30.0), driving(100, -500.0, 0.0, 0.0, 20) + started(5.0, 9.0, wanted)))
    (found,) = solve(path, PREDICTOR)
    assert found.row["solved"] and found.drive is not None, found.row["reason"]
    places = np.array([car.pose[:2] for car in found.drive.cars])
    way = np.hypot(*np.diff(places, axis=0).T).sum()
    assert found.row["mean_speed"] == pytest.approx(way / found.drive.seconds, rel=0.02)
    assert found.row["mean_speed"] != pytest.approx(found.drive.trace.scene.speed[:, 0].mean(), rel=0.02)


@pytest.mark.parametrize("model", ["KS", "ST"])
def test_a_tight_bend_is_driven_in_the_middle_of_its_lane(tmp_path: Path, model: ModelName) -> None:
    path = tmp_path / "USA_Test-1_1_T-1.xml"
    path.write_text(scenario(arc(30.0, 6.0, 10.0), started(5.0, 7.0, goal(first=80, last=100))))
    (found,) = read_problems(path)
    assert isinstance(found, PlanningProblem)
    driven = drive(found, PREDICTOR, model)
    assert driven.reached
    radius = np.hypot(*(np.array([car.pose[:2] for car in driven.cars[40:]]) - [10.0, 30.0]).T)
    assert radius == pytest.approx(np.full(len(radius), 30.0), abs=0.2)


AHEAD = np.linspace(50.0, 200.0, 30)
FAR = 15 * ((200 - AHEAD) / 150) ** 2
"""[m] how far a ramp is from the road that it comes to, and by symmetry one that leaves"""


def two_lanes(*links: str) -> str:
    """Two lanes of three lanelets each, 10 to 12 and 20 to 22, with more links of the right ones."""
    found, ends = "", [(0.0, 200.0), (200.0, 400.0), (400.0, 600.0)]
    for lane, first in enumerate((10, 20)):
        for part, (start, end) in enumerate(ends):
            number = first + part
            chain = f'<predecessor ref="{number - 1}"/>' * (part > 0) + f'<successor ref="{number + 1}"/>' * (part < 2)
            left, right = f'<adjacentLeft ref="{number - 10}"', f'<adjacentRight ref="{number + 10}"'
            beside = f'{left if lane else right} drivingDir="same"/>'
            found += lanelet(number, start, end, -3.5 * lane, 3.5, chain + beside + "".join(links[part:][:1]) * lane)
    return found


def curved(number: int, start: float, end: float, aside: np.ndarray, links: str) -> str:
    at = np.linspace(start, end, 30)
    bounds = "".join(
        f"<{name}Bound>{points(at, aside - width)}</{name}Bound>" for name, width in (("left", 0.0), ("right", 3.5))
    )
    return f'<lanelet id="{number}">{bounds}{links}</lanelet>'


def acceleration_lane() -> str:
    """Beside the two lanes, from 200 m to 400 m, with the ramp that leads to it."""
    ramp = curved(90, 50.0, 200.0, -7.0 - FAR, '<successor ref="91"/>')
    beside = '<predecessor ref="90"/><adjacentLeft ref="21" drivingDir="same"/>'
    links = "", '<adjacentRight ref="91" drivingDir="same"/>'
    return two_lanes(*links) + ramp + lanelet(91, 200.0, 400.0, -7.0, 3.5, beside)


def exit_lane() -> str:
    """Beside the two lanes, from 200 m to 400 m, with the ramp that it leads to."""
    ramp = curved(92, 400.0, 550.0, -7.0 - FAR[::-1], '<predecessor ref="91"/>')
    beside = '<successor ref="92"/><adjacentLeft ref="21" drivingDir="same"/>'
    links = "", '<adjacentRight ref="91" drivingDir="same"/>'
    return two_lanes(*links) + ramp + lanelet(91, 200.0, 400.0, -7.0, 3.5, beside)


@pytest.mark.parametrize("left", [-5.25, -1.75], ids=["next lane", "the one after that"])
def test_from_a_ramp_one_gets_beyond_the_end_of_the_acceleration_lane(left: float, tmp_path: Path) -> None:
    start = {"at": 150.0, "left": float(np.interp(150.0, AHEAD, -7.0 - FAR)) - 1.75, "speed": 15.0}
    wanted = goal(box(450.0, left, length=20.0, width=3.0), first=150, last=250)
    (found,) = solve(written(tmp_path, acceleration_lane(), wanted, traffic=NOBODY, **start), PREDICTOR)
    assert found.row["solved"], found.row["reason"]


@pytest.mark.parametrize(
    "place", [box(480.0, -7.0 - 15 * (80 / 150) ** 2 - 1.75), '<position><lanelet ref="92"/></position>']
)
@pytest.mark.parametrize("left", [-5.25, -1.75])
def test_an_exit_whose_lane_begins_after_the_start_is_taken(place: str, left: float, tmp_path: Path) -> None:
    wanted = goal(place, first=150, last=280)
    path = written(tmp_path, exit_lane(), wanted, traffic=NOBODY, at=120.0, left=left, speed=15.0)
    (found,) = solve(path, PREDICTOR)
    assert found.row["solved"], found.row["reason"]


@pytest.mark.parametrize(
    ("wanted", "reached"),
    [
        (Goal(position=(63.0, 70.0), time=(3.0, 4.0)), True),  # 10 m/s · 4 s + 3 m/s² / 2 · (4 s)² = 64 m
        (Goal(position=(65.0, 70.0), time=(3.0, 4.0)), False),
        (Goal(position=(-9.0, -1.0), time=(3.0, 4.0)), False),
        (Goal(speed=(21.9, 30.0), time=(3.0, 4.0)), True),  # 10 m/s + 3 m/s² · 4 s = 22 m/s
        (Goal(speed=(22.1, 30.0), time=(3.0, 4.0)), False),
        (Goal(position=(500.0, 501.0)), True),
    ],
)
def test_what_is_within_reach_by_hand(wanted: Goal, reached: bool) -> None:
    assert within_reach(wanted, 0.0, 10.0) is reached
