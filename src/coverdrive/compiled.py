"""Compilation of plain loops to machine code with Numba, kept on disk between runs.

What Python calls becomes a *whole* with all that it calls (`coverdrive.wholes`), so that few functions with many parts
should be called from Python. With versions of Numba that wholes are not made for, code is compiled as Numba does it.

Numba takes kept code for valid as long as the file of the function is the same, whatever became of the functions that
it calls in other files. Code is therefore kept in a folder that is named after all sources of its own hall (a package
of `coverdrive` with all that is in it) and those at the top of `coverdrive`; compiled functions call no others. Where
several processes need the same code, one compiles it while the others wait.

Sums are computed in the order in which they are written: with Numba's ``fastmath``, the last digits would depend on
whether code was compiled in this process or read from the disk, and drives with the same seed would drift apart.
"""

import atexit
import hashlib
import inspect
import os
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any, ParamSpec, TypeVar

import numba  # pyright: ignore[reportMissingTypeStubs]

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")

_numba: Any = numba

_wholes: Any = import_module("coverdrive.wholes") if numba.__version__.startswith("0.68.") else None
"""what is known of the inside of this version of Numba, if anything"""


def lent(kind: type[T]) -> type[T]:
    """A kind of named tuples that compiled code is given by Python, which holds them meanwhile, and never makes."""
    return _wholes.lent(kind) if _wholes else kind


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """A function as machine code, compiled at its first call with arguments of these types.

    Numba makes the arrays and named tuples that such a function returns to Python by Python code, and does not look
    whether an interrupt ended it. Where interrupts matter, return numbers only and fill arrays that are given.

    Args:
        function: of numbers, arrays and named tuples of them, in what of Python and NumPy Numba knows.
    """
    folder = _folder(Path(inspect.getfile(inspect.unwrap(function))).parent)
    kept, _numba.config.CACHE_DIR = _numba.config.CACHE_DIR, str(folder or "")
    try:
        plain = inspect.unwrap(function)
        whole: Any = _wholes.Whole(plain) if _wholes else _numba.njit(error_model="numpy")(plain)
        if folder is not None:
            whole.enable_caching()
        return whole
    finally:
        _numba.config.CACHE_DIR = kept


def is_there(function: Any) -> bool:
    """Whether a compiled function need not be compiled any more: it was, in this process or one whose code is kept."""
    kept = function.stats.cache_path
    return bool(function.overloads or (kept and any(Path(kept).glob(f"*.{function.py_func.__qualname__}-*.nbc"))))


def cache_folder() -> Path:
    """Where code is kept, in a folder for each version of the sources."""
    return Path(os.environ.get("NUMBA_CACHE_DIR") or Path(__file__).parent / "__pycache__")


@cache
def _folder(package: Path) -> Path | None:
    """Where code of the sources in a folder is kept, or None if nothing is there and nothing can be written."""
    folder = cache_folder() / f"compiled-{_fingerprint(package)}"
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
    if os.access(folder, os.W_OK):
        return folder
    return _shown(folder.resolve()) if folder.is_dir() else None


def _shown(kept: Path) -> Path | None:
    """A folder of this process with links to code that is kept where nothing can be written.

    Numba reads only where it can write.
    """
    try:
        folder = Path(mkdtemp(prefix="coverdrive-"))
        atexit.register(rmtree, folder, ignore_errors=True)
        for file in kept.glob("*/*"):
            link = folder / file.relative_to(kept)
            link.parent.mkdir(exist_ok=True)
            link.symlink_to(file)
    except OSError:
        return None
    return folder


def _fingerprint(package: Path) -> str:
    top = Path(__file__).parent
    hall = next((each for each in (package, *package.parents) if each.parent == top), None)
    own = package.glob("*.py") if hall is None else hall.rglob("*.py")
    files = sorted({*own, *top.glob("*.py")})
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:16]
