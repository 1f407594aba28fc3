"""What trained or calibrated is refused however it is cut, shifted, numbered or called; what is new is welcome."""

import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from coverdrive.errors import DataError
from coverdrive.prediction.data.held_out import Seen
from coverdrive.prediction.data.segments import cut_segments
from coverdrive.prediction.data.split import Split, both_ways, split
from coverdrive.prediction.fit import Fit
from coverdrive.recordings.read import read, together
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.recordings.tracks.resampling import resampled
from coverdrive.recordings.tracks.smoothing import SmoothingSettings
from coverdrive.road import Road
from coverdrive.simulation.drivers.generated import GeneratedSettings, generate


def names(recordings: tuple[Recording, ...]) -> list[str]:
    return [each.name for each in recordings]


def test_only_the_groups_of_the_test_split_are_left(fitted: Fit, scenes: tuple[Recording, ...]) -> None:
    kept = fitted.seen.unseen(scenes)
    groups = {int(group) for recording in kept for group in recording.table["group"].unique()}
    assert groups == set(fitted.segments.group[fitted.split.test].tolist())
    made_from = np.concatenate([fitted.split.train, fitted.split.calibration])
    assert not groups & set(fitted.segments.group[made_from].tolist())


def test_each_recording_is_known_by_itself(fitted: Fit, scenes: tuple[Recording, ...]) -> None:
    whole = {recording.name for recording in fitted.seen.unseen(scenes)}
    for recording in scenes:
        kept = fitted.seen.unseen([recording])
        assert names(kept) == ([recording.name] if recording.name in whole else [])


def test_keys_and_groups_are_not_asked(fitted: Fit, scenes: tuple[Recording, ...]) -> None:
    """They are others where other recordings are read beside."""
    keys = {"group": pl.lit(7, pl.Int64), "identity": pl.col("vehicle")}
    others = tuple(replace(each, table=each.table.with_columns(**keys)) for each in scenes)
    assert names(fitted.seen.unseen(others)) == names(fitted.seen.unseen(scenes))


def test_recordings_that_it_never_saw_are_kept_whole(fitted: Fit, monkeypatch: pytest.MonkeyPatch) -> None:
    """All of them are looked for in what was seen at once."""
    new, looked = generate(GeneratedSettings(scenes=3, duration=5.0, vehicles=(4, 5)), seed=9), list[int]()
    shared_with = Seen.shared_with
    monkeypatch.setattr(Seen, "shared_with", lambda *given: looked.append(len(given[1])) or shared_with(*given))
    kept = fitted.seen.unseen(new)
    assert looked == [3]
    assert names(kept) == names(new)
    assert all(one.table.equals(other.table) for one, other in zip(kept, new, strict=True))


def test_tracks_come_back_from_their_file(fitted: Fit, tmp_path: Path) -> None:
    fitted.seen.save(tmp_path / "seen.parquet")
    again = Seen.load(tmp_path / "seen.parquet", fitted.seen.sources)
    assert again.tracks.equals(fitted.seen.tracks) and len(again.tracks)


