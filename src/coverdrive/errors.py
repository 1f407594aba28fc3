"""The errors a user can cause: each message says what was got, what was expected and what to try.

What code that a user brought raises, such as a planner, stays the exception that it is; notes on it say whose code that
is, and in which trial and step.
"""

from collections.abc import Generator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any


class CoverdriveError(Exception):
    """Anything a user can put right; the command prints it without a traceback and exits with status 2."""


class RecordingError(CoverdriveError):
    """A recording that cannot be read as what it claims to be."""

    def __init__(self, file: Path | str, problem: str, row: int | None = None, column: str | None = None):
        """Name the place: ``row`` counts the lines of the file from 1, a header line included."""
        place = str(file).encode("utf-8", "replace").decode()  # names of files may be any bytes
        if row is not None:
            place += f", row {row}"
        if column is not None:
            place += f", column {column}"
        super().__init__(f"{place}: {problem}")


class NoVehiclesError(RecordingError):
    """A whole file without recorded tracks of vehicles; in a folder it is skipped."""


class SettingError(CoverdriveError):
    """A setting, or a combination of settings, that makes no sense."""


class DataError(CoverdriveError):
    """Data that are well formed, but from which the result asked for cannot be made."""


class StartError(CoverdriveError):
    """A drive that cannot begin, because the vehicles find no place."""


class CertificateError(CoverdriveError):
    """A guarantee that would not hold, and is therefore refused."""


class MissingExtraError(CoverdriveError):
    """A package that only this needs is not installed, or does not load."""


class _Note(str):
    """A note on an exception of code that is not of this package."""


@contextmanager
def blaming(role: str, part: Any) -> Generator[None]:
    """Say of what the block raises that it came from a part, such as a planner, unless that is of this package.

    Args:
        role: what the part is, in words.
        part: an object, a class, a function or its name.
    """
    try:
        yield
    except CoverdriveError:
        raise
    except Exception as error:
        name = part if isinstance(part, str) else name_of(part)
        if name.partition(".")[0] != "coverdrive" and not blamed(error):
            error.add_note(_Note(f"this came from the {role} {name}, which is not of coverdrive"))
        raise


@contextmanager
def during(place: str) -> Generator[None]:
    """Say of what such a part raises where in the work that was."""
    try:
        yield
    except Exception as error:
        if blamed(error):
            error.add_note(_Note(place))
        raise


def blamed(error: BaseException) -> str:
    """Whose code raised an exception, and where; empty if it is of this package."""
    return ", ".join(note for note in getattr(error, "__notes__", ()) if isinstance(note, _Note))


def name_of(part: Any) -> str:
    """Of a class or function, or of that of which something is."""
    made = maker_of(part)
    return f"{made.__module__}.{made.__qualname__}"


def maker_of(part: Any) -> Any:
    """A class or function itself, of anything else its class; of a call that is kept for later, what it calls."""
    while isinstance(part, partial):
        part = part.func
    return part if hasattr(part, "__qualname__") else type(part)
