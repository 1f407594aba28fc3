"""The gap that somebody wants who is in a lane that ends: worked out by hand, and driven for."""

import numpy as np
import pytest
from test_planner_on_bends import with_end

from coverdrive.paths import PredictedPaths
from coverdrive.planning.planner import MpcPlanner
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.planning.rules.merging import Merge, merge
from coverdrive.road import Road
from merging import drawn, driven, possible

PROBLEM, HEADWAY, SPEED = ProblemSettings(), 0.72, 20.0
LENGTHS = PROBLEM.vehicle.length / 2 + 2.4
ASKED = PROBLEM.obstacles.inflation * (HEADWAY * SPEED + LENGTHS)
"""[m] from centre to centre"""


def wanted(*beside: float, lon: float = 200.0, lat: float = 1.8, road: Road | None = None) -> Merge | None:
    """By an ego at 20 m/s, of whom so many drive beside, so far ahead [m], as fast."""
    points = np.full((len(beside), 13, 2), 5.4)
    points[..., 0] = lon + np.reshape(beside, (-1, 1)) + 0.25 * SPEED * np.arange(13)
    paths = PredictedPaths(points, np.arange(len(beside)), np.tile([2.4, 0.95], (len(beside), 13, 1)), 0.25)
    lanes = [0, 1] if lat < 3.6 else [1, 0, 2]
    return merge(np.array([lon, lat, SPEED, 0.0]), paths, road or with_end(), lanes, PROBLEM, HEADWAY)


@pytest.mark.parametrize(
    ("beside", "speed"),
    [
        ((-60.0, 10.0), SPEED + (10 - ASKED) / 4),  # falls back as far as is asked for
        ((-10.0, 60.0), SPEED + (60 - ASKED) / 4),  # may go on until it is so near to who is ahead
        ((-30.0, 10.0), SPEED - 10 / 4),  # to the middle of a gap that is short
        ((-40.0, -6.0, 6.0, 70.0), SPEED + (70 - ASKED) / 4),  # to the one that takes least
        ((-30.0,), np.inf),
        ((10.0, 7.0, 4.0, 1.0, -2.0, -5.0, -8.0), SPEED - (8 + ASKED) / 4),
    ],
)
def test_the_speed_that_leads_to_a_gap(beside: tuple[float, ...], speed: float) -> None:
    found = wanted(*beside)
    assert found and found.speed == pytest.approx(speed)


def test_who_is_in_a_short_gap_asks_for_no_more_than_it_has() -> None:
    whole, short = wanted(-60.0, 10.0), wanted(-30.0, 10.0)
    assert whole and short and whole.headway == HEADWAY
    kept = PROBLEM.obstacles.inflation * (short.headway * SPEED + LENGTHS)
    assert kept == pytest.approx(20)


@pytest.mark.parametrize(
    "unasked",
    [
        wanted(10.0, road=Road.straight()),
        wanted(10.0, lon=20.0),  # more than 15 s before the end
        wanted(10.0, lat=5.4),  # beside it
        wanted(),  # nobody is there
    ],
)
def test_elsewhere_nothing_is_wanted(unasked: Merge | None) -> None:
    assert unasked is None


def test_who_has_not_left_the_lane_wholly_goes_on_wanting_the_gap() -> None:
    assert wanted(-30.0, 20.0, lat=4.4) is not None
    assert wanted(-30.0, 20.0, lat=4.6) is None


@pytest.mark.parametrize("seed", range(4))
def test_it_comes_over_smoothly(seed: int) -> None:
    scene = drawn(seed)
    assert possible(scene) and driven(scene, MpcPlanner()).smooth
