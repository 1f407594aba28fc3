"""Shared vehicles are found at any offset of clocks and numbers, and only they."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from coverdrive.prediction.data.segments import cut_segments
from coverdrive.prediction.data.split import split
from coverdrive.recordings.read import read
from coverdrive.recordings.tracks import overlap
from coverdrive.recordings.tracks.overlap import shared_vehicles
from coverdrive.recordings.tracks.repair import RawTracks


def speeds(seed: int, vehicles: int = 8, moments: int = 120) -> np.ndarray:
    """Speeds (vehicles, moments) [m/s] that change smoothly, as stated by a file."""
    random = np.random.default_rng(seed)
    jerk = np.cumsum(random.normal(0, 0.05, (vehicles, moments)), axis=1)
    return 15 + random.normal(0, 2, (vehicles, 1)) + np.cumsum(0.1 * jerk, axis=1)


def raw_of(values: np.ndarray, first_vehicle: int = 0, first_moment: int = 0) -> RawTracks:
    vehicles, moments = values.shape
    vehicle = np.repeat(first_vehicle + np.arange(vehicles), moments)
    moment = np.tile(first_moment + np.arange(moments), vehicles)
    zero = np.zeros(values.size)
    return RawTracks(vehicle, moment, zero, zero, zero, zero, values.ravel(), 0 * vehicle)


def numbered(tracks: Sequence[RawTracks]) -> list[RawTracks]:
    """Each recording as a group of its own."""
    return [replace(track, group=np.full(len(track.vehicle), number)) for number, track in enumerate(tracks)]


def pairs_of(*tracks: RawTracks, files: list[int] | None = None) -> list[tuple[int, int]]:
    return group_pairs(shared_vehicles(numbered(tracks), files or list(range(len(tracks))), [0.1] * len(tracks)))


def group_pairs(shared: pl.DataFrame) -> list[tuple[int, int]]:
    return sorted(set(shared.select("group", "group_b").iter_rows()))


def test_cuts_of_one_original_are_found():
    original = speeds(0)
    early, late = raw_of(original[:6, :70]), raw_of(original[2:, 40:], first_vehicle=500, first_moment=3)
    assert pairs_of(early, late, raw_of(speeds(1))) == [(0, 1)]


def test_the_same_vehicles_are_paired_and_only_they():
    original = 15 + 3 * (speeds(0) - 15)
    early, late = raw_of(original[:6, :70]), raw_of(original[2:, 40:], first_vehicle=500, first_moment=3)
    shared = shared_vehicles(numbered([early, late]), [0, 1], [0.1, 0.1])
    assert sorted(shared.select("vehicle", "vehicle_b").iter_rows()) == [(v, 498 + v) for v in range(2, 6)]


def test_rounded_copies_are_found():
    original = speeds(0)
    assert pairs_of(raw_of(original), raw_of(np.round(original, 2))) == [(0, 1)]


@pytest.mark.parametrize("rows", [2, 3, 5])
@pytest.mark.parametrize("later", [0, 1])
def test_copies_are_found_where_each_speed_is_held_for_several_rows(rows: int, later: int):
    """As those of files at 5 Hz are, whose rows are told at 10 Hz."""
    held = np.repeat(3 * speeds(0), rows, axis=1)
    assert pairs_of(raw_of(held), raw_of(held[2:, 40 + later :], first_vehicle=500), raw_of(speeds(1))) == [(0, 1)]


def test_rounded_copies_are_found_at_50_hz():
    for seed in range(4):
        fine = np.repeat(3 * speeds(seed, moments=80), 5, axis=1)
        fine = np.apply_along_axis(lambda row: np.convolve(row, np.ones(5) / 5, "valid"), 1, fine)
        copies = [raw_of(fine), raw_of(np.round(fine, 2))]
        shared = shared_vehicles(numbered(copies), [0, 1], [0.02] * 2)
        assert group_pairs(shared) == [(0, 1)]


def test_different_traffic_is_kept_apart():
    assert pairs_of(*(raw_of(speeds(seed, vehicles=20)) for seed in range(6))) == []


def test_equal_parts_of_different_tracks_are_no_proof():
    first, second = speeds(0), speeds(1)
    second[:3, 50:65] = first[:3, 50:65]
    assert pairs_of(raw_of(first), raw_of(second)) == []


def test_one_vehicle_proves_an_overlap_only_when_it_is_seen_for_long():
    original = 15 + 3 * (speeds(0, vehicles=1) - 15)
    assert pairs_of(raw_of(original[:, :60]), raw_of(original[:, 20:])) == [(0, 1)]
    assert pairs_of(raw_of(original[:, :60]), raw_of(original[:, 40:])) == []


def test_constant_speeds_are_no_proof():
    assert pairs_of(raw_of(np.full((5, 100), 15.0)), raw_of(np.full((5, 100), 15.0))) == []


def test_vehicles_that_roll_out_alike_are_no_proof():
    """Of two drivers who come off the throttle at the same speed, none fluctuates."""
    time = 0.1 * np.arange(60)
    slow_down = 20 - 0.8 * time - 0.05 * time**2
    assert pairs_of(raw_of(slow_down[None]), raw_of(slow_down[None] + 0.005)) == []
    uneven = slow_down + 0.1 * np.sin(2 * time)
    assert pairs_of(raw_of(uneven[None]), raw_of(uneven[None] + 0.005)) == [(0, 1)]


def test_frames_of_25_hz_prove_no_more_than_those_of_10_hz():
    """1.6 s of one vehicle are 40 rows, which are too few at any rate; 4 s are enough."""
    uneven = 20 + 2 * np.sin(np.arange(100) * 0.04 * 4)[None]
    for rows, found in ((40, 0), (100, 1)):
        short = raw_of(uneven[:, :rows])
        both = numbered([short, short])
        assert len(shared_vehicles(both, [0, 1], [0.04, 0.04])) == found
        assert len(shared_vehicles(both, [0, 1], [0.1, 0.04])) == 0


def test_what_is_found_does_not_depend_on_how_much_is_compared_at_once(monkeypatch: pytest.MonkeyPatch):
    original = 15 + 3 * (speeds(0) - 15)
    cuts = [raw_of(original[:, start : start + 60], first_vehicle=10 * start) for start in (0, 10, 20, 30)]
    tracks, calls = numbered([*cuts, raw_of(speeds(1))]), list[int]()
    compare = overlap._shared
    monkeypatch.setattr(overlap, "_shared", lambda *given: calls.append(len(given[2])) or compare(*given))
    found, most = [], []
    for at_once in (overlap.AT_ONCE, 1000, 1):
        monkeypatch.setattr(overlap, "AT_ONCE", at_once)
        calls.clear()
        found.append(shared_vehicles(tracks, range(len(tracks)), [0.1] * len(tracks)))
        most.append(max(calls))
    assert len(found[0]) >= 6 * 8 and all(each.equals(found[0]) for each in found[1:])
    assert most[0] >= 24 > most[1] >= most[2] == 8  # those of three other cuts, and of one


def filmed(seed: int, vehicles: int = 60, moments: int = 250) -> np.ndarray:
    """Speeds (vehicles, moments) [m/s] of 25 Hz, of independent drivers on one road, stated to 1 cm/s."""
    random = np.random.default_rng(seed)
    change = np.cumsum(random.normal(0, 0.05, (vehicles, moments)), axis=1) + random.normal(0, 0.3, (vehicles, 1))
    return np.round(25 + random.normal(0, 1, (vehicles, 1)) + np.cumsum(0.04 * change, axis=1), 2)


def test_hardly_any_of_the_pairs_with_equal_runs_is_compared_whole(monkeypatch: pytest.MonkeyPatch):
    """Smooth speeds of 25 Hz often have equal runs by chance."""
    tracks = numbered([raw_of(filmed(seed)) for seed in range(4)])
    compare, pairs, rows = overlap._shared, list[int](), list[int]()

    def counted(track: pl.DataFrame, others: pl.DataFrame, found: pl.DataFrame, lone: int) -> pl.DataFrame:
        pairs.append(len(found))
        rows.append(len(others))
        return compare(track, others, found, lone)

    monkeypatch.setattr(overlap, "_shared", counted)
    found = shared_vehicles(tracks, range(4), [0.04] * 4)
    few = sum(pairs), sum(rows)
    assert few[0] < 20 and few[1] < sum(len(track.vehicle) for track in tracks) / 4
    monkeypatch.setattr(overlap, "LOOKED_AT", ())
    assert shared_vehicles(tracks, range(4), [0.04] * 4).equals(found)
    assert sum(pairs) - few[0] > 100 * max(1, few[0])


def test_where_they_are_looked_at_first_does_not_change_what_is_found(monkeypatch: pytest.MonkeyPatch):
    """Also where rows are missing."""
    original, random = filmed(0, vehicles=20, moments=400), np.random.default_rng(0)
    tracks = [raw_of(original), raw_of(filmed(1))]
    for start in random.integers(0, 320, 6):
        part = raw_of(original[:, start : start + 80], first_vehicle=start)
        kept = random.random(len(part.vehicle)) > 0.01
        tracks.append(RawTracks(**{name: values[kept] for name, values in vars(part).items()}))
    given = numbered(tracks), range(len(tracks)), [0.04] * len(tracks)
    found = shared_vehicles(*given)
    monkeypatch.setattr(overlap, "LOOKED_AT", ())
    assert shared_vehicles(*given).equals(found) and {pair for pair in group_pairs(found) if 0 in pair} >= {(0, 7)}


@pytest.mark.parametrize("digits", [2, 9])
def test_cuts_of_25_hz_are_found_wherever_they_begin(digits: int):
    """3 s of four vehicles, whose speeds may be rounded."""
    random = np.random.default_rng(0)
    original = filmed(0, moments=750) + random.uniform(-0.005, 0.005, (60, 750))
    for start in random.integers(0, 675, 20):
        shown = np.round(original[random.choice(60, 4, replace=False), start : start + 75], digits)
        both = numbered([raw_of(original), raw_of(shown)])
        assert group_pairs(shared_vehicles(both, [0, 1], [0.04] * 2)) == [(0, 1)]


def test_recordings_of_one_file_are_not_compared():
    original = raw_of(speeds(0))
    assert pairs_of(original, original, files=[0, 0]) == []


def test_only_the_groups_that_overlap_are_paired():
    original = speeds(0, moments=200)
    long, short = raw_of(original), raw_of(original[:, 130:170])
    long = replace(long, group=np.where(long.moment < 100, 0, 1))
    short = replace(short, group=np.full(len(short.vehicle), 2))
    assert group_pairs(shared_vehicles([long, short], [0, 1], [0.1, 0.1])) == [(1, 2)]


@pytest.mark.real_data
@pytest.mark.slow
def test_recorded_scenarios_of_us101(us101: Path):
    groups: dict[int, set[int]] = {}
    recordings = read([us101 / "commonroad"])
    for recording in recordings:
        (group,) = recording.table["group"].unique()
        groups.setdefault(group, set()).add(int(recording.name.split("-")[1].split("_")[0]))
    # Motion links {1, 13, 14, 23, 24}, {6, 7, 9, 19, 20, 25, 28} and {12, 17}, numbers and sizes these and the others.
    assert [sorted(found) for found in groups.values()] == [
        [1, 8, 11, 13, 14, 23, 24, 26, 30, 33],
        [2, 3, 6, 7, 9, 10, 12, 16, 17, 19, 20, 25, 28, 29, 32],
    ]
    assert list(groups) == list(range(len(groups)))
    table = pl.concat(each.table for each in recordings)
    assert len(table.unique(["identity"])) == len(table.unique(["identity", "group"])) < 400  # 611 by motion alone
    segments = cut_segments(recordings)
    counts = [len(np.unique(segments.vehicle[segments.group == group])) for group in groups]
    assert counts == [91, 203]
    found = split(segments.vehicle, segments.group)
    assert found.crossed and len(np.unique(segments.vehicle[found.calibration])) == 203
