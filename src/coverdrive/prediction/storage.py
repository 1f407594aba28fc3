"""Arrays and what belongs to them in one safetensors file: arrays by name, everything else as JSON in its header.

Nothing in such a file can be executed.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from coverdrive.errors import DataError
from coverdrive.files import write_atomically


def save_arrays(path: Path, kind: str, header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays to a file; an interrupted write leaves no file behind.

    Args:
        path: of the file.
        kind: what the file holds, as in "predictor".
        header: anything that JSON can hold, by name.
        arrays: by name.
    """
    metadata = {"format": _format(kind)} | {name: json.dumps(value) for name, value in header.items()}
    contiguous = {name: np.ascontiguousarray(values) for name, values in arrays.items()}
    write_atomically(path, lambda file: file.write_bytes(save(contiguous, metadata=metadata)))


def load_arrays(path: Path, kind: str, command: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Read the header and the arrays of a file that `save_arrays` wrote.

    Args:
        path: of the file.
        kind: what the file has to hold.
        command: with which a user makes such a file.

    Raises:
        DataError: the file is missing, is no safetensors file, or holds something else.
    """
    try:
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (not a mapping)
    except (OSError, SafetensorError) as error:
        raise DataError(f"{path}: not a {kind} file ({error}); make one with `{command}`") from error
    found = metadata.pop("format", None)
    if found != _format(kind):
        raise DataError(f"{path}: expected the format {_format(kind)!r}, got {found!r}; make one with `{command}`")
    return {name: json.loads(value) for name, value in metadata.items()}, arrays


def _format(kind: str) -> str:
    return f"coverdrive {kind} 1"
