"""Vehicles of one number and one size are one, within a site and where numbers mean something."""

import numpy as np
import pytest

from coverdrive.prediction.data.split import both_ways
from coverdrive.recordings.tracks.numbering import Numbers, same_numbers, site_of
from coverdrive.recordings.tracks.repair import RawTracks


def shown(numbers: np.ndarray, sizes: np.ndarray, group: int) -> RawTracks:
    """Two rows of each vehicle of some numbers; its size [m] is that of its number in an original."""
    vehicle = np.repeat(numbers, 2)
    zero = np.zeros(len(vehicle))
    length, width = sizes[vehicle].T
    return RawTracks(
        vehicle, np.tile([0, 1], len(numbers)), zero, zero, length, width, zero, np.full_like(vehicle, group)
    )


def sizes_of(seed: int, vehicles: int = 60) -> np.ndarray:
    """Lengths and widths [m], in steps of half a foot, as of an original with so many numbers."""
    return 0.1524 * np.random.default_rng(seed).integers([26, 10], [46, 16], (vehicles, 2))


def pairs(*tracks: RawTracks, sites: str = "", numbers: Numbers = "unsaid", files: str = "") -> set[tuple[int, ...]]:
    count = len(tracks)
    named = [int(file) for file in files] or list(range(count))
    names = [f"DEU_{site}-1_1_T-1" for site in sites] or [""] * count
    found = same_numbers(tracks, named, names, [numbers] * count)
    return {tuple(row) for row in found.select("recording", "recording_b", "vehicle", "vehicle_b").iter_rows()}


def test_vehicles_that_come_back_are_found_by_number_and_size() -> None:
    sizes, other = sizes_of(0), sizes_of(0)
    other[24] += 1.0  # a number with two sizes is two vehicles
    early, late = shown(np.arange(25), sizes, 0), shown(np.arange(20, 60), other, 1)
    expected = {(0, 1, number, number) for number in (20, 21, 22, 23)}
    assert pairs(early, late) == expected
    assert pairs(early, late, numbers="stable") == expected
    assert pairs(early, late, files="00") == set()
    assert pairs(early, late, sites="ab") == set()


def test_numbers_that_restart_say_nothing() -> None:
    """The negative control: the same numbers in other originals, of which a few have one size by chance."""
    tracks = [shown(np.arange(60), sizes_of(seed), seed) for seed in range(5)]
    assert pairs(*tracks) == set()
    assert 0 < len(pairs(*tracks, numbers="stable")) < 60  # as if one had said that they are one numbering
    again = [tracks[0], shown(np.arange(60), sizes_of(0), 1)]
    assert pairs(*again, numbers="restart") == set() and len(pairs(*again)) == 60


def test_sizes_that_all_vehicles_have_tell_nothing() -> None:
    alike = np.full((60, 2), [4.8, 1.9])
    assert pairs(shown(np.arange(60), alike, 0), shown(np.arange(60), alike, 1)) == set()


def test_each_pair_of_groups_is_named() -> None:
    """A long recording whose vehicles 0 … 9 are in its first group and 5 … 14 in its second."""
    sizes = sizes_of(0)
    parts = shown(np.arange(10), sizes, 0), shown(np.arange(5, 15), sizes, 1)
    joined = (np.concatenate(each) for each in zip(*(vars(part).values() for part in parts), strict=True))
    long = RawTracks(*joined)
    found = same_numbers([long, shown(np.arange(8), sizes, 2)], [0, 1], ["", ""], ["unsaid", "unsaid"])
    assert set(found.select("group", "group_b").iter_rows()) == {(0, 2), (1, 2)}


@pytest.mark.parametrize(
    ("name", "site"),
    [("USA_US101-13_1_T-1", "USA_US101"), ("C-DEU_A9-3_1_T-1", "DEU_A9"), ("us101_around_vehicle_320", "")],
)
def test_the_site_of_a_benchmark_is_its_country_and_town(name: str, site: str) -> None:
    assert site_of(name) == site


def test_no_vehicle_of_two_groups_is_on_two_sides() -> None:
    vehicle, group = np.repeat(np.arange(30), 4), np.repeat([3, 9], 60)
    for each in both_ways(vehicle, group):
        assert each.crossed and not set(vehicle[each.train]) & set(vehicle[each.calibration])
        assert len(each.train) == len(each.calibration) == 60 and each.dropped == 0
