"""Arrays and what belongs to them in one safetensors file: arrays by name, everything else as JSON in its header.

Nothing in such a file can be executed. Equal contents give equal bytes, and a file holds the fingerprint of its
contents, so that none of it can be changed unnoticed.
"""

import json
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from coverdrive.certificates.certificate import fingerprint
from coverdrive.errors import CoverdriveError, DataError
from coverdrive.files import write_atomically

_VERSION = 4


def fingerprint_of(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> str:
    """A short hash of everything that a file of this content says."""
    names = json.dumps([dict(header), sorted(arrays)], sort_keys=True)
    return fingerprint(np.frombuffer(names.encode(), np.uint8), *(arrays[name] for name in sorted(arrays)))


def save_arrays(path: Path, kind: str, header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays, and a header of JSON values, by name to a file; an interrupted write leaves no file behind.

    ``kind`` is what the file holds, as in "predictor".
    """
    metadata = {"format": _format(kind), "fingerprint": fingerprint_of(header, arrays)}
    metadata |= {name: json.dumps(value, sort_keys=True) for name, value in header.items()}
    content = _bytes_of(metadata, {name: np.ascontiguousarray(values) for name, values in arrays.items()})
    write_atomically(path, lambda file: file.write_bytes(content))


def _bytes_of(metadata: Mapping[str, str], arrays: Mapping[str, np.ndarray]) -> bytes:
    """A safetensors file as its library writes it, which leaves to chance only in which order metadata stand."""
    written = save(dict(arrays))
    size = 8 + int.from_bytes(written[:8], "little")
    described = {"__metadata__": dict(sorted(metadata.items())), **json.loads(written[8:size])}
    head = json.dumps(described, ensure_ascii=False, separators=(",", ":")).encode()
    head += b" " * (-len(head) % 8)
    return b"".join([len(head).to_bytes(8, "little"), head, memoryview(written)[size:]])


@contextmanager
def loaded(path: Path, kind: str, command: str) -> Generator[tuple[dict[str, Any], dict[str, np.ndarray]]]:
    """The header and the arrays of a file of such a kind that `save_arrays` wrote, as users do with ``command``.

    Raises:
        DataError: the file is missing, is no safetensors file, holds something else, was changed, or the block raises.
    """
    with _reading(path, kind, command):
        content = path.read_bytes()
        arrays = load(content)
        size = int.from_bytes(content[:8], "little")
        metadata: dict[str, Any] = json.loads(content[8 : 8 + size]).get("__metadata__", {})
    found = metadata.pop("format", None)
    if found != _format(kind):
        raise DataError(f"{path}: expected the format {_format(kind)!r}, got {found!r}; make one with `{command}`")
    with _reading(path, kind, command):
        kept = metadata.pop("fingerprint", None)
        header = {name: json.loads(value) for name, value in metadata.items()}
        if fingerprint_of(header, arrays) != kept:
            raise DataError("its content was changed after it was written")
        yield header, arrays


@contextmanager
def _reading(path: Path, kind: str, command: str) -> Generator[None]:
    """Say of whatever goes wrong in the block, by a `DataError`, that the file is no such file."""
    try:
        yield
    except (OSError, SafetensorError, CoverdriveError, ValueError, LookupError, TypeError, AttributeError) as error:
        said = f"there is no {error} in it" if isinstance(error, LookupError) else error
        raise DataError(f"{path}: not a {kind} file ({said}); make one with `{command}`") from error


def _format(kind: str) -> str:
    return f"coverdrive {kind} {_VERSION}"