def crossing() -> Recording:
    """Blocks of 20 s; every vehicle is seen for 15 s, the next one 5 s later."""
    vehicle, moment = np.divmod(np.arange(31 * 150), 150)
    time = np.round(5.0 * vehicle + 0.1 * moment, 1)
    columns = {
        "vehicle": vehicle,
        "group": (time // 20).astype(np.int64),
        "time": time,
        "lon": 22.0 * 0.1 * moment,
        "lat": 1.8 + 3.6 * (vehicle % 3),
        "speed": 22.0,
        "heading": 0.0,
        "length": 4.6,
        "width": 1.9,
    }
    return Recording("crossing", pl.DataFrame(columns, schema=SCHEMA), 0.1, Road.straight(), {})


@pytest.mark.parametrize("seed", range(4))
def test_scenes_at_a_border_that_vehicles_cross_are_not_replayed(seed: int) -> None:
    recording = crossing()
    segments = cut_segments([recording])
    sides = split(segments.vehicle, segments.group, seed=seed)
    made_of = np.concatenate([sides.train, sides.calibration])
    (kept,) = Seen.of([recording], segments, sides).unseen([recording])
    assert not np.isin(kept.table["identity"].to_numpy(), segments.vehicle[made_of]).any()
    tested = set(segments.group[sides.test].tolist())
    left = set(kept.table["group"].to_list())
    assert left < tested and len(left) == len(tested) - 1


def test_the_last_second_of_a_recording_is_not_looked_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """No segment begins in it. In many long recordings, that takes as long as to compare all with all for each."""
    whole, end = crossing(), 99
    group = pl.when(pl.col("time") < 164.0).then(pl.col("group")).otherwise(end)
    recording = replace(whole, table=whole.table.with_columns(group=group))
    segments = cut_segments([recording])
    sides = (np.flatnonzero(chosen) for chosen in (segments.group < 5, segments.group == 5, segments.group > 5))
    told = Seen.of([recording], segments, Split(*sides, dropped=0))
    monkeypatch.setattr(Seen, "shared_with", lambda *_: ["all"])
    (kept,) = told.unseen([recording])
    assert end not in segments.group and kept.table["group"].unique().sort().to_list() == [7, 8, end]


def test_who_trained_is_recognised_in_the_next_minute() -> None:
    """A recording of what comes after the border alone, with other numbers, shows who has crossed it."""
    (whole,) = generate(GeneratedSettings(scenes=1, duration=40.0, vehicles=(6, 6)), seed=4)
    halves = replace(whole, table=whole.table.with_columns(group=(pl.col("time") >= 20.0).cast(pl.Int64)))
    segments = cut_segments([halves])
    trained = np.flatnonzero(segments.group == 0)
    told = Seen.of([halves], segments, Split(trained, trained[:0], trained[:0], dropped=0))
    later = halves.table.filter(pl.col("time") > 22.0).with_columns(vehicle=pl.col("vehicle") + 50)
    (shared,) = told.shared_with([replace(whole, table=later.drop("identity"), name="anew")])
    assert "vehicles of generated 1" in shared


WINDOW = 3.1
"""[s] that show 3 s of a vehicle"""


FEW = (1, 13, 9, 19)
"""of the shared scenes: two of each group"""


@cache
def both_folds(folder: Path, few: bool) -> tuple[tuple[Recording, ...], tuple[Seen, ...]]:
    """Shared scenes, and what was seen where one of their two groups trains and the other one tests."""
    shared = folder / "commonroad"
    recordings = read([shared / f"USA_US101-{number}_1_T-1.xml" for number in FEW] if few else shared)
    segments = cut_segments(recordings)
    crossed = both_ways(segments.vehicle, segments.group)
    halves = (replace(each, calibration=each.train[:0]) for each in crossed)
    return recordings, tuple(Seen.of(recordings, segments, half) for half in halves)


def cut(recording: Recording, random: np.random.Generator) -> Recording:
    """A window or longer, of half of the vehicles, shifted by up to 50 m, with other numbers and another name."""
    time, vehicles = recording.table["time"], recording.table["vehicle"].unique().to_numpy()
    first = random.uniform(time.min(), time.max() - WINDOW)
    last = random.uniform(first + WINDOW, time.max())
    kept = random.choice(vehicles, (len(vehicles) + 1) // 2, replace=False)
    numbers = dict(zip(kept.tolist(), random.permutation(len(kept)).tolist(), strict=True))
    table = recording.table.filter(pl.col("time").is_between(first, last), pl.col("vehicle").is_in(kept.tolist()))
    shift = pl.col("lon", "seen_lon") + random.uniform(0, 50)
    start = round(random.uniform(0, 9), 1) - float(table["time"].min())
    moved = table.with_columns(shift, ((pl.col("time") + start) * 10).round() / 10, pl.col("vehicle").replace(numbers))
    return replace(recording, table=moved.drop("identity").sort("vehicle", "time"), name="anew")


def judged(folder: Path, few: bool, tries: int, seed: int) -> tuple[int, int, int]:
    """How many random copies of what was seen are refused, how many were tried, and how many new ones are refused."""
    recordings, seen = both_folds(folder, few)
    long = [number for number, each in enumerate(recordings) if np.ptp(each.table["time"].to_numpy()) > WINDOW]
    random = np.random.default_rng(seed)
    refused, tried, wrongly = 0, 0, 0
    for _ in range(tries):
        number, fold = int(random.choice(long)), seen[random.integers(2)]
        used = bool(fold.sources[number].used)
        found = bool(fold.shared_with([cut(recordings[number], random)])[0])
        refused, tried, wrongly = refused + (found and used), tried + used, wrongly + (found and not used)
    return refused, tried, wrongly


def test_a_few_copies_of_shared_scenes_are_refused_and_none_that_is_new(us101: Path) -> None:
    refused, tried, wrongly = judged(us101, True, 8, seed=1)
    assert refused == tried > 2 and wrongly == 0


@pytest.mark.slow
def test_no_copy_of_shared_scenes_passes_and_nothing_new_is_refused(us101: Path) -> None:
    refused, tried, wrongly = judged(us101, False, 200, seed=0)
    assert refused == tried > 80 and wrongly == 0


@pytest.mark.parametrize(("late", "dt"), [(37, 0.1), (38, 0.2), (39, 0.04)])
def test_a_cut_of_frames_between_two_steps_is_recognised(late: int, dt: float) -> None:
    """The file has 25 Hz; the cut begins between two rows of what was seen, and is read at any time step.

    One of the six keeps its speed, which tells nothing.
    """
    (filmed,) = generate(GeneratedSettings(scenes=1, duration=20.0, dt=0.04, vehicles=(6, 6)), seed=4)
    seen = resampled(filmed, 0.1, SmoothingSettings())
    segments = cut_segments([seen])
    told = Seen.of([seen], segments, Split(np.arange(len(segments)), *2 * [np.arange(0)], dropped=0))
    moment = (pl.col("time") / 0.04).round() - late
    table = filmed.table.filter(moment >= 0).with_columns(time=0.04 * moment, vehicle=pl.col("vehicle") + 50)
    cut_out = Recording("anew", table.select(SCHEMA.names()), 0.04, filmed.road, {})
    other = generate(GeneratedSettings(scenes=1, duration=20.0, dt=0.04, vehicles=(6, 6)), seed=5)[0]
    both = [resampled(each, dt, SmoothingSettings()) for each in (cut_out, other)]
    assert told.shared_with(both) == ["5 vehicles of generated 1", ""]


def test_a_scene_at_5_hz_is_recognised_under_another_name(roads: Path, tmp_path: Path) -> None:
    file = roads / "C-DEU_MONAEast-2_480_T-559.xml"
    copied = tmp_path / "another.xml"
    shutil.copy(file, copied)
    alone, both = (cut_segments(some) for some in (read(file), together([*read(file), *read(copied)])))
    assert len(both) == 2 * len(alone)
    assert len(np.unique(both.vehicle)) == len(np.unique(alone.vehicle)) and len(np.unique(both.group)) == 1


def test_each_is_told_as_if_it_was_given_alone(us101: Path) -> None:
    recordings, seen = both_folds(us101, few=True)
    random = np.random.default_rng(3)
    copies = [cut(each, random) for each in recordings if np.ptp(each.table["time"].to_numpy()) > WINDOW]
    for fold in seen:
        alone = [fold.shared_with([each])[0] for each in copies]
        assert any(alone) and not all(alone) and fold.shared_with(copies) == alone


def test_what_is_shared_is_named(us101: Path) -> None:
    recordings, seen = both_folds(us101, few=True)
    trained = next(each for each, source in zip(recordings, seen[0].sources, strict=True) if source.used)
    copy = cut(trained, np.random.default_rng(0))
    with pytest.raises(DataError, match=rf"anew shows \d+ vehicles? of .*{trained.name}.*which trained or calibrated"):
        seen[0].unseen([copy])
    assert seen[0].unseen([trained]) == ()
