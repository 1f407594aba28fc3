"""Drives that arrive as a goal asks: standing at a place, or in another lane in time, among others who are there."""

from pathlib import Path

import numpy as np
import pytest
from driving_fakes import PREDICTOR
from problem_fakes import TRAFFIC, between, box, goal, written
from recordings_fakes import driving
from simulation_fakes import FakeBasis, FakePredictor

from coverdrive.driving.single_track import ModelName
from coverdrive.driving.solved import solve
from coverdrive.driving.solving import Drive

pytestmark = pytest.mark.usefixtures("unjudged")

NOBODY = driving(100, -500.0, -1.75, 0.0, 20)
STANDING = driving(100, 88.0, -1.75, 0.0, 130)
STEADY = FakePredictor(FakeBasis.make(accelerations=(0.0,), shifts=(0.0,)))
"""Who stands goes on to stand; the other one has who brakes drive backwards in the end."""
HARD = 4.0
"""[m/s²] of braking that is hard"""


def solved(path: Path, predictor: FakePredictor = PREDICTOR, model: ModelName = "KS") -> Drive:
    (found,) = solve(path, predictor, model)
    assert found.row["solved"], found.row["reason"]
    assert found.drive is not None
    return found.drive


@pytest.mark.parametrize(
    ("traffic", "first", "last"),
    [(NOBODY, 60, 90), (TRAFFIC, 110, 130), (STANDING, 60, 90)],
    ids=["soon", "stands and waits", "behind who stands"],
)
def test_a_place_to_stop_at(tmp_path: Path, traffic: str, first: int, last: int) -> None:
    stopping = goal(box(80.0, -1.75, length=4.0), between("velocity", 0.0, 0.3), first=first, last=last)
    driven = solved(written(tmp_path, stopping, traffic=traffic), STEADY if traffic is STANDING else PREDICTOR)
    speed = np.array([car.pose[2] for car in driven.cars])
    assert speed[-1] <= 0.3 and first <= len(speed) - 1 <= last
    assert np.diff(speed).min() > -HARD * 0.1


@pytest.mark.parametrize(("first", "last"), [(50, 60), (50, 50), (40, 41)])
def test_a_stop_at_any_place(tmp_path: Path, first: int, last: int) -> None:
    driven = solved(written(tmp_path, goal(between("velocity", 0.0, 0.3), first=first, last=last), traffic=NOBODY))
    assert driven.cars[-1].pose[2] <= 0.3


@pytest.mark.parametrize("model", ["KS", "ST"])
@pytest.mark.parametrize("place", ["", box(80.0, -1.75, length=4.0)], ids=["anywhere", "at a place"])
def test_in_the_end_one_really_stands(tmp_path: Path, place: str, model: ModelName) -> None:
    standing = goal(place, between("velocity", 0.0, 0.0), first=100, last=120)
    driven = solved(written(tmp_path, standing, traffic=NOBODY), model=model)
    assert driven.cars[-1].pose[2] == 0 and np.abs([car.values for car in driven.cars]).max() < 1e3


@pytest.mark.parametrize("at", [113.0, 86.0], ids=["past who is alongside", "behind who was alongside"])
def test_a_lane_change_in_time_into_the_gap_of_the_goal(tmp_path: Path, at: float) -> None:
    alongside = driving(100, 20.0, -5.25, 10.0, 90) + driving(101, 46.0, -5.25, 10.0, 90)
    wanted = goal(box(at, -5.25, length=4.0), between("velocity", 6.0, 14.0), first=70, last=80)
    driven = solved(written(tmp_path, wanted, traffic=alongside, speed=10.0))
    lon, lat = driven.problem.road.to_road(*driven.cars[-1].pose[:2])
    assert lon == pytest.approx(at, abs=2.1) and driven.problem.lane_of(lon, lat) == 1


def test_two_lanes_are_changed_in_four_seconds(tmp_path: Path) -> None:
    wanted = goal(box(76.0, -9.0, length=6.0), between("orientation", 0.65, 0.85), first=37, last=42)
    driven = solved(written(tmp_path, wanted, traffic=NOBODY))
    assert driven.trace.outcome.partner is None


def test_a_place_that_is_to_be_reached_late(tmp_path: Path) -> None:
    driven = solved(written(tmp_path, goal(box(80.0, -1.75), first=350, last=360), traffic=NOBODY))
    speed = np.array([car.pose[2] for car in driven.cars])
    assert len(speed) - 1 >= 350 and np.diff(speed).min() > -HARD * 0.1


@pytest.mark.parametrize("dt", [0.3, 0.5])
@pytest.mark.parametrize("speed", [10.0, 25.0])
def test_a_lane_is_changed_in_long_time_steps(dt: float, speed: float, tmp_path: Path) -> None:
    wanted = goal(box(20.0 + 5.5 * speed, -5.25, length=speed), first=round(5 / dt), last=round(6 / dt))
    path = written(tmp_path, wanted, traffic=driving(100, -500.0, -1.75, 0.0, 20), speed=speed)
    path.write_text(path.read_text().replace('timeStepSize="0.1"', f'timeStepSize="{dt}"'))
    driven = solved(path)
    across = np.array([driven.problem.road.to_road(*car.pose[:2])[1] for car in driven.cars])
    assert np.diff(across).max() < 0.1, "it comes back"


@pytest.mark.parametrize(("ahead", "apart", "braking"), [(12.0, 16.0, -1.0), (8.0, 14.0, -2.0), (8.0, 16.0, -2.0)])
def test_a_lane_is_entered_between_cars_that_are_near(
    ahead: float, apart: float, braking: float, tmp_path: Path
) -> None:
    """Who took it as no longer urgent once the centre is in the lane would draw back, again and again."""
    traffic = "".join(driving(100 + n, 20.0 + ahead + apart * (n - 4), -5.25, 10.0, 80) for n in range(8))
    wanted = goal(box(85.0, -5.25, length=30.0, width=2.5), first=60, last=80)
    likely = FakePredictor(FakeBasis.make(accelerations=(braking, 0.0, 1.0), shifts=(0.0,)))
    solved(written(tmp_path, wanted, traffic=traffic, speed=10.0), likely)
