"""Reads recordings of any known kind; those that show the same vehicles become one group, and the vehicles one.

Vehicles are the same if their motion is (`coverdrive.recordings.tracks.overlap`), or their number and size within a
site (`coverdrive.recordings.tracks.numbering`).
"""

import re
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from uuid import uuid4

import numpy as np
import polars as pl
from jaxtyping import Int

from coverdrive.arguments import of_kind, path_of, paths_of, shown
from coverdrive.errors import NoVehiclesError, RecordingError
from coverdrive.garbage import not_looking_for_garbage
from coverdrive.linked import linked
from coverdrive.progress import part, stage
from coverdrive.recordings.files.boundary import naming
from coverdrive.recordings.files.scenario import PROTOBUF, is_protobuf
from coverdrive.recordings.formats import registry as registry
from coverdrive.recordings.formats.reader import (
    CHOICES,
    SUFFIXES,
    How,
    belongs_to_another,
    check_taken,
    reader_of,
    readers,
    taken_by,
)
from coverdrive.recordings.map_tracks import MapTracks, readings_from_map
from coverdrive.recordings.recording import Recording, vehicle_keys
from coverdrive.recordings.tracks.numbering import Numbers, same_numbers
from coverdrive.recordings.tracks.overlap import shared_vehicles
from coverdrive.recordings.tracks.reading import Reading, tracks_of
from coverdrive.recordings.tracks.resampling import STEP, check_step, resampled
from coverdrive.recordings.tracks.smoothing import SmoothingSettings

BLOCK = 60.0
"""[s] a long recording is cut into groups of this length"""

LONG = 120.0
"""[s] recordings that last longer are cut into groups"""

MOST_NAMED = 3
"""Skipped files that a note names"""

Groups = Int[np.ndarray, "..."]


def read(
    paths: Path | str | Sequence[Path | str],
    location: str | None = None,
    smoothing: SmoothingSettings | None = None,
    format: str | None = None,
    dt: float = STEP,
    map: Path | str | None = None,
) -> tuple[Recording, ...]:
    """Read recordings and number their groups.

    A group holds what must stay on one side of a split: recordings that share vehicles, at the same time or not, and
    1 min of a recording that is longer than 2 min. Groups are numbered from 0, in the order of the files and of
    time; those of the package's own Parquet files stay as they are, unless other files share their vehicles.

    Args:
        paths: one or several files, or folders whose files of a known kind are read in natural order (2 before 10);
            those without vehicles are skipped, and named in the notes of the first recording.
        location: the site to read from NGSIM files that hold several; refused if no file is of NGSIM, with columns.
        smoothing: how positions are smoothed.
        format: name of the files' format, one of `coverdrive.readers`; without it, each file shows its own.
        dt: time step [s] of the recordings; those of another one are resampled.
        map: Lanelet2 map of the road, for exiD, inD, rounD, uniD and INTERACTION; refused if no file is of these.

    Raises:
        SettingError: an argument is of a wrong kind, or the time step is none of traffic.
        RecordingError: there is no file, or one cannot be read as what it claims to be; the message names the place.
    """
    smoothing = SmoothingSettings() if smoothing is None else smoothing
    of_kind("smoothing", smoothing, SmoothingSettings, "SmoothingSettings")
    for name, given in (("location", location), ("format", format)):
        of_kind(name, given, str | None, "a name")
    how = How(location, smoothing, None if map is None else path_of("map", map))
    check_step(dt)
    readings: list[Reading] = []
    origin: list[int] = []
    skipped = dict[Path, NoVehiclesError]()
    named = paths_of("paths", paths)
    files = [file for path in named for file in _files(path)]
    if not files:
        raise RecordingError("no file", "there is nothing to read; name at least one file or folder")
    check_taken(files, format, [name for name in CHOICES if getattr(how, name)])
    namesakes = dict[str, list[Path]]()
    for number, file in enumerate(files):
        with part(number, len(files)):
            try:
                found = _read_file(file, how, format, namesakes)
                with naming(file):  # each at once: several need much room at the rate of their files
                    found = [each._replace(recording=resampled(each.recording, dt, how.smoothing)) for each in found]
            except NoVehiclesError as error:
                if file in named:
                    raise
                skipped[file] = error
                continue
        readings += found
        origin += [number] * len(found)
    if skipped:
        if not readings:
            raise next(iter(skipped.values()))
        readings[0].recording.notes["skipped"] = _without_vehicles([file.name for file in skipped])
    return _grouped(readings, origin)


