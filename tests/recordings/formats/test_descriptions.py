"""Descriptions of another recording are refused with the place; tracks that were cut are not."""

from collections.abc import Callable
from pathlib import Path

import polars as pl
import pytest
from published_formats import truth, write_exid, write_highd

from coverdrive.errors import RecordingError
from coverdrive.recordings.read import read

REAL, OTHER = (truth(0.04, seconds=5.0, seed=seed) for seed in (3, 4))
WRITERS = {"01": write_highd, "03": write_exid}


def changed(path: Path, **changes: pl.Expr) -> Path:
    pl.read_csv(path).with_columns(**changes).write_csv(path)
    return path


def third(name: str, value: pl.Expr) -> dict[str, pl.Expr]:
    """One cell of the third vehicle."""
    return {name: pl.when(pl.int_range(pl.len()) == 2).then(value).otherwise(pl.col(name))}


LISTED: dict[str, tuple[dict[str, pl.Expr], str]] = {
    "later": (
        {name: pl.col(name) + 5 for name in ("initialFrame", "finalFrame")},
        r"column frame: vehicle 1 has frames \d+ to \d+; expected \d+ to \d+, as 0\d_tracksMeta\.csv says: check",
    ),
    "one ends earlier": (third("finalFrame", pl.col("finalFrame") - 9), r"column frame: vehicle 3 has frames"),
    "one has fewer": (third("numFrames", pl.lit(10)), r"column frame: vehicle 3 has \d+ frames; expected up to 10, as"),
    "one is wider": (
        third("width", pl.col("width") + 0.3),
        r"column width: vehicle 3 has a width of .* m; expected .* m",
    ),
    "all are longer": (
        {"width": pl.col("width") + 3, "height": pl.col("width") + 3, "length": pl.col("width") + 3},
        r"column (length|width): vehicle \d has a \w+ of .* m; expected",
    ),
}


@pytest.mark.parametrize("number", WRITERS)
@pytest.mark.parametrize("case", LISTED)
def test_vehicles_that_are_not_as_listed(number: str, case: str, tmp_path: Path):
    tracks = WRITERS[number](tmp_path, REAL)
    changes, problem = LISTED[case]
    listed = tmp_path / f"{number}_tracksMeta.csv"
    known = pl.read_csv(listed).columns
    changed(listed, **{name: change for name, change in changes.items() if name in known})
    with pytest.raises(RecordingError, match=rf"{number}_tracks\.csv, row \d+, {problem}"):
        read([tracks])


@pytest.mark.parametrize("number", WRITERS)
def test_the_list_of_another_recording(number: str, tmp_path: Path):
    write = WRITERS[number]
    (tmp_path / "other").mkdir()
    other = write(tmp_path / "other", OTHER).with_name(f"{number}_tracksMeta.csv")
    tracks = write(tmp_path, REAL)
    other.replace(tmp_path / other.name)
    with pytest.raises(RecordingError, match=rf"{number}_tracks\.csv, row \d+, column \w+: .*tracksMeta\.csv"):
        read([tracks])


@pytest.mark.parametrize(
    ("number", "file", "column", "got", "expected"),
    [
        ("01", "recordingMeta", "numVehicles", 1047, r"\d+, as in 01"),
        ("01", "recordingMeta", "numTrucks", 1047, r"\d+, as in 01"),
        ("03", "recordingMeta", "numTracks", 871, r"\d+, as in 03"),
        ("03", "recordingMeta", "recordingId", 4, "3, as in the first"),
        ("03", "tracksMeta", "recordingId", 4, "3, as in the first"),
        ("03", "tracks", "recordingId", 4, "3"),
    ],
)
def test_numbers_of_another_recording(number: str, file: str, column: str, got: int, expected: str, tmp_path: Path):
    tracks, value = WRITERS[number](tmp_path, REAL), pl.lit(got)
    changed(tmp_path / f"{number}_{file}.csv", **(third(column, value) if file == "tracks" else {column: value}))
    row = 4 if file == "tracks" else 2
    problem = rf"row {row}, column {column.lower()}: got {got}; expected {expected}"
    with pytest.raises(RecordingError, match=rf"{number}_{file}\.csv, {problem}"):
        read([tracks])


@pytest.mark.parametrize("number", WRITERS)
@pytest.mark.parametrize("file", ["tracks", "tracksMeta", "recordingMeta"])
def test_blank_lines_are_counted_once(number: str, file: str, tmp_path: Path):
    tracks = WRITERS[number](tmp_path, REAL)
    with (tmp_path / f"{number}_{file}.csv").open("a") as stream:
        stream.write("\n \n")
    assert sum(recording.repairs.get("blank lines", 0) for recording in read([tracks])) == 2


CUTS: dict[str, Callable[[pl.DataFrame], pl.DataFrame]] = {
    "in time": lambda table: table.filter(pl.col("frame").is_between(30, 100)),
    "its last rows": lambda table: table.head(len(table) - 40),
    "vehicles": lambda table: table.filter(pl.col(table.columns[1]) % 3 != 1),
    "frames that count from 0": lambda table: table.with_columns(frame=pl.col("frame") - 1),
}


@pytest.mark.parametrize("number", WRITERS)
@pytest.mark.parametrize("cut", CUTS)
def test_tracks_that_were_cut_are_read(number: str, cut: str, tmp_path: Path):
    tracks = WRITERS[number](tmp_path, REAL)
    CUTS[cut](pl.read_csv(tracks)).write_csv(tracks)
    assert len(read([tracks])) == 2
