"""What commonroad-io would take in another way than it is written: states out of order, sets, and wide headings."""

import re
from pathlib import Path

import numpy as np
import pytest
from driving_fakes import PREDICTOR
from problem_fakes import TRAFFIC, between, box, goal, in_sets, written
from recordings_fakes import RADIUS, TURN, driving, on_map

from coverdrive.driving.planning_problem import PlanningProblem, read_problems
from coverdrive.driving.solved import solve
from coverdrive.errors import RecordingError

ONE = driving(100, 90.0, -1.75, 14.0, 40)


def read(path: Path) -> PlanningProblem | RecordingError:
    (found,) = read_problems(path)
    return found


def states_of(vehicle: str) -> list[str]:
    return re.findall("<state>.*?</state>", vehicle)


def test_states_are_taken_by_their_time_steps(tmp_path: Path) -> None:
    states = states_of(ONE)
    shuffled = "".join(states[k] for k in np.random.default_rng(1).permutation(len(states)))
    mixed = re.sub("<trajectory>.*</trajectory>", f"<trajectory>{shuffled}</trajectory>", ONE)
    assert mixed != ONE
    found, expected = (read(written(tmp_path, goal(), traffic=each)) for each in (mixed, ONE))
    assert isinstance(found, PlanningProblem) and isinstance(expected, PlanningProblem)
    for moment in (0, 1, 17, 39):
        (pose, _), (right, _) = found.others(moment)[100], expected.others(moment)[100]
        assert tuple(pose) == tuple(right)
        (place, there) = (
            each.scenario.dynamic_obstacles[0].state_at_time(moment).position for each in (found, expected)
        )
        assert place == pytest.approx(there)


def test_sets_of_places_are_told_as_boxes_that_grow(tmp_path: Path) -> None:
    found = read(written(tmp_path, goal(), traffic=in_sets(ONE, range(1, 10))))
    assert isinstance(found, PlanningProblem)
    for moment in (0, 1, 5, 9):
        (x, y, speed, heading), size = found.others(moment)[100]
        assert (x, y) == pytest.approx(tuple(on_map(np.array([90.0 + 1.4 * moment]), -1.75)[0]), abs=0.01)
        assert (speed, heading) == (
            pytest.approx(14.0, abs=0.05),
            pytest.approx(TURN + (90 + 1.4 * moment) / RADIUS, abs=0.01),
        )
        assert size == pytest.approx((6.0, 2.0 + 0.1 * moment) if moment else (4.6, 1.9), abs=0.1)
    assert found.others(10) == {}


def test_what_is_in_sets_of_places_is_kept_clear_of(tmp_path: Path) -> None:
    """It is 90 m away at first, and soon over all three lanes."""
    wall = in_sets(ONE, range(1, 60), speed=0.0, widens=1.0)
    (found,) = solve(written(tmp_path, goal(first=50, last=50), traffic=wall), PREDICTOR)
    assert found.row["solved"], found.row["reason"]
    assert found.drive is not None and found.drive.cars[-1].pose[2] < 7.0  # from 14


UNKNOWN = {
    "a gap": (ONE.replace("".join(states_of(ONE)[19:24]), ""), "100 has no state at time step 20, but at 25"),
    "a gap at first": (ONE.replace(states_of(ONE)[0], ""), "100 has no state at time step 1, but at 2"),
    "one twice": (ONE.replace(states_of(ONE)[4], 2 * states_of(ONE)[4]), "100 has a state too many at time step 5"),
    "a gap in sets": (
        in_sets(ONE, range(1, 5), range(6, 10)),
        "100 has no state at time step 5, but at 6",
    ),
}


@pytest.mark.parametrize("case", UNKNOWN)
def test_who_is_not_known_at_every_time_step_is_refused(case: str, tmp_path: Path) -> None:
    traffic, problem = UNKNOWN[case]
    found = read(written(tmp_path, goal(), traffic=traffic))
    assert isinstance(found, RecordingError) and f"planning problem 7: obstacle {problem}" in str(found)


def test_sets_of_places_are_told_along_their_way_and_long_ones_in_parts(tmp_path: Path) -> None:
    """At 14 m/s along the road, which bends, for 7 s; and a set of 150 m."""
    found = read(written(tmp_path, goal(), traffic=in_sets(ONE, range(1, 61))))
    assert isinstance(found, PlanningProblem)
    (*_, speed, heading), _ = found.others(60)[100]
    assert (speed, heading) == (pytest.approx(14.0, abs=0.1), pytest.approx(TURN + 172.0 / RADIUS, abs=0.005))
    found = read(written(tmp_path, goal(), traffic=in_sets(ONE, range(1, 9), length=150.0)))
    assert isinstance(found, PlanningProblem)
    parts = found.others(8)
    assert [size[0] for _, size in parts.values()] == pytest.approx([150 / 8] * 8, abs=0.1)
    lons = sorted(float(found.road.to_road(*pose[:2])[0]) for pose, _ in parts.values())
    assert np.diff(lons) == pytest.approx(150 / 8, abs=0.1)


@pytest.mark.parametrize("named", ["<intervalStart>1</intervalStart><intervalEnd>2</intervalEnd>", "<exact>3</exact>"])
def test_sets_of_places_for_intervals_or_twice_are_refused(named: str, tmp_path: Path) -> None:
    traffic = in_sets(ONE, range(1, 9)).replace(
        "<time><exact>2</exact></time></occupancy>", f"<time>{named}</time></occupancy>"
    )
    found = read(written(tmp_path, goal(), traffic=traffic))
    assert isinstance(found, RecordingError) and "obstacle 100 has " in str(found) and "Error:" not in str(found)


@pytest.mark.parametrize("length", [0.0, float("nan"), -1.0, 1e9])
def test_sets_of_places_without_an_extent_are_refused(length: float, tmp_path: Path) -> None:
    refused = "a set of places of obstacle 100, at time step 1, has no extent or numbers"
    if np.isnan(length):
        refused += "|cannot be read"  # by a newer commonroad-io itself
    with pytest.raises(RecordingError, match=refused):
        read(written(tmp_path, goal(), traffic=in_sets(ONE, range(1, 9), length=length)))


def test_of_the_recorded_ego_nothing_needs_to_be_known(tmp_path: Path) -> None:
    ego = driving(90_007, 20.1, -1.7, 14.2, 60)
    traffic = TRAFFIC + ego.replace(states_of(ego)[10], "")
    found = read(written(tmp_path, goal(), traffic=traffic))
    assert isinstance(found, PlanningProblem) and set(found.others(10)) == {100, 101}


@pytest.mark.parametrize(("low", "high"), [(-3.1, 3.1), (-1.0, 3.0), (0.5, 6.2)])
def test_headings_may_reach_farther_than_half_a_turn(low: float, high: float, tmp_path: Path) -> None:
    wanted = goal(box(55.0, -1.75, length=70.0), between("orientation", low, high), first=5, last=6)
    (found,) = solve(written(tmp_path, wanted), PREDICTOR)
    assert found.row["solved"], found.row["reason"]
    assert found.drive is not None
    turned = TURN + 55.0 / RADIUS
    assert found.drive.problem.goal.turn == (0.0 if low < turned else pytest.approx(low - turned, abs=0.05))


def test_headings_outside_are_missed(tmp_path: Path) -> None:
    wanted = goal(box(55.0, -1.75, length=70.0), between("orientation", 1.5, 6.5), first=5, last=6)
    (found,) = solve(written(tmp_path, wanted), PREDICTOR)
    assert (found.row["solved"], found.row["reason"]) == (False, "goal missed: heading")
