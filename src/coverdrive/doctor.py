"""What is installed, and what is missing: every part is tried out, not only looked for."""

import importlib
import os
import platform
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from tempfile import TemporaryFile

from packaging.requirements import Requirement

from coverdrive.extras import EXTRAS, require
from coverdrive.progress import done, stage

_MODULES = {
    "commonroad-io": "commonroad.common.file_reader",
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


@dataclass(frozen=True)
class _Check:
    """One thing to try."""

    name: str
    look: Callable[[], str]
    """says what is there; whatever it raises is what went wrong"""
    hint: str
    needed: bool = True


class _Wrong(Exception):
    """Something is there, but not as it should be."""


def examine(folder: Path) -> list[Finding]:
    """Try everything.

    Args:
        folder: where results are to be written.
    """
    checks = _checks(folder)
    findings: list[Finding] = []
    with stage("examination"):
        for check in checks:
            findings.append(_tried(check))
            done(len(findings), len(checks))
    return findings


def _tried(check: _Check) -> Finding:
    try:
        return Finding(check.name, True, check.look(), needed=check.needed)
    except _Wrong as wrong:
        found = str(wrong)
    except Exception as error:  # a broken package raises whatever it likes
        found = _in_one_line(error)
    return Finding(check.name, False, found, check.hint, check.needed)


def _in_one_line(error: Exception) -> str:
    first, _, _ = str(error).strip().partition("\n")
    return f"{type(error).__name__}: {first}"


def _checks(folder: Path) -> Sequence[_Check]:
    upgrade = "pip install --upgrade"
    return (
        _Check("Python", _python, ""),
        _Check("coverdrive", partial(_version, "coverdrive"), "pip install . in the folder of its sources"),
        *(
            _Check(each.name, partial(_package, each), f'{upgrade} "{each.name}{each.specifier}"')
            for each in _requirements()
        ),
        _Check("JAX device", _devices, f"{upgrade} jax; JAX_PLATFORMS=cpu avoids a broken GPU"),
        *(
            _Check(each.package, partial(_extra, module), f"only for {each.purpose}: {each.command}", needed=False)
            for module, each in EXTRAS.items()
        ),
        _Check("ffmpeg", _ffmpeg, f"{upgrade} av"),
        _Check("results", lambda: _writable(folder), "name another folder with --out"),
        _Check(
            "cache of matplotlib",
            lambda: _writable(Path(importlib.import_module("matplotlib").get_cachedir())),
            "set MPLCONFIGDIR to a folder that you can write to",
        ),
        _Check(
            "cache of Numba",
            lambda: _writable(importlib.import_module("coverdrive.compiled").cache_folder()),
            "planning is compiled anew by every command; set NUMBA_CACHE_DIR to a folder that you can write to",
            needed=False,
        ),
        _Check(
            "recorded US-101 traffic",
            _data,
            "only for tests: set COVERDRIVE_DATA to the folder that holds us101/",
            needed=False,
        ),
        _Check(
            "Chromium and Playwright",
            _browser,
            "only for tests of the report: apt-get install chromium, pip install playwright",
            needed=False,
        ),
    )


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
        raise _Wrong("not installed") from None


def _package(required: Requirement) -> str:
    found = _version(required.name)
    if not required.specifier.contains(found, prereleases=True):
        raise _Wrong(f"{found}, but coverdrive needs {required.specifier}")
    try:
        importlib.import_module(_MODULES.get(required.name, required.name.replace("-", "_")))
    except Exception as error:
        raise _Wrong(f"{found}, but it cannot be imported ({_in_one_line(error)})") from error
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


def _data() -> str:
    named = os.environ.get("COVERDRIVE_DATA")
    if named is None:
        raise _Wrong("COVERDRIVE_DATA is not set")
    folder = Path(named) / "us101"
    try:
        with next(file for file in sorted(folder.rglob("*")) if file.is_file()).open("rb") as file:
            file.read(1)
    except (OSError, StopIteration):
        raise _Wrong(f"nothing readable in {folder}") from None
    return f"readable, {folder}"


def _browser() -> str:
    program, playwright = shutil.which("chromium"), _version("playwright")
    if program is None:
        raise _Wrong(f"playwright {playwright}, but no chromium")
    return f"{program}, playwright {playwright}"
