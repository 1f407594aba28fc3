"""Finds the vehicles that several recordings of one site show, at whatever time, by their numbers and sizes.

Files that were cut from one original at different moments share vehicles that `coverdrive.recordings.tracks.overlap`
cannot find, because nothing that they show is the same. What is left is the number in the file, which may begin anew in
every file, and the size. Readers say what their numbers are worth (`Numbers`). Where a reader does not know, the
numbers of two recordings are taken to be those of one original if most of those that both have belong to vehicles of
the same size, and far more of them than of any two vehicles: where all have one size, sizes tell nothing.
"""

import re
from collections.abc import Sequence
from typing import Literal

import polars as pl

from coverdrive.recordings.tracks.overlap import SHARED
from coverdrive.recordings.tracks.repair import RawTracks

Numbers = Literal["stable", "restart", "unsaid"]
"""What equal numbers in two files of one site mean: one vehicle if its size is the same, nothing, or that sizes have to
say which of the two holds"""

ALIKE = 0.01
"""[m] sizes of one vehicle differ by less"""

MOST = 0.5
"""share of the numbers that two recordings have in common, from which on their vehicles are the same"""

TELLING = 3.0
"""times as often as any two vehicles, at least, those of one number have the same size"""

_SITE = re.compile(r"(?:C-)?([A-Z]{3}_[A-Za-z0-9]+)-[0-9]+_")

_SIZE = ("length", "width")


def site_of(name: str) -> str:
    """Country and town of a benchmark id of CommonRoad; of other names, nothing: they may all be of one site."""
    found = _SITE.match(name)
    return found[1] if found else ""


def same_numbers(
    tracks: Sequence[RawTracks], files: Sequence[int], names: Sequence[str], numbers: Sequence[Numbers]
) -> pl.DataFrame:
    """The vehicles that two recordings of different files show: the columns of `SHARED`, a row for each pair of groups.

    Args:
        tracks: of each recording, whose groups are numbered through all of them.
        files: number of the file that each is from.
        names: of the recordings, whose sites are compared.
        numbers: what those in the file of each mean.
    """
    told = [number for number, worth in enumerate(numbers) if worth != "restart"]
    if len({files[number] for number in told}) < 2:
        return pl.DataFrame(schema=SHARED)
    shown = pl.concat(_vehicles(tracks[each], each, files[each], names[each], numbers[each]) for each in told)
    pairs = shown.join(shown, on=("site", "vehicle"), suffix="_b").filter(pl.col("file") < pl.col("file_b"))
    alike = pl.all_horizontal((pl.col(name) - pl.col(f"{name}_b")).abs() < ALIKE for name in _SIZE)
    pairs = pairs.with_columns(alike=alike, vehicle_b="vehicle")
    both = ["recording", "recording_b"]
    said = (pl.col("worth") == "stable") & (pl.col("worth_b") == "stable")
    chance = _chance(shown, pairs.select(both).unique())
    found = pairs.join(chance, on=both).filter(
        pl.col("alike"),
        said | (pl.col("alike").mean().over(both) >= pl.max_horizontal(MOST, TELLING * pl.col("chance"))),
    )
    return found.select(SHARED.names()).sort(SHARED.names())


def _vehicles(track: RawTracks, recording: int, file: int, name: str, worth: Numbers) -> pl.DataFrame:
    """A row for each vehicle and group of a recording, with its size [m]."""
    table = pl.DataFrame({each: getattr(track, each) for each in ("vehicle", "group", *_SIZE)})
    table = table.with_columns(pl.col(_SIZE).median().over("vehicle"))
    about = {"recording": pl.lit(recording, pl.Int64), "file": pl.lit(file, pl.Int64), "site": pl.lit(site_of(name))}
    return table.unique(["vehicle", "group"]).with_columns(**about, worth=pl.lit(worth))


def _chance(shown: pl.DataFrame, pairs: pl.DataFrame) -> pl.DataFrame:
    """How often any vehicle of one recording of a pair has the size of any of the other one, as ``chance``."""
    sizes = shown.unique(["recording", "vehicle"]).group_by("recording", (pl.col(_SIZE) / ALIKE).round()).len("count")
    sizes = sizes.with_columns(share=pl.col("count") / pl.col("count").sum().over("recording"))
    each = pairs.join(sizes, on="recording").join(
        sizes, left_on=("recording_b", *_SIZE), right_on=("recording", *_SIZE), suffix="_b"
    )
    met = each.group_by("recording", "recording_b").agg(chance=(pl.col("share") * pl.col("share_b")).sum())
    return pairs.join(met, on=["recording", "recording_b"], how="left").with_columns(pl.col("chance").fill_null(0.0))
