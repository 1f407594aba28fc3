"""The errors a user can cause: each message says what was got, what was expected and what to try."""

from pathlib import Path


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
