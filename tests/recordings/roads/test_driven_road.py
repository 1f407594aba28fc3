"""Which of the roads in a map is driven on."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import polars as pl
import pytest

from coverdrive.errors import DataError
from coverdrive.recordings.roads.driven_road import driven_road, roads_of
from coverdrive.recordings.tracks.repair import RawTracks
from coverdrive.road import Road


def tracks(*ways: tuple[float, float, float]) -> RawTracks:
    """Vehicles that drive from one lon to another at a lat."""
    vehicle, share = np.repeat(np.arange(len(ways)), 11), np.tile(np.linspace(0, 1, 11), len(ways))
    start, end, lat = np.array(ways)[vehicle].T
    ones = np.ones(len(vehicle))
    moment = np.tile(np.arange(11), len(ways))
    return RawTracks(vehicle, moment, start + share * (end - start), lat, 4 * ones, 2 * ones, ones, 0 * vehicle)


def frames(*of_roads: RawTracks) -> tuple[list[Road], pl.DataFrame, list[Road]]:
    """Roads in whose frames the rows are as these tracks, the rows, and those of the roads that are looked at."""
    looked = list[Road]()

    def road(own: RawTracks) -> Road:
        class Shown(Road):
            def to_road(self, x: Any, y: Any) -> tuple[Any, Any]:
                looked.append(self)
                return own.lon, own.lat

        return Shown(Road.straight(2).edges, 1000.0)

    names = ("vehicle", "moment", "length", "width", "speed")
    rows = pl.DataFrame({name: getattr(of_roads[0], name) for name in names})
    return [road(own) for own in of_roads], rows.with_columns(x=0.0, y=0.0), looked


def assert_driven(found: Any, road: Road, own: RawTracks) -> None:
    """This road is the one, with its tracks."""
    assert found[0] is road
    assert all(np.array_equal(getattr(found[1], name), values) for name, values in vars(own).items())


def test_it_is_the_one_along_which_most_metres_are_driven_ahead():
    few_far, many_near = (
        tracks((0, 90, 1.8), (0, 30, -20), (0, 30, -20)),
        tracks((0, 60, 40), (0, 29, 1.8), (0, 29, 1.8)),
    )
    roads, rows, _ = frames(many_near, few_far)
    assert_driven(driven_road(roads, rows), roads[1], few_far)


def test_who_drives_back_does_not_count():
    against, along = tracks((300, 0, 1.8), (300, 0, 1.8), (0, 20, 1.8)), tracks((0, 20, 30), (0, 15, 1.8), (0, 15, 30))
    roads, rows, _ = frames(against, along)
    assert_driven(driven_road(roads, rows), roads[1], along)


def test_no_road_is_looked_for_after_one_on_which_most_is_driven():
    roads, rows, looked = frames(tracks((0, 90, 1.8), (0, 80, -20)), tracks((0, 90, 1.8), (0, 90, 1.8)))
    assert driven_road(roads, rows) is not None
    assert looked == roads[:1]
    assert driven_road([], rows) is None


def test_why_carriageways_are_no_roads_is_kept_and_a_lane_as_long_as_no_road_is_refused(lanelets: Any):
    problems = list[str]()
    assert len(list(roads_of(lanelets(3.5), problems))) == 1
    assert problems == []
    assert list(roads_of(lanelets(0.5), problems)) == []
    assert len(problems) == 1 and "the lane that leads the road is 0.5 m wide" in problems[0]
    with pytest.raises(DataError, match="a lane is 1e\\+06 m long"):
        list(roads_of(lanelets(3.5, length=1e6), problems))


@pytest.fixture
def lanelets() -> Any:
    """A network of one lane."""

    def made(width: float, length: float = 100.0) -> list[Any]:
        x = np.linspace(0, length, 30)
        none = {"adj_left": None, "adj_right": None, "adj_left_same_direction": None, "adj_right_same_direction": None}
        bounds = {"left_vertices": np.stack([x, 0 * x], -1), "right_vertices": np.stack([x, 0 * x - width], -1)}
        return [
            SimpleNamespace(
                lanelet_id=1, distance=np.array([0, length]), predecessor=[], successor=[], **bounds, **none
            )
        ]

    return made
