"""Compilation of plain loops to machine code with Numba, kept on disk between runs.

What Python calls becomes a *whole*: its code and that of all compiled functions that it calls are linked, optimised and
turned into machine code together, once, and kept. A function that other code calls is a *part* of these: it is neither
linked nor optimised on its own, as Numba would do it, which takes several times as long the deeper calls go. As every
whole holds all its parts, few functions with many parts should be called from Python.

Numba takes kept code for valid as long as the file of the function is the same, whatever became of the functions that
it calls in other files. Code is therefore kept in a folder that is named after all sources of its own hall (a package
of `coverdrive` with all that is in it) and those at the top of `coverdrive`; compiled functions call no others. Where
several processes need the same code, one compiles it while the others wait.

Sums are computed in the order in which they are written: with Numba's ``fastmath``, the last digits would depend on
whether code was compiled in this process or read from the disk, and drives with the same seed would drift apart.
"""

import atexit
import hashlib
import importlib
import inspect
import os
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from functools import cache, cached_property
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any, ParamSpec, TypeVar

import numba  # pyright: ignore[reportMissingTypeStubs]
from llvmlite.binding import Linkage  # pyright: ignore[reportMissingTypeStubs]
from numba.core import codegen, compiler, registry, types  # pyright: ignore[reportMissingTypeStubs]

P = ParamSpec("P")
R = TypeVar("R")

_numba: Any = numba
_Library: Any = codegen.JITCodeLibrary
_Compiler: Any = compiler.Compiler
_Dispatcher: Any = registry.CPUDispatcher
_types: Any = types
_OPTIONS = {"nopython": True, "error_model": "numpy", "no_cfunc_wrapper": True}


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
        whole = _Whole(inspect.unwrap(function), targetoptions=_OPTIONS, pipeline_class=_WholeCompiler)
        if folder is not None:
            whole.enable_caching()
        return whole
    finally:
        _numba.config.CACHE_DIR = kept


def is_there(function: Any) -> bool:
    """Whether a compiled function need not be compiled any more: it was, in this process or one whose code is kept."""
    kept = function.stats.cache_path
    return bool(function.overloads or (kept and any(Path(kept).glob(f"*.{function.py_func.__qualname__}-*.nbc"))))


class _WholeLibrary(_Library):
    """Code that Python calls, to be linked with that of all parts."""

    def add_linking_library(self, library: Any) -> None:
        super().add_linking_library(library)
        if isinstance(library, _PartLibrary):
            for each in library._linking_libraries:
                if each not in self._linking_libraries:
                    self.add_linking_library(each)

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if function.linkage == Linkage.linkonce_odr:  # a part: nobody else calls this copy of it
                function.linkage = "internal"
        super()._optimize_final_module()


class _PartLibrary(_Library):
    """Code that other code calls, as it is."""

    def finalize(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class _WholeCompiler(_Compiler):
    def define_pipelines(self) -> Any:
        self._into(_WholeLibrary).enable_object_caching()
        return super().define_pipelines()

    def _into(self, kind: Any) -> Any:
        """Let what is compiled become a library of a kind."""
        self.state.library = kind(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return self.state.library


class _PartCompiler(_WholeCompiler):
    def define_pipelines(self) -> Any:
        self._into(_PartLibrary)
        self.state.flags.no_compile = True
        return _Compiler.define_pipelines(self)


class _Part(_Dispatcher):
    """A function as other code calls it."""

    def get_call_template(self, args: tuple[Any, ...], kws: dict[str, Any]) -> Any:
        return super().get_call_template(tuple(map(_types.unliteral, args)), kws)  # one code for all constants

    def add_overload(self, cres: Any) -> None:
        cres = cres._replace(entry_point=object())  # there is nothing to call, but Numba finds the code by it
        self.targetctx.insert_user_function(cres.entry_point, cres.fndesc, [cres.library])
        self.overloads[tuple(cres.signature.args)] = cres


class _Whole(_Dispatcher):
    """A function as Python calls it."""

    @cached_property
    def _part(self) -> _Part:
        return _Part(self.py_func, targetoptions=_OPTIONS | {"no_cpython_wrapper": True}, pipeline_class=_PartCompiler)

    @property
    def _numba_type_(self) -> Any:
        """What it is to other code."""
        return _types.Dispatcher(self._part)

    def compile(self, sig: Any) -> Any:
        with _alone(self.stats.cache_path):
            return super().compile(sig)


@contextmanager
def _alone(folder: str | None) -> Generator[None]:
    """Wait until no other process compiles what is kept in a folder, as far as folders can be locked."""
    held = None
    with suppress(ImportError, OSError):
        if folder is not None:
            fcntl, held = importlib.import_module("fcntl"), os.open(folder, os.O_RDONLY)
            fcntl.flock(held, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if held is not None:
            os.close(held)


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
