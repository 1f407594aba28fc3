"""What is installed, and what is missing: every part is tried out, not only looked for."""

import importlib
import os
import platform
import shutil
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from tempfile import TemporaryFile

from packaging.requirements import Requirement

from coverdrive.errors import CoverdriveError, DataError
from coverdrive.extras import EXTRAS, require
from coverdrive.progress import done, stage

_MODULES = {
    "commonroad-io": "commonroad.common.file_reader",
    "commonroad-vehicle-models": "vehiclemodels",
    "pillow": "PIL",
}
"""what to import of packages whose modules are not called like them"""


@dataclass(frozen=True)
class Finding:
    """One thing that was tried."""

    name: str
    fine: bool
    """whether it works"""
    found: str
    """version, place, or what went wrong"""
    hint: str = ""
    """what to do if it is not fine"""
    needed: bool = True
    """whether the commands need it"""


def examine(folder: Path) -> list[Finding]:
    """Try everything.

    Args:
        folder: where results are to be written.
    """
    checks = list(_checks(folder))
    findings: list[Finding] = []
    with stage("examination"):
        for check in checks:
            findings.append(_tried(*check))
            done(len(findings), len(checks))
    return findings


def _tried(name: str, look: Callable[[], str], hint: str, needed: bool) -> Finding:
    """What a look has found; whatever it raises is what went wrong."""
    try:
        return Finding(name, True, look(), needed=needed)
    except CoverdriveError as error:
        found = str(error)
    except Exception as error:  # a broken package raises whatever it likes
        found = _in_one_line(error)
    return Finding(name, False, found, hint, needed)


def _in_one_line(error: Exception) -> str:
    first, _, _ = str(error).strip().partition("\n")
    return f"{type(error).__name__}: {first}"


def _checks(folder: Path) -> Iterator[tuple[str, Callable[[], str], str, bool]]:
    """Name, look, what to do if it fails, and whether the commands need it."""
    upgrade = "pip install --upgrade"
    yield "Python", _python, "", True
    yield "coverdrive", partial(_version, "coverdrive"), "pip install . in the folder of its sources", True
    for each in _requirements():
        yield each.name, partial(_package, each), f'{upgrade} "{each.name}{each.specifier}"', True
    yield "JAX device", _devices, f"{upgrade} jax; JAX_PLATFORMS=cpu avoids a broken GPU", True
    for module, each in EXTRAS.items():
        yield each.package, partial(_extra, module), f"only for {each.purpose}: {each.command}", False
    yield "ffmpeg", _ffmpeg, f"{upgrade} av", True
    yield "results", partial(_writable, folder), "name another folder with --out", True
    yield (
        "cache of matplotlib",
        _kept("matplotlib", "get_cachedir"),
        "set MPLCONFIGDIR to a folder that you can write to",
        True,
    )
    hint = "planning is compiled anew by every command; set NUMBA_CACHE_DIR to a folder that you can write to"
    yield "cache of Numba", _kept("coverdrive.compiled", "cache_folder"), hint, False


def _python() -> str:
    return f"{platform.python_version()} on {platform.system()} {platform.machine()}, {os.cpu_count()} processors"


def _requirements() -> list[Requirement]:
    """What coverdrive requires, extras apart; nothing if it is not installed."""
    try:
        lines = requires("coverdrive") or []
    except PackageNotFoundError:
        return []
    required = [Requirement(line) for line in lines]
    here = [each for each in required if each.marker is None or each.marker.evaluate({"extra": ""})]
    return sorted(here, key=lambda each: each.name)


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        raise DataError("not installed") from None


def _package(required: Requirement) -> str:
    found = _version(required.name)
    if not required.specifier.contains(found, prereleases=True):
        raise DataError(f"{found}, but coverdrive needs {required.specifier}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # others' warnings are no fault of what is installed
            importlib.import_module(_MODULES.get(required.name, required.name.replace("-", "_")))
    except Exception as error:
        raise DataError(f"{found}, but it cannot be imported ({_in_one_line(error)})") from error
    return found


def _devices() -> str:
    return ", ".join(str(device) for device in importlib.import_module("jax").devices())


def _extra(module: str) -> str:
    found = _version(module)
    require(module)
    return found


def _ffmpeg() -> str:
    """The library that writes videos; its encoder of H.264 has to be there."""
    av = importlib.import_module("av")
    return f"{av.ffmpeg_version_info} with {av.codec.Codec('libx264', 'w').name}"


def _writable(folder: Path) -> str:
    """Try the folder itself, or the nearest one above it that is there."""
    place = next(each for each in (folder.resolve(), *folder.resolve().parents) if each.exists())
    with TemporaryFile(dir=place):
        free = shutil.disk_usage(place).free / 1e9
    return f"{folder} is writable, {free:.0f} GB free"


def _kept(module: str, folder: str) -> Callable[[], str]:
    """Whether a module can write to the folder that a function of it tells."""
    return lambda: _writable(Path(getattr(importlib.import_module(module), folder)()))
