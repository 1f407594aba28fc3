"""The boundary of a file: whatever goes wrong while it is read becomes an error that names it."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import polars as pl

from coverdrive.errors import CoverdriveError, DataError, RecordingError


@contextmanager
def naming(file: Path, what: str = "the file") -> Generator[None]:
    """Turn what a parser, the system or a check throws into a `RecordingError` of a file.

    Errors of ours that name a place, or are about settings, stay as they are, and so does a lack of memory.
    """
    try:
        yield
    except DataError as error:
        raise RecordingError(file, str(error)) from error
    except (CoverdriveError, MemoryError):
        raise
    except OSError as error:
        problem = f"{what} cannot be read ({error.strerror or error}); check its permissions"
        raise RecordingError(file, problem) from error
    except (Exception, pl.exceptions.PanicException) as error:
        problem = f"{what} cannot be read ({type(error).__name__}: {str(error)[:500]}); check that it is whole and what"
        raise RecordingError(file, f"{problem} it seems to be, or name its format (--format)") from error
