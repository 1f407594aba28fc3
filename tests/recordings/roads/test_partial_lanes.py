"""Lanes that begin or end, told from what vehicles do beside lanes that go on."""

from dataclasses import replace

import numpy as np
import pytest

from coverdrive.recordings.roads.partial_lanes import ENOUGH, TAPER, Lanes, with_partial_lanes
from coverdrive.recordings.tracks.repair import RawTracks
from coverdrive.road import Road
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate

EDGES, LENGTH = np.array([0.0, 3.6, 7.2]), 600.0
MERGES = 150.0 + 15.0 * np.arange(8)
"""[m] where vehicles change from a lane on the right of two to the next one"""


def tracks(*ways: tuple[list[float], list[float]]) -> RawTracks:
    """Vehicles that are at lateral positions at positions along the road, and there from the first to the last."""
    spots = [np.arange(lon[0], lon[-1] + 1.0, 2.0) for lon, _ in ways]
    lon, lat = np.concatenate(spots), np.concatenate([np.interp(at, *way) for at, way in zip(spots, ways, strict=True)])
    vehicle = np.repeat(np.arange(len(ways)), [len(at) for at in spots])
    size = np.full(len(lon), 4.0)
    return RawTracks(vehicle, np.round(lon / 2).astype(int), lon, lat, size, size / 2, 5 * size, 0 * vehicle)


def all_along(lat: float, count: int = 20) -> list[tuple[list[float], list[float]]]:
    return [([0.0, LENGTH], [lat, lat])] * count


def merging(count: int = 8) -> list[tuple[list[float], list[float]]]:
    return [([20.0, at - 20, at + 20, LENGTH], [-1.8, -1.8, 1.8, 1.8]) for at in MERGES[:count]]


MAIN = all_along(1.8) + all_along(5.4)
RAMP = tracks(*MAIN, *merging())


def turned(raw: RawTracks) -> RawTracks:
    """Driven backwards in time: a ramp that comes becomes one that goes."""
    return replace(raw, lon=LENGTH - raw.lon)


def mirrored(raw: RawTracks) -> RawTracks:
    return replace(raw, lat=EDGES[-1] - raw.lat)


def road(found: Lanes) -> Road:
    return Road(found.edges, LENGTH, changing=found.changing)


def test_a_ramp_beside_the_lanes_becomes_one_that_ends():
    found = with_partial_lanes([RAMP], EDGES)
    assert found.right == pytest.approx(-3.6, abs=0.1) and found.told == "; begin or end on the right: 1"
    assert found.edges == pytest.approx([0.0, 3.6, 7.2, 10.8], abs=0.1)
    last = MERGES[-1]
    there = road(found).has_lane(np.array([0.0, 100.0, last - 1, last + TAPER, LENGTH]))
    assert there[:, 0].tolist() == [True, True, True, False, False] and there[:, 1:].all()
    assert road(found).edges_at(LENGTH)[:2] == pytest.approx(found.edges[1])


def test_backwards_it_begins_and_mirrored_it_is_on_the_left():
    begins = with_partial_lanes([turned(RAMP)], EDGES)
    first = LENGTH - MERGES[-1]
    there = road(begins).has_lane(np.array([0.0, first - TAPER, first + 1, LENGTH]))
    assert there[:, 0].tolist() == [False, False, True, True] and there[:, 1:].all()
    left = with_partial_lanes([mirrored(RAMP)], EDGES)
    assert left.right == 0.0 and left.told == "; begin or end on the left: 1"
    assert left.changing is not None
    there = road(left).has_lane(np.array([100.0, LENGTH]))
    assert there[:, 2].tolist() == [True, False] and there[:, :2].all()
    both = with_partial_lanes([RAMP, turned(mirrored(RAMP))], EDGES)
    assert both.told == "; begin or end on the right: 1; begin or end on the left: 1" and len(both.edges) == 5


def test_a_lane_that_was_taken_as_going_on_ends():
    """As one of more than 2 % of the rows, whose edges are known; two may, one after the other."""
    known = np.concatenate([[-3.6], EDGES])
    found = with_partial_lanes([RAMP], known)
    assert found.right == -3.6 and found.edges == pytest.approx(known + 3.6)
    assert road(found).has_lane(np.array([100.0, LENGTH])).tolist() == [[True] * 3, [False, True, True]]
    rest = [([0.0, at + 150, at + 190, LENGTH], [1.8, 1.8, 5.4, 5.4]) for at in MERGES]
    twice = [
        ([*lon[:3], *more[1:]], [*lat[:3], *left[1:]]) for (lon, lat), (more, left) in zip(merging(), rest, strict=True)
    ]
    two = with_partial_lanes([tracks(*rest, *all_along(5.4), *twice)], known)
    there = road(two).has_lane(np.array([100.0, 330.0, LENGTH]))
    assert there.tolist() == [[True] * 3, [False, True, True], [False, False, True]]


