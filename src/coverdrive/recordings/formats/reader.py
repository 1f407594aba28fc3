"""The readers of recordings by name, and which of them a file is for.

A reader is a function from a file to `Recording` objects, or to `MapTracks` that are made into recordings. It is told
by what a file shows before it is read (`Head`), or asked for by name:

    register_reader("mine", read_mine, lambda head: {"car", "ms"} <= head.columns)

A package that is installed may offer readers as entry points of the group ``coverdrive.readers``, so that the command
knows them, too; each is a function without arguments that calls `register_reader`.
"""

import re
import sys
from collections.abc import Callable, Collection, Iterable, Sequence
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import NamedTuple

from coverdrive.errors import RecordingError
from coverdrive.recordings.files.boundary import naming
from coverdrive.recordings.files.columns import columns_of
from coverdrive.recordings.files.delimited import normalised
from coverdrive.recordings.files.scenario import PROTOBUF, is_protobuf
from coverdrive.recordings.formats.parquet import is_own
from coverdrive.recordings.map_tracks import MapTracks
from coverdrive.recordings.recording import Recording
from coverdrive.recordings.tracks.numbering import Numbers
from coverdrive.recordings.tracks.reading import Reading
from coverdrive.recordings.tracks.smoothing import SmoothingSettings

SUFFIXES = (".csv", ".txt", ".xml", ".parquet", ".json")
"""Kinds of files that a folder is searched for"""

FIRST = 2**23
"""Bytes of a JSON file in which its keys are looked for: lists of numbers between them are long"""

ENTRY_POINTS = "coverdrive.readers"

CHOICES = {"location": "it holds one site", "map": "where its tracks are on a map is not known"}
"""What only some formats take, and why others do not"""


class Head(NamedTuple):
    """What a file shows before it is read."""

    suffix: str
    """of the file's name, in lower case"""
    columns: frozenset[str]
    """names of the columns, or in JSON of the first keys, in lower case with ``_`` for ``-``; none of XML, or of text
    without commas"""
    own: bool
    """whether `write_parquet` wrote it"""


class How(NamedTuple):
    """How files are read."""

    location: str | None = None
    """site to read from NGSIM files that hold several"""
    smoothing: SmoothingSettings = SmoothingSettings()
    """how positions are smoothed"""
    map: Path | None = None
    """Lanelet2 map of the road, for tracks that know their place on it"""


AS_USUAL = How()


class Reader(NamedTuple):
    """A format, in the terms of `register_reader`."""

    name: str
    read: Callable[[Path, How], Iterable[Reading | Recording | MapTracks]]
    recognise: Callable[[Head], bool]
    accompanies: Callable[[Head], bool]
    numbers: Numbers
    takes: Collection[str]


_readers: dict[str, Reader] = {}


def _never(_: Head) -> bool:
    return False


def register_reader(
    name: str,
    read: Callable[[Path, How], Iterable[Reading | Recording | MapTracks]],
    recognise: Callable[[Head], bool] = _never,
    accompanies: Callable[[Head], bool] = _never,
    numbers: Numbers = "unsaid",
    takes: Collection[str] = tuple(CHOICES),
) -> None:
    """Add a format, or replace the one of this name; the last one added is asked first whether a file is its own.

    Args:
        name: by which it can be asked for, as in ``--format name``.
        read: takes a file and how it is to be read, and returns its recordings or tracks.
        recognise: whether a file is of this format; without it, it has to be asked for.
        accompanies: whether a file belongs to one of this format, such as a description; in a folder it is passed over.
        numbers: what equal vehicle numbers in two files of one site mean: one vehicle ("stable"), nothing ("restart"),
            or whatever sizes say.
        takes: which of ``location`` and ``map`` it uses.
    """
    _readers.pop(name, None)
    _readers[name] = Reader(name, read, recognise, accompanies, numbers, takes)


def having(*columns: str) -> Callable[[Head], bool]:
    """Recognises files that have all columns of one of some lists, whose names are separated by blanks."""
    return lambda head: any(head.columns.issuperset(names.split()) for names in columns)


def readers() -> dict[str, Reader]:
    """All formats by name, in the order in which they are asked whether a file is of theirs."""
    for point in _advertised(tuple(sys.path)):
        if point.name not in _readers:
            point.load()()
    return dict(reversed(_readers.items()))


