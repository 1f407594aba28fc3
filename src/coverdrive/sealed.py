"""A folder whose files are sealed: one that is damaged, foreign, edited or older is refused by its name.

``manifest.json`` holds the format of the folder, and the digest of every file that was sealed. Several files are
replaced together: the new ones are written as ``next-…``, sealed, then renamed; if the process is killed before that,
the next reader renames them.
"""

import hashlib
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import polars as pl
from pydantic import TypeAdapter

from coverdrive._version import __version__
from coverdrive.errors import DataError
from coverdrive.files import write_json

MANIFEST = "manifest.json"

_FORMAT, _NEXT, _FIT = 6, "next-", "coverdrive fit"
_OBJECT, _FILES = TypeAdapter(dict[str, Any]), TypeAdapter(dict[str, str])

T = TypeVar("T")


class SealedFolder:
    """The files of a folder that are as they were written."""

    def __init__(self, folder: Path):
        """Name the folder, which may not be there yet."""
        self.folder = folder

    @property
    def exists(self) -> bool:
        """Whether anything is sealed in it."""
        return (self.folder / MANIFEST).exists()

    def __contains__(self, name: str) -> bool:
        return name in self._digests

    def unseal(self) -> None:
        """Let nothing be sealed in it any more."""
        (self.folder / MANIFEST).unlink(missing_ok=True)
        for file in self.folder.glob(f"{_NEXT}*"):
            file.unlink()

    def seal(self, *names: str) -> None:
        """Seal files as they are now."""
        known = self._digests if self.exists else {}
        self._write(known | {name: _digest(self.folder / name) for name in names})

    def replace(self, write: Mapping[str, Callable[[Path], object]], void: Collection[str] = ()) -> None:
        """Write files anew and seal them, all or none if the process is killed; leave out those that are void."""
        for name, each in write.items():
            each(self._next(name))
        known = {name: each for name, each in self._digests.items() if name not in void}
        self._write(known | {name: _digest(self._next(name)) for name in write})
        for name in write:
            with suppress(FileNotFoundError):  # a reader was quicker
                self._next(name).replace(self.folder / name)

    def _next(self, name: str) -> Path:
        """What is to become a file."""
        return self.folder / f"{_NEXT}{name}"

    def _write(self, files: Mapping[str, str]) -> None:
        write_json(self.folder / MANIFEST, {"format": _FORMAT, "coverdrive": __version__, "files": files})

    def file(self, name: str, command: str = _FIT) -> Path:
        """A file that is as it was sealed, renamed if it has still to be, or a `DataError`; a command makes it."""
        file, written, new = self.folder / name, self._digests.get(name), self._next(name)
        try:
            if new.exists() and _digest(new) == written:  # killed before it was renamed
                new.replace(file)
        except FileNotFoundError:  # somebody else was quicker
            pass
        except OSError:  # a folder that can only be read
            return new
        try:
            found = _digest(file)
        except OSError as error:
            raise DataError(f"{file} cannot be read ({error.strerror}); make it with `{command}`") from error
        if found != written:
            raise DataError(
                f"{file} is not as it was written: it was damaged, edited, or belongs to another fit; "
                f"put the right one back, or make {'all' if command == _FIT else 'it'} anew with `{command}`"
            )
        return file

    def read(self, name: str, parse: Callable[[bytes], T], command: str = _FIT) -> T:
        """The content of a file that is as it was sealed, or a `DataError`; a command makes it."""
        return read_made(self.file(name, command), parse, command)

    @property
    def _digests(self) -> dict[str, str]:
        """Digest of every file by name."""
        file = self.folder / MANIFEST
        if not file.exists():
            raise DataError(
                f"there are no results in {self.folder}; make some with `coverdrive run --out {self.folder}`"
            )
        found = read_made(file, _OBJECT.validate_json)
        if found.get("format") != _FORMAT:
            raise DataError(f"{file}: expected results of format {_FORMAT}, got {found.get('format')!r}; fit again")
        return read_made(file, lambda _: _FILES.validate_python(found.get("files")))


def read_made(file: Path, parse: Callable[[bytes], T], command: str = _FIT) -> T:
    """The content of a file that a command makes, as what it was written from, or a `DataError`."""
    try:
        return parse(file.read_bytes())
    except (OSError, ValueError, LookupError, TypeError, AttributeError, pl.exceptions.PolarsError) as error:
        first = str(error).partition("\n")[0]
        raise DataError(f"{file}: not a readable result ({first}); make it with `{command}`") from error


def _digest(file: Path) -> str:
    with file.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()
