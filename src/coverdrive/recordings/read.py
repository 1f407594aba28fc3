"""Reads recordings of any known kind; those that show the same vehicles become one group, and the vehicles one."""

import re
from collections.abc import Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import polars as pl
from jaxtyping import Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from coverdrive.errors import RecordingError
from coverdrive.progress import part
from coverdrive.recordings.commonroad import read_commonroad
from coverdrive.recordings.foreign import refuse_foreign
from coverdrive.recordings.ngsim import is_metric, read_metric, read_ngsim
from coverdrive.recordings.overlap import shared_vehicles
from coverdrive.recordings.parquet import read_heads, read_parquet
from coverdrive.recordings.recording import Recording
from coverdrive.recordings.smoothing import SmoothingSettings
from coverdrive.recordings.tracks import Reading

SUFFIXES = (".csv", ".txt", ".xml", ".parquet")
"""Kinds of files that a folder is searched for"""

BLOCK = 60.0
"""[s] a long recording is cut into groups of this length"""

LONG = 120.0
"""[s] recordings that last longer are cut into groups"""

Groups = Int[np.ndarray, "..."]

_IDENTITY = pl.col("identity")


def read(
    paths: Path | str | Sequence[Path | str], location: str | None = None, smoothing: SmoothingSettings | None = None
) -> tuple[Recording, ...]:
    """Read recordings and number their groups.

    A group holds what must stay on one side of a split: recordings that share vehicles at the same time, and
    1 min of a recording that is longer than 2 min. Groups are numbered from 0, in the order of the files and of
    time; those of the package's own Parquet files stay as they are, unless other files share their vehicles.

    Args:
        paths: one or several files, or folders whose files of a known kind are read in natural order (2 before 10).
        location: the site to read from NGSIM files that hold several.
        smoothing: how positions are smoothed.

    """
    settings = smoothing or SmoothingSettings()
    readings: list[Reading] = []
    origin: list[int] = []
    named = [paths] if isinstance(paths, (Path, str)) else paths
    files = [file for path in named for file in _files(Path(path))]
    if not files:
        raise RecordingError("no file", "there is nothing to read; name at least one file or folder")
    for number, file in enumerate(files):
        with part(number, len(files)):
            found = _read_file(file, location, settings)
        readings += found
        origin += [number] * len(found)
    return _grouped(readings, origin)


def _files(path: Path) -> list[Path]:
    """The file itself, or those of a known kind in a folder, in natural order."""
    try:
        if path.is_file():
            return [path]
        if not path.is_dir():
            raise RecordingError(path, "there is no such file or folder; check the path")
        files = [file for file in path.iterdir() if file.suffix.lower() in SUFFIXES and file.is_file()]
    except (OSError, ValueError) as error:
        raise RecordingError(path, f"it cannot be looked into ({error}); check the path and its permissions") from error
    if not files:
        raise RecordingError(path, f"the folder holds no recording; expected files {', '.join(SUFFIXES)}")
    pairs = re.compile(r"(\D*)(\d*)")
    return sorted(files, key=lambda file: [(int(part or -1), text) for text, part in pairs.findall(file.name.lower())])


def _read_file(file: Path, location: str | None, settings: SmoothingSettings) -> tuple[Reading, ...]:
    """The recordings of one file, with groups from 0 on."""
    try:
        suffix = file.suffix.lower()
        if suffix == ".xml":
            return _cut((read_commonroad(file, settings),))
        if suffix in (".csv", ".txt"):
            return _cut(read_ngsim(file, location, settings))
        if suffix == ".parquet":
            return _read_parquet(file, settings)
        if suffix == ".json":
            with file.open("rb") as stream:
                refuse_foreign(file, stream.read(100_000).decode("utf-8", errors="replace").split('"'))
    except OSError as error:
        problem = f"the file cannot be read ({error.strerror or error}); check its permissions"
        raise RecordingError(file, problem) from error
    raise RecordingError(file, f"unknown kind of file {suffix!r}; expected {', '.join(SUFFIXES)}")


