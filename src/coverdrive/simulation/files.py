"""Files that are either complete or absent: written under another name, then renamed."""

import os
from collections.abc import Callable
from pathlib import Path

_UNFINISHED = ".unfinished"


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Let ``write`` write a temporary file beside ``path``, then rename it; folders are made as needed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f"{path.name}.{os.getpid()}{_UNFINISHED}")
    try:
        write(temporary)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def remove_unfinished(folder: Path) -> None:
    """Remove what a killed process left behind in ``folder``; no other process may be writing there."""
    for temporary in folder.glob(f"*{_UNFINISHED}"):
        temporary.unlink(missing_ok=True)