@cache
def _advertised(_: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """What the packages installed in some folders advertise; looking all of them up takes 10 ms and more."""
    return tuple(entry_points(group=ENTRY_POINTS))


def head_of(file: Path) -> Head:
    """What a file shows: its suffix, and the names of its columns or keys."""
    suffix = file.suffix.lower()
    if suffix == ".json":
        with file.open("rb") as stream:
            keys = re.findall(r'"([^"]*)"\s*:', stream.read(FIRST).decode("utf-8", errors="replace"))
        return Head(suffix, frozenset(map(normalised, keys)), own=False)
    if suffix == ".parquet":
        with file.open("rb") as stream:
            own = is_own(stream)
        return Head(suffix, frozenset(columns_of(file)), own)
    return Head(suffix, frozenset(columns_of(file)) if suffix in (".csv", ".txt") else frozenset(), own=False)


def belongs_to_another(file: Path) -> bool:
    """Whether a file of a folder is read with another one, or is JSON of something else."""
    suffix = file.suffix.lower()
    if suffix == ".xml":
        return False
    try:
        with naming(file):
            head = head_of(file)
    except RecordingError:  # what is wrong is said when it is read
        return False
    known = readers().values()
    beside = any(reader.accompanies(head) for reader in known)
    return beside or (suffix == ".json" and not any(reader.recognise(head) for reader in known))


def _check_named(file: Path, chosen: Reader, known: Iterable[Reader]) -> None:
    """Refuse the reader of a name for a file that shows another format, unless it recognises none itself."""
    if chosen.recognise is _never:
        return
    head = head_of(file)
    shown = None if chosen.recognise(head) else next((each for each in known if each.recognise(head)), None)
    if shown is not None:
        problem = f"it is of the format {shown.name}, not {chosen.name}"
        raise RecordingError(file, f"{problem}: leave the name of the format out (--format), or give another file")


def reader_of(file: Path, name: str | None = None) -> Reader:
    """The reader of this name, or the one that recognises the file.

    Raises:
        RecordingError: there is none.
    """
    known = readers()
    if name is not None:
        chosen = {each.lower(): reader for each, reader in known.items()}.get(name.lower())
        if chosen is None:
            raise RecordingError(file, f"there is no format {name!r}; choose one of {', '.join(known)}")
        _check_named(file, chosen, known.values())
        return chosen
    if is_protobuf(file):
        raise RecordingError(file, PROTOBUF)
    if file.suffix.lower() not in SUFFIXES:
        problem = f"unknown kind of file {file.suffix!r}; expected {', '.join(SUFFIXES)}, or the name of its format"
        raise RecordingError(file, problem)
    head = head_of(file)
    for reader in known.values():
        if reader.recognise(head):
            return reader
        if reader.accompanies(head):
            problem = f"it is no recording, but belongs to one of the format {reader.name}"
            raise RecordingError(file, f"{problem}; name the file of the tracks, or the folder of both")
    names = sorted(head.columns)
    named = ", ".join(name if name.isprintable() else repr(name) for name in (each[:30] for each in names[:10]))
    problem = f"unknown columns {named or '(none)'}{', …' * (len(names) > 10)}; if it is of one of the formats"
    raise RecordingError(file, f"{problem} {', '.join(known)}, name that (--format)")


def taken_by(files: Iterable[Path], name: str | None = None) -> frozenset[str]:
    """Which of `CHOICES` the readers of some files take; text without a header names no site.

    Raises:
        RecordingError: there is no reader for one.
    """
    taken = set[str]()
    for file in files:
        with naming(file):
            reader, head = reader_of(file, name), head_of(file)
        taken.update(each for each in reader.takes if each == "map" or head.columns or head.suffix == ".xml")
    return frozenset(taken)


def check_taken(files: Sequence[Path], name: str | None, given: Collection[str]) -> None:
    """Refuse what is given of `CHOICES` if the reader of no file takes it."""
    for each in sorted(set(given) - taken_by(files, name)) if given else ():
        formats = ", ".join(known.name for known in readers().values() if each in known.takes)
        problem = f"{CHOICES[each]}; --{each} is for the formats {formats}"
        raise RecordingError(files[0], f"{problem}, this is {reader_of(files[0], name).name}: leave the {each} out")