def _read_parquet(file: Path, settings: SmoothingSettings) -> tuple[Reading, ...]:
    """The recordings of a Parquet file, of the package's own or of metric tracks."""
    content = file.read_bytes()  # polars would take brackets and stars in a path for a pattern
    try:
        heads, table = read_heads(file, content), pl.read_parquet(BytesIO(content))
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException) as error:
        problem = f"not a Parquet file, or damaged ({error}); check that it was copied whole"
        raise RecordingError(file, problem) from error
    if heads is not None:
        return read_parquet(file, table, heads)
    if is_metric(table.columns):
        return _cut(read_metric(file, table, settings))
    refuse_foreign(file, table.columns)
    problem = f"unknown columns {', '.join(table.columns)}; expected NGSIM tracks in metres or own recordings"
    raise RecordingError(file, problem)


def _cut(readings: tuple[Reading, ...]) -> tuple[Reading, ...]:
    """The recordings of one file, whose times are of one clock, in groups of 1 min if they last long."""
    times = [reading.recording.table["time"].to_numpy() for reading in readings]
    if max(time.max() for time in times) - min(time.min() for time in times) <= LONG:
        return readings
    dt = readings[0].recording.dt
    samples = round(BLOCK / dt)
    block = (pl.col("time") / dt).round().cast(pl.Int64) // samples
    return tuple(
        Reading(_regrouped(reading.recording, block), replace(reading.raw, group=reading.raw.moment // samples))
        for reading in readings
    )


def _grouped(readings: list[Reading], origin: list[int]) -> tuple[Recording, ...]:
    """The recordings with groups numbered through all files; those that share vehicles become one, and so do these."""
    raw, tables = _numbered(readings, origin)
    shared = shared_vehicles([reading.raw for reading in readings], raw, origin)
    count = max(int(numbers.max()) for numbers in (*raw, *tables)) + 1
    component = _linked(shared["group"].to_numpy(), shared["group_b"].to_numpy(), count)
    used = np.unique(np.concatenate([component[numbers] for numbers in tables]))
    groups = (pl.Series(np.searchsorted(used, component[numbers]), dtype=pl.Int64) for numbers in tables)
    one = _one_of(readings, shared)
    return tuple(
        _regrouped(reading.recording, group, pl.col("identity").replace(one))
        for reading, group in zip(readings, groups, strict=True)
    )


def _one_of(readings: list[Reading], shared: pl.DataFrame) -> dict[int, int]:
    """For every key of a vehicle that another recording shows, too: the smallest of its keys."""
    own = [reading.recording.table.select("vehicle", "identity").unique() for reading in readings]
    keys = pl.concat(table.with_columns(recording=pl.lit(number, pl.Int64)) for number, table in enumerate(own))
    pairs = shared.join(keys, on=("recording", "vehicle")).join(
        keys, left_on=("recording_b", "vehicle_b"), right_on=("recording", "vehicle"), suffix="_b"
    )
    names, node = np.unique(pairs.select("identity", "identity_b").to_numpy(), return_inverse=True)
    first, second = node.reshape(-1, 2).T
    component = _linked(first, second, len(names))
    _, first = np.unique(component, return_index=True)
    return dict(zip(names.tolist(), names[first[component]].tolist(), strict=True))


def _linked(first: Groups, second: Groups, count: int) -> Groups:
    """Number of the connected component of each of ``count`` nodes, of which pairs are linked."""
    links = coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    return connected_components(links, directed=False)[1]


def _regrouped(recording: Recording, group: pl.Series | pl.Expr, identity: pl.Expr = _IDENTITY) -> Recording:
    return replace(recording, table=recording.table.with_columns(group=group, identity=identity))


def _numbered(readings: list[Reading], origin: list[int]) -> tuple[list[Groups], list[Groups]]:
    """The groups of the rows of all raw tracks and of all tables, numbered through all files."""
    raw = [reading.raw.group for reading in readings]
    tables = [reading.recording.table["group"].to_numpy() for reading in readings]
    base = 0
    for file in range(max(origin) + 1):
        own = [index for index, number in enumerate(origin) if number == file]
        groups = np.unique(np.concatenate([part[index] for part in (raw, tables) for index in own]))
        for index in own:
            raw[index] = base + np.searchsorted(groups, raw[index])
            tables[index] = base + np.searchsorted(groups, tables[index])
        base += len(groups)
    return raw, tables
