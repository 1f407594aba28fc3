"""Writing files so that a killed process never leaves a broken one."""

import json
import os
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import numpy as np


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Write a file under a temporary name in the same folder, then rename it.

    Args:
        path: the final name; its folder is made if need be.
        write: called with the temporary name, which has the same suffix.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        write(temporary)
        temporary.replace(path)
    except OSError as error:
        if error.errno:  # a full disk names no file, and nobody knows the temporary name
            error.filename, error.filename2 = str(path), None
        raise
    finally:
        temporary.unlink(missing_ok=True)


def write_stream(path: Path, write: Callable[[IO[bytes]], object]) -> None:
    """Write a file atomically by what takes an open one.

    That is one in memory: polars knows only names in UTF-8, and does not say as the system does why it cannot write.
    """
    content = BytesIO()
    write(content)
    write_atomically(path, lambda file: file.write_bytes(content.getbuffer()))


def write_text(path: Path, text: str) -> None:
    """Write text as UTF-8 atomically; of names in it, bytes that are no UTF-8 become question marks."""
    write_atomically(path, lambda file: file.write_text(text, encoding="utf-8", errors="replace"))


def write_json(path: Path, content: Any) -> None:
    """Write JSON atomically."""
    write_text(path, json.dumps(content, indent=2, sort_keys=True) + "\n")


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays by name as a compressed ``.npz``, atomically."""
    write_stream(path, lambda file: np.savez_compressed(file, allow_pickle=False, **arrays))


def number_in_name(value: float) -> str:
    """A number as it stands in the name of a file: no two numbers look alike, and whole ones have no decimals."""
    return repr(float(value)).removesuffix(".0")
