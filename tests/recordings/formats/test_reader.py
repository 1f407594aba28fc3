"""Readers by name: own ones, those of other packages, and what no reader recognises."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

import coverdrive as cd
from coverdrive.errors import DataError, RecordingError
from coverdrive.recordings.formats import reader as registry
from coverdrive.recordings.formats.reader import Head, How
from coverdrive.recordings.recording import SCHEMA, Recording
from coverdrive.road import Road
from shape_checks import unchecked

OWN = """
import polars as pl
import coverdrive as cd

def read_mine(file, how):
    table = pl.read_csv(file).select(
        vehicle="car", time=pl.col("ms") / 1000, x=pl.col("east_ft") * 0.3048, y=pl.col("north_ft") * 0.3048
    )
    return [cd.MapTracks(file.stem, table)]

def register():
    cd.register_reader("mine", read_mine, lambda head: {"car", "ms"} <= head.columns)
"""


@pytest.fixture(autouse=True)
def as_before() -> Iterator[None]:
    before = dict(cd.readers())
    yield
    registry._readers.clear()
    registry._readers.update(reversed(before.items()))


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """Six cars in three lanes of 12 ft at 20 m/s, northward, for 10 s."""
    rows = [
        {"Car": car, "ms": 100 * k, "east-ft": 12.0 * (car % 3), "north-ft": (30.0 * car + 2.0 * k) / 0.3048}
        for car in range(6)
        for k in range(100)
    ]
    pl.DataFrame(rows).rename({"Car": "car", "east-ft": "east_ft", "north-ft": "north_ft"}).write_csv(
        tmp_path / "mine.csv"
    )
    return tmp_path / "mine.csv"


def check(recording: Recording) -> None:
    assert recording.notes["format"] == "mine" and recording.repairs == {"assumed sizes": 6}
    assert recording.road.edges == pytest.approx([0, 3.6576, 7.3152, 10.9728], abs=0.05)
    assert recording.table["speed"].to_numpy() == pytest.approx(20.0, abs=0.01)
    lat = recording.table.filter(pl.col("vehicle") == 0)["lat"].to_numpy()
    assert lat == pytest.approx(10.9728 - 1.8288, abs=0.05)  # the westernmost lane is the left one


def test_an_own_reader(mine: Path):
    names: dict[str, object] = {}
    exec(OWN, names)
    with pytest.raises(RecordingError, match="unknown columns car, east_ft, ms, north_ft; if it is of one of"):
        cd.read(mine)
    names["register"]()  # pyright: ignore
    (recording,) = cd.read(mine)
    check(recording)
    assert next(iter(cd.readers())) == "mine"


def test_a_reader_of_another_package(mine: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "my_package.py").write_text(OWN)
    information = tmp_path / "my_package-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: my-package\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text("[coverdrive.readers]\nmine = my_package:register\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    (recording,) = cd.read(mine)
    check(recording)
    sys.modules.pop("my_package")


def test_formats_are_asked_for_by_name(mine: Path):
    with pytest.raises(RecordingError, match=r"there is no format 'nothing'; choose one of own, CommonRoad, I-24"):
        cd.read(mine, format="nothing")
    with pytest.raises(RecordingError, match="the file has no column vehicle_id"):
        cd.read(mine, format="ngsim")
    mine.rename(mine.with_suffix(".dat"))
    with pytest.raises(RecordingError, match=r"unknown kind of file '\.dat'.*or the name of its format"):
        cd.read(mine.with_suffix(".dat"))


def test_readers_may_give_finished_recordings_or_nothing(mine: Path):
    table = pl.DataFrame({name: [0, 0] if kind == pl.Int64 else [0.0, 0.1] for name, kind in SCHEMA.items()})
    table = table.with_columns(lon=pl.Series([0.0, 2.0]), speed=20.0, lat=1.8, heading=0.0, length=4.5, width=1.8)

    def whole(file: Path, how: How) -> list[Recording]:
        return [Recording("made", table.select(SCHEMA.names()), 0.1, Road.straight(), {})]

    cd.register_reader("whole", whole)
    assert [recording.name for recording in cd.read(mine, format="whole")] == ["made"]
    cd.register_reader("nothing", lambda file, how: [])
    with pytest.raises(RecordingError, match="it holds no recording"):
        cd.read(mine, format="nothing")

    def wrong(file: Path, how: How) -> list[Recording]:
        raise DataError("the traffic is painted")

    cd.register_reader("wrong", wrong)
    with pytest.raises(RecordingError, match=r"mine\.csv: the traffic is painted"):
        cd.read(mine, format="wrong")


@pytest.mark.parametrize(
    ("columns", "problem"),
    [
        ({"x": None}, "the reader gave no column x; expected vehicle, time, x, y"),
        ({"x": pl.lit(0.0), "y": pl.lit(0.0)}, r"no vehicle moves by 10 m or more"),
        ({"time": pl.lit(0.0)}, "no vehicle was seen at two times"),
        ({"time": pl.col("time") * 1000}, r"is 100 s; expected 0\.02 to 1 s"),
        ({"time": pl.col("time") + 0.04 * (pl.col("vehicle") % 2)}, "are not multiples of 0.1 s apart"),
        ({"vehicle": pl.col("vehicle") + 0.5}, "expected a whole number, got 0.5"),
        (
            {"vehicle": pl.format("v{}", "vehicle")},
            r"row 1, column vehicle: .* gave 'v0'; expected numbers, for vehicles",
        ),
        ({"x": pl.col("x").replace(0.0, np.nan)}, "row 1, column x: the reader gave nan; expected numbers"),
        ({"y": pl.when(pl.int_range(pl.len()) != 4).then("y")}, "row 5, column y: the reader gave None"),
        ({"length": pl.lit(15.0 / 0.3048), "width": pl.lit(6.0)}, "wider|median length .* check the unit"),
    ],
)
def test_tables_that_are_no_tracks(columns: dict[str, pl.Expr | None], problem: str, mine: Path):
    names: dict[str, object] = {}
    exec(OWN, names)

    def changed(file: Path, how: How) -> list[cd.MapTracks]:
        (tracks,) = names["read_mine"](file, how)  # pyright: ignore
        table = tracks.table.drop([name for name, value in columns.items() if value is None])
        kept = {name: value for name, value in columns.items() if value is not None}
        return [cd.MapTracks("mine", table.with_columns(**kept))]

    cd.register_reader("changed", changed)
    with pytest.raises(RecordingError, match=problem):
        cd.read(mine, format="changed")


@pytest.mark.parametrize(
    ("given", "problem"),
    [
        (lambda table: [table], "its reader gave an object of DataFrame; expected MapTracks or Recordings"),
        (lambda table: [cd.MapTracks("mine", table.lazy())], "gave a table of polars.*; expected a polars DataFrame"),
        (lambda table: [cd.MapTracks("mine", table), cd.MapTracks("mine", table)], "called 2 recordings 'mine'"),
    ],
)
def test_what_readers_should_not_give(given: Callable[[pl.DataFrame], list[Any]], problem: str, mine: Path):
    names: dict[str, Any] = {}
    exec(OWN, names)
    cd.register_reader("odd", lambda file, how: given(names["read_mine"](file, how)[0].table))
    with unchecked(), pytest.raises(RecordingError, match=problem):
        cd.read(mine, format="odd")


def test_recognisers_see_columns_in_one_spelling(tmp_path: Path):
    seen: list[Head] = []

    def see(head: Head) -> bool:
        seen.append(head)
        return False

    cd.register_reader("curious", lambda file, how: [], see)
    (tmp_path / "a.csv").write_text('"Lane-KF", Time\n1,2\n')
    with pytest.raises(RecordingError):
        cd.read(tmp_path / "a.csv")
    assert seen[0] == Head(".csv", frozenset({"lane_kf", "time"}), own=False)