def choices_for(paths: Sequence[Path], format: str | None) -> frozenset[str]:
    """Which of ``location`` and ``map`` the formats of files, and of those in folders, take."""
    return taken_by([file for path in paths for file in _files(path)], format)


def together(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Recordings that several calls have read as if one had: with groups that tell them apart, unless they overlap."""
    calls = list(dict.fromkeys(each.call for each in recordings))
    if len(calls) < 2:
        return tuple(recordings)
    return _grouped(
        [Reading(each, tracks_of(each)) for each in recordings], [calls.index(each.call) for each in recordings]
    )


def _files(path: Path) -> list[Path]:
    """The file itself, or those of a known kind in a folder, in natural order."""
    try:
        if path.is_file():
            return [path]
        if not path.is_dir():
            raise RecordingError(path, "there is no such file or folder; check the path")
        files = [file for file in path.iterdir() if file.suffix.lower() in SUFFIXES and file.is_file()]
        files = [file for file in files if not belongs_to_another(file)]
    except (OSError, ValueError) as error:
        raise RecordingError(path, f"it cannot be looked into ({error}); check the path and its permissions") from error
    if not files:
        why = f"; {PROTOBUF}" if is_protobuf(path) else ""
        raise RecordingError(path, f"the folder holds no recording; expected files {', '.join(SUFFIXES)}{why}")
    pairs = re.compile(r"(\D*)(\d*)")
    return sorted(files, key=lambda file: [(int(part or -1), text) for text, part in pairs.findall(file.name.lower())])


def _without_vehicles(names: list[str]) -> str:
    """What is said of skipped files; many are not all named."""
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return f"{', '.join(names[:MOST_NAMED])}{more}, without vehicles"


@not_looking_for_garbage()
def _read_file(file: Path, how: How, name: str | None, namesakes: dict[str, list[Path]]) -> tuple[Reading, ...]:
    """The recordings of one file, with groups from 0 on; ``namesakes`` gains the file under their names."""
    with naming(file):
        reader = reader_of(file, name)
        found = list(reader.read(file, how))
        finished = [Reading(each, tracks_of(each)) for each in found if isinstance(each, Recording)]
        readings = [each for each in found if isinstance(each, Reading)]
        for each in found:
            if isinstance(each, MapTracks):
                readings += readings_from_map(file, each, how.smoothing, how.map)
            elif not isinstance(each, Recording | Reading):  # pyright: ignore[reportUnnecessaryIsInstance]
                raise RecordingError(file, f"its reader gave {shown(each)}; expected MapTracks or Recordings")
    if not finished and not readings:
        raise RecordingError(file, "it holds no recording; check that it was copied whole")
    names = [reading.recording.name for reading in readings]
    if twice := [name for name in names if names.count(name) > 1]:
        problem = f"its reader called {len(twice)} recordings {twice[0]!r}; expected a name for each"
        raise RecordingError(file, f"{problem}, by which vehicles of equal numbers are told apart")
    for reading in readings:
        reading.recording.notes.setdefault("format", reader.name)
    readings = [_told_apart(reading, file.resolve(), namesakes) for reading in readings]
    return (*finished, *(_cut(tuple(readings)) if readings else ()))


def _told_apart(reading: Reading, file: Path, namesakes: dict[str, list[Path]]) -> Reading:
    """With other keys of its vehicles if another file, in another folder, gave a recording of the same name."""
    files = namesakes.setdefault(reading.recording.name, [])
    if file not in files:
        files.append(file)
    if not (number := files.index(file)):
        return reading
    recording = reading.recording
    keys = vehicle_keys(f"{recording.name} ({number})", recording.table["vehicle"].to_numpy())
    return reading._replace(recording=_with(recording, identity=pl.Series(keys)))


def _cut(readings: tuple[Reading, ...]) -> tuple[Reading, ...]:
    """The recordings of one file, whose times are of one clock, in groups of 1 min if they last long."""
    times = [reading.recording.table["time"].to_numpy() for reading in readings]
    if max(time.max() for time in times) - min(time.min() for time in times) <= LONG:
        return readings
    dt = readings[0].recording.dt
    samples = round(BLOCK / dt)
    block = (pl.col("time") / dt).round().cast(pl.Int64) // samples
    return tuple(
        Reading(_with(reading.recording, group=block), replace(reading.raw, group=reading.raw.moment // samples))
        for reading in readings
    )


def _grouped(readings: list[Reading], origin: list[int]) -> tuple[Recording, ...]:
    """The recordings with groups numbered through all files; those that share vehicles become one, and so do these."""
    raw, tables = _numbered(readings, origin)
    steps = [reading.recording.file_dt for reading in readings]
    tracks = [replace(reading.raw, group=group) for reading, group in zip(readings, raw, strict=True)]
    names = [reading.recording.name for reading in readings]
    worth: list[Numbers] = [numbers_of(reading.recording) for reading in readings]
    with stage("shared vehicles") if len(set(origin)) > 1 else nullcontext():
        shared = pl.concat([shared_vehicles(tracks, origin, steps), same_numbers(tracks, origin, names, worth)])
    count = max(int(numbers.max()) for numbers in (*raw, *tables)) + 1
    component = linked(shared["group"].to_numpy(), shared["group_b"].to_numpy(), count)
    used = np.unique(np.concatenate([component[numbers] for numbers in tables]))
    groups = (pl.Series(np.searchsorted(used, component[numbers]), dtype=pl.Int64) for numbers in tables)
    one, call = _one_of(readings, shared), uuid4().hex
    return tuple(
        _with(reading.recording, call, group=group, identity=pl.col("identity").replace(one))
        for reading, group in zip(readings, groups, strict=True)
    )


def numbers_of(recording: Recording) -> Numbers:
    """What equal vehicle numbers in it and in another recording of its site mean."""
    reader = readers().get(recording.notes.get("format", ""))
    return reader.numbers if reader else "restart"


def _one_of(readings: list[Reading], shared: pl.DataFrame) -> dict[int, int]:
    """For every key of a vehicle that another recording shows, too: the smallest of its keys."""
    own = [reading.recording.table.select("vehicle", "identity").unique() for reading in readings]
    keys = pl.concat(table.with_columns(recording=pl.lit(number, pl.Int64)) for number, table in enumerate(own))
    pairs = shared.join(keys, on=("recording", "vehicle")).join(
        keys, left_on=("recording_b", "vehicle_b"), right_on=("recording", "vehicle"), suffix="_b"
    )
    names, node = np.unique(pairs.select("identity", "identity_b").to_numpy(), return_inverse=True)
    first, second = node.reshape(-1, 2).T
    component = linked(first, second, len(names))
    _, first = np.unique(component, return_index=True)
    return dict(zip(names.tolist(), names[first[component]].tolist(), strict=True))


def _with(recording: Recording, call: str = "", **columns: pl.Series | pl.Expr) -> Recording:
    return replace(recording, table=recording.table.with_columns(**columns), call=call)


def _numbered(readings: list[Reading], origin: list[int]) -> tuple[list[Groups], list[Groups]]:
    """The groups of the rows of all raw tracks and of all tables, numbered through all files."""
    raw = [reading.raw.group for reading in readings]
    tables = [reading.recording.table["group"].to_numpy() for reading in readings]
    base = 0
    for file in dict.fromkeys(origin):
        own = [index for index, number in enumerate(origin) if number == file]
        groups = np.unique(np.concatenate([part[index] for part in (raw, tables) for index in own]))
        for index in own:
            raw[index] = base + np.searchsorted(groups, raw[index])
            tables[index] = base + np.searchsorted(groups, tables[index])
        base += len(groups)
    return raw, tables
