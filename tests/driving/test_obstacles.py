"""What a driver is told of obstacles: long ones in pieces, and none that cannot be traffic."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from problem_fakes import TRAFFIC, goal, written
from recordings_fakes import RADIUS, driving

from coverdrive.driving.obstacles import come_near
from coverdrive.driving.planning_problem import PlanningProblem, read_problems
from coverdrive.errors import RecordingError
from coverdrive.road import Road

ONE = driving(100, 90.0, -1.75, 14.0, 60)
"""whose road is 180 m long and 11 m wide"""


def standing(shape: str, at: float, left: float) -> str:
    """An obstacle along the road there."""
    one = re.sub("<trajectory>.*</trajectory>", "", driving(100, at, left, 0.0, 20))
    return re.sub("<rectangle>.*?</rectangle>", shape, one.replace("dynamicObstacle", "staticObstacle"))


def rectangle(length: float, width: float) -> str:
    return f"<rectangle><length>{length}</length><width>{width}</width></rectangle>"


def bodies(folder: Path, traffic: str) -> np.ndarray:
    """lon, lat [m], heading [rad] to the road, length and width [m] of what is told."""
    (found,) = read_problems(written(folder, goal(), traffic=traffic))
    assert isinstance(found, PlanningProblem), str(found)
    rows = list[tuple[float, ...]]()
    for (x, y, speed, heading), size in found.others(0).values():
        lon, lat = found.road.to_road(x, y)
        assert speed == 0
        rows.append((lon, lat, float(found.road.heading_to_road(lon, heading)), *size))
    return np.array(rows)


@pytest.mark.parametrize("length", [20.0, 150.0, 400.0])
def test_a_wall_is_told_in_pieces(length: float, tmp_path: Path) -> None:
    lon, lat, heading, lengths, widths = bodies(tmp_path, standing(rectangle(length, 0.3), 90.0, 0.5)).T
    assert lengths.max() <= 20.0 and widths == pytest.approx(0.3)
    assert np.abs(heading).max() < 0.1 and lat == pytest.approx(11.5 - (lon - 90.0) ** 2 / 2 / RADIUS, abs=0.5)
    assert min(length, 140.0) <= lengths.sum() <= min(length, 220.0)


def test_what_ends_on_the_road_is_told_wherever_its_middle_is(tmp_path: Path) -> None:
    lon, *_, lengths, _ = bodies(tmp_path, standing(rectangle(300.0, 0.3), 250.0, -5.0)).T
    assert (lon - lengths / 2).min() == pytest.approx(100.0, abs=2.0)
    across = bodies(tmp_path, standing(rectangle(0.3, 30.0), 90.0, 14.0))
    assert (across[:, 1] - np.maximum(across[:, 3], across[:, 4]) / 2).min() < 11.0


def test_a_bent_rail_takes_no_more_than_its_place(tmp_path: Path) -> None:
    along = np.arange(-60.0, 61.0, 5.0)
    points = np.stack([along, (along / 60) ** 2 * 8], axis=-1)
    bound = [*points, *(points[::-1] + np.array([0.0, 0.3]))]
    shape = "".join(f"<point><x>{x}</x><y>{y}</y></point>" for x, y in bound)
    *_, lengths, widths = bodies(tmp_path, standing(f"<polygon>{shape}</polygon>", 90.0, -1.75)).T
    assert len(lengths) >= 4 and lengths.max() < 21.0 and widths.max() < 1.0


def edited(pattern: str, change: Callable[[re.Match[str]], str]) -> str:
    return re.sub(pattern, change, ONE)


IMPOSSIBLE = {
    "km/h": (edited(r"(?<=<velocity><exact>)14\.0", lambda _: "50.4"), r"the speeds look like km/h"),
    "too long": (ONE.replace("<length>4.6", "<length>150"), r"length of vehicle 100 at 0 s is 150 m"),
    "jumps": (
        edited(r"(?<=<exact>30</exact></time><position><point><x>)[\d.-]+", lambda x: str(float(x[0]) + 6)),
        r"vehicle 100 at .* moves \d+\.\d m in 0\.1 s",
    ),
    "sideways": (edited(r"(?<=<orientation><exact>)[\d.-]+", lambda x: str(float(x[0]) + 1)), "check the headings"),
}


@pytest.mark.parametrize("case", IMPOSSIBLE)
def test_who_cannot_be_traffic_is_refused(case: str, tmp_path: Path) -> None:
    traffic, problem = IMPOSSIBLE[case]
    assert traffic != ONE
    (found,) = read_problems(written(tmp_path, goal(), traffic=traffic))
    assert isinstance(found, RecordingError) and re.search(problem, str(found)), str(found)


def test_one_of_many_may_jump_and_others_may_come_towards(tmp_path: Path) -> None:
    many = "".join(driving(200 + k, 20.0 + 12 * k, -5.25, 10.0, 20) for k in range(8))
    turned = re.sub(r"(?<=<orientation><exact>)([\d.-]+)", lambda x: str(float(x[0]) - np.pi), many)
    backwards = re.sub(r"(?<=<velocity><exact>)10\.0", "-10.0", turned)
    for traffic in (TRAFFIC + many + IMPOSSIBLE["jumps"][0].replace('"100"', '"300"'), TRAFFIC + backwards):
        (found,) = read_problems(written(tmp_path, goal(), traffic=traffic))
        assert isinstance(found, PlanningProblem), str(found)


def test_a_motorcycle_alone_is_traffic(tmp_path: Path) -> None:
    (found,) = read_problems(written(tmp_path, goal(), traffic=ONE.replace("<length>4.6", "<length>2.1")))
    assert isinstance(found, PlanningProblem) and len(found.others(0)) == 1


def test_who_comes_near_a_narrow_road() -> None:
    road = Road.straight(length=200.0, lanes=1)
    near = {
        (100.0, -1.9, 0.0, np.pi / 2): True,  # lies across it, with both ends beyond
        (100.0, -6.0, 0.0, np.pi / 2): True,
        (100.0, -11.0, 0.0, np.pi / 2): False,
        (100.0, -14.0, 4.0, np.pi / 2): False,
        (100.0, -5.0, 4.0, 0.0): False,
        (100.0, -1.7, 4.0, 0.0): True,
        (206.0, 1.8, -5.0, 0.0): True,
        (203.0, -8.5, 5.0, np.pi / 2): False,  # passes by beyond its end
    }
    found = come_near([(pose, (18.0, 2.5)) for pose in near], road)
    assert found.tolist() == list(near.values())


def test_buildings_are_told_to_nobody(tmp_path: Path) -> None:
    place = "<orientation>0.3</orientation><center><x>90.0</x><y>20.0</y></center></rectangle>"
    body = rectangle(10.0, 8.0).replace("</rectangle>", place)
    building = f'<environmentObstacle id="300"><type>building</type><shape>{body}</shape></environmentObstacle>'
    assert len(bodies(tmp_path, standing(rectangle(4.0, 2.0), 90.0, -1.75) + building)) == 1