def test_beside_a_lane_that_begins_or_ends_there_is_none_where_it_is_not():
    """Else a lane would begin or end in the middle of the road: the inner one is taken as going on."""
    outer = [([100.0, 400.0 + at, 440.0 + at, LENGTH], [-1.8, -1.8, 1.8, 1.8]) for at in range(0, 60, 10)]
    inner = [([0.0, at + 80, at + 120, LENGTH], [5.4, 5.4, 1.8, 1.8]) for at in MERGES]
    known = np.concatenate([[-3.6], EDGES])
    found = with_partial_lanes([tracks(*all_along(5.4), *outer, *inner)], known)
    there = road(found).has_lane(np.array([20.0, 120.0, 300.0, LENGTH]))
    assert there.tolist() == [[False, True, True], [True] * 3, [True] * 3, [False, True, True]]
    alone = with_partial_lanes([tracks(*all_along(5.4), *inner)], known[1:])
    assert road(alone).has_lane(np.array([20.0, 300.0])).tolist() == [[False, True], [True, True]]


def test_a_lane_beside_two_ramps_begins_and_ends():
    weaving = [([0.0, 200.0 + at, 240.0 + at, 400.0, 500.0], [1.8, 1.8, -1.8, -1.8, -12.0]) for at in range(0, 100, 20)]
    coming = [([100.0, 180.0, 250.0 + at, 290.0 + at, LENGTH], [-12.0, -1.8, -1.8, 1.8, 1.8]) for at in (0, 30, 60, 90)]
    found = with_partial_lanes([tracks(*MAIN, *weaving, *coming)], EDGES)
    there = road(found).has_lane(np.array([50.0, 120.0, 190.0, 300.0, 390.0, 460.0, LENGTH]))
    assert there[:, 0].tolist() == [False, False, True, True, True, False, False]


@pytest.mark.parametrize(
    "others",
    [
        merging(ENOUGH - 1),
        [*merging(), ([0.0, LENGTH], [-1.8, -1.8])],  # somebody goes on in it
        [([20.0, at], [-1.8, -1.8]) for at in MERGES],  # all that is seen of them ends elsewhere, one by one
        [([0.0, 200.0, 220.0, 300.0, 320.0, LENGTH], [1.8, 1.8, -1.0, -1.0, 1.8, 1.8])] * 9,  # never wholly beside
        [([0.0, 100.0, 110.0, 120.0, 130.0, LENGTH], [1.8, 1.8, -1.8, -1.8, 1.8, 1.8])] * 9,  # for 20 m
        [([20.0, at - 20, at + 20, LENGTH], [-9.0, -9.0, 1.8, 1.8]) for at in MERGES[:4]],  # a road of its own
    ],
)
def test_what_cannot_be_told_is_no_lane(others: list[tuple[list[float], list[float]]]):
    found = with_partial_lanes([tracks(*MAIN, *others)], EDGES)
    assert found.changing is None and found.told == ""
    assert found.right == 0.0 and np.array_equal(found.edges, EDGES)


def test_a_share_below_that_of_a_lane_is_none():
    assert with_partial_lanes([tracks(*all_along(1.8, 200), *all_along(5.4, 200), *merging())], EDGES).told == ""


def test_an_outer_lane_that_many_leave_goes_on_if_some_stay_in_it():
    known = np.concatenate([[-3.6], EDGES])
    stay = [([0.0, LENGTH], [-1.8, -1.8])] * 2
    assert with_partial_lanes([tracks(*MAIN, *merging(), *stay)], known).changing is None
    assert with_partial_lanes([tracks(*merging())], known).changing is not None


def test_generated_traffic_without_a_ramp_has_none():
    for recording in generate(GeneratedSettings(scenes=12, duration=40.0, vehicles=(40, 60)), seed=8):
        table = recording.table
        values = {
            name: table[name].to_numpy() for name in ("vehicle", "lon", "lat", "length", "width", "speed", "group")
        }
        raw = RawTracks(moment=np.rint(table["time"].to_numpy() * 10).astype(int), **values)
        assert with_partial_lanes([raw], np.asarray(recording.road.edges)).told == ""
