"""The files beside tracks of highD's kind that describe them, which have to be of the same recording.

Tracks may be cut: vehicles that are missing, and frames, are no disagreement.
"""

from collections.abc import Mapping
from pathlib import Path

import polars as pl

from coverdrive.errors import RecordingError
from coverdrive.recordings.checks import wrong_usual_sizes
from coverdrive.recordings.files.delimited import ROW

LISTED = ("initialframe", "finalframe", "numframes", "width")
"""What a description says of every vehicle, besides its number and its class"""

SLACK, SAME_SIZE = 1, 0.25
"""Frames, which count from 0 or from 1, and [m] by which tracks may differ from what is said of them"""

_TRY = "check that both are of one recording, whose files begin with the same number"


def companion(file: Path, what: str) -> Path:
    """The file beside a file of tracks that describes its vehicles (``tracksMeta``) or itself (``recordingMeta``)."""
    stem, found, _ = file.name.rpartition("tracks")
    path = file.with_name(f"{stem}{what}{file.suffix}")
    if not found or not path.is_file():
        problem = f"its description {path.name if found else f'NN_{what}.csv'} is not beside it"
        raise RecordingError(file, f"{problem}; expected NN_tracks.csv, NN_tracksMeta.csv and NN_recordingMeta.csv")
    return path


def frame_rate(description: Path, about: pl.DataFrame) -> float:
    """Frames per second, as the description of a recording states them in its column ``framerate``."""
    rate = float(about["framerate"][0])
    if not rate > 0:
        raise RecordingError(description, f"expected frames per second, got {rate:g}", about[ROW][0], "frameRate")
    return rate


def described(file: Path, rows: pl.DataFrame, description: Path, listed: pl.DataFrame, name: str) -> pl.DataFrame:
    """Rows with what a description lists of each ``vehicle``, whose column there has a name.

    Refused are vehicles of which it says nothing, or two different things.
    """
    twice = listed.unique(pl.exclude(ROW), maintain_order=True).filter(pl.col("vehicle").is_duplicated())
    if len(twice):
        problem = f"vehicle {twice['vehicle'][0]:g} is described twice, differently; remove what is wrong"
        raise RecordingError(description, problem, twice.filter(vehicle=twice["vehicle"][0])[ROW][-1], name)
    known = listed.drop(ROW).unique("vehicle").with_columns(listed=True)
    table = rows.join(known, on="vehicle", how="left", maintain_order="left")
    for row in table["listed"].is_null().arg_true():
        problem = f"vehicle {table['vehicle'][row]:g} is not in {description.name}"
        raise RecordingError(file, f"{problem}; check that both are of one recording", table[ROW][row], name)
    return table.drop("listed")


def check_described(
    file: Path, rows: pl.DataFrame, description: Path, listed: pl.DataFrame, name: str, sizes: tuple[str, str]
) -> None:
    """Refuse vehicles that are seen in other frames, or in more, or in other sizes than a description lists.

    Args:
        file: of the tracks.
        rows: its columns, ``frame`` among them.
        description: of its vehicles.
        listed: the columns of that, of `LISTED` those that it has.
        name: the column of a vehicle's number in both.
        sizes: those of its length and its width [m].
    """
    frame = pl.col("frame")
    seen = {"first": frame.min(), "last": frame.max(), "seen": frame.n_unique()}
    own = rows.group_by(name, maintain_order=True).agg(pl.col(ROW).first(), pl.col(sizes).median(), **seen)
    both = own.join(listed, on=name, suffix="_listed", maintain_order="left")
    wrong: list[tuple[str, pl.Expr, str, str]] = []
    if {"initialframe", "finalframe"} <= set(listed.columns):  # frames that leave some out are told by the speeds
        early, late = pl.col("first") < pl.col("initialframe") - SLACK, pl.col("last") > pl.col("finalframe") + SLACK
        gapless = pl.col("last") - pl.col("first") + 1 == pl.col("seen")
        wrong.append(
            ("frame", gapless & (early | late), "frames {first:g} to {last:g}", "{initialframe:g} to {finalframe:g}")
        )
    if "numframes" in listed.columns:
        wrong.append(("frame", pl.col("seen") > pl.col("numframes") + SLACK, "{seen} frames", "up to {numframes:g}"))
    if not any(wrong_usual_sizes(*(rows[size].to_numpy() for size in sizes))):  # of another unit, or swapped
        for size in (each for each in sizes if each in listed.columns):
            away = (pl.col(size) - pl.col(f"{size}_listed")).abs() > SAME_SIZE
            wrong.append((size, away, f"a {size} of {{{size}:g}} m", f"{{{size}_listed:g}} m"))
    for column, where, got, expected in wrong:
        for found in both.filter(where).iter_rows(named=True):
            problem = f"vehicle {found[name]:g} has {got.format(**found)}; expected {expected.format(**found)}, as"
            raise RecordingError(file, f"{problem} {description.name} says: {_TRY}", found[ROW], column)


def check_recording(description: Path, about: pl.DataFrame, expected: Mapping[str, float], where: str) -> None:
    """Refuse what a description says of its recording if other files of that, named in words, say another number."""
    for column, number in expected.items():
        for row in (about[column] != number).arg_true() if column in about.columns else ():
            problem = f"got {about[column][row]:g}; expected {number:g}, as in {where}: {_TRY}"
            raise RecordingError(description, problem, about[ROW][row], column)
