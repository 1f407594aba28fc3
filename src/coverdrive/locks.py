"""Folders in which one process works at a time: the system frees them when it ends, however it does."""

import os
from collections.abc import Generator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path

from coverdrive.errors import DataError


@contextmanager
def alone(folder: Path | str | None, wait: bool = False) -> Generator[None]:
    """Hold a folder, made as needed, until the block ends, as far as folders can be locked.

    Whoever else holds it is waited for, or else refused with a DataError. None is no folder to hold.
    """
    held = None
    try:
        with suppress(ImportError, OSError):
            if folder is not None:
                fcntl = import_module("fcntl")
                Path(folder).mkdir(parents=True, exist_ok=True)
                held = os.open(folder, os.O_RDONLY)
                try:
                    fcntl.flock(held, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
                except BlockingIOError as error:
                    raise DataError(
                        f"another process writes to {folder}; wait until it has ended, stop it, or use another folder"
                    ) from error
        yield
    finally:
        if held is not None:
            os.close(held)
