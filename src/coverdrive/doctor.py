"""What is installed, and what is missing: every part is tried out, not only looked for."""

import importlib
import os
import platform
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from tempfile import TemporaryFile


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


def examine(folder: Path, progress: Callable[[float], None] | None = None) -> list[Finding]:
    """Try everything.

    Args:
        folder: where results are to be written.
        progress: called with the share that is done.
    """
    checks: list[Callable[[], Finding]] = [
        _python,
        *(lambda name=name: _package(name) for name in _packages()),
        _devices,
        *(lambda name=name: _solver(name) for name in ("fatrop", "ipopt")),
        _video,
        lambda: _writable("results", folder, "name another folder with --out"),
        lambda: _writable("cache of matplotlib", _cache(), "set MPLCONFIGDIR to a folder that you can write to"),
        _data,
        _browser,
    ]
    findings: list[Finding] = []
    for check in checks:
        findings.append(check())
        if progress is not None:
            progress(len(findings) / len(checks))
    return findings


def _python() -> Finding:
    where = f"{platform.python_version()} on {platform.system()} {platform.machine()}, {os.cpu_count()} processors"
    return Finding("Python", sys.version_info >= (3, 11), where, "coverdrive needs Python 3.11 or newer")


def _packages() -> list[str]:
    """Names of the packages that coverdrive requires."""
    lines = [line for line in requires("coverdrive") or [] if "extra ==" not in line]
    return sorted(line.split(">")[0].split("=")[0].strip() for line in lines)


def _package(name: str) -> Finding:
    try:
        return Finding(name, True, version(name))
    except PackageNotFoundError:
        return Finding(name, False, "not installed", f"pip install {name}")


def _devices() -> Finding:
    try:
        import jax

        devices = ", ".join(str(device) for device in jax.devices())
    except (ImportError, RuntimeError) as error:
        return Finding(
            "JAX device", False, str(error), "pip install --upgrade jax; JAX_PLATFORMS=cpu avoids a broken GPU"
        )
    return Finding("JAX device", True, devices)


def _solver(name: str) -> Finding:
    try:
        found = importlib.import_module("casadi").has_nlpsol(name)
    except ImportError as error:
        return Finding(f"solver {name}", False, str(error), "pip install --upgrade casadi")
    return Finding(f"solver {name}", found, "works" if found else "not in this CasADi", "pip install --upgrade casadi")


def _video() -> Finding:
    hint = "pip install --upgrade imageio-ffmpeg, or set IMAGEIO_FFMPEG_EXE to a program of your own"
    try:
        ffmpeg = importlib.import_module("imageio_ffmpeg")
        return Finding("ffmpeg", True, f"{ffmpeg.get_ffmpeg_version()} ({ffmpeg.get_ffmpeg_exe()})")
    except (ImportError, RuntimeError) as error:
        return Finding("ffmpeg", False, str(error), hint)


def _cache() -> Path:
    """Where matplotlib keeps its list of fonts."""
    return Path(importlib.import_module("matplotlib").get_cachedir())


def _writable(name: str, folder: Path, hint: str) -> Finding:
    """Try the folder itself, or the nearest one above it that is there."""
    place = next(each for each in (folder.resolve(), *folder.resolve().parents) if each.exists())
    try:
        with TemporaryFile(dir=place):
            free = shutil.disk_usage(place).free / 1e9
    except OSError as error:
        return Finding(name, False, str(error), hint)
    return Finding(name, True, f"{folder} is writable, {free:.0f} GB free")


def _data() -> Finding:
    name = "recorded US-101 traffic"
    hint = "only for tests: set COVERDRIVE_DATA to the folder that holds us101/"
    named = os.environ.get("COVERDRIVE_DATA")
    if named is None:
        return Finding(name, False, "COVERDRIVE_DATA is not set", hint, needed=False)
    folder = Path(named) / "us101"
    try:
        with next(file for file in sorted(folder.rglob("*")) if file.is_file()).open("rb") as file:
            file.read(1)
    except (OSError, StopIteration):
        return Finding(name, False, f"nothing readable in {folder}", hint, needed=False)
    return Finding(name, True, f"readable, {folder}", needed=False)


def _browser() -> Finding:
    name, hint = (
        "Chromium and Playwright",
        "only for tests of the report: apt-get install chromium, pip install playwright",
    )
    program = shutil.which("chromium")
    try:
        playwright = version("playwright")
    except PackageNotFoundError:
        playwright = None
    fine = program is not None and playwright is not None
    return Finding(
        name, fine, f"{program or 'no chromium'}, playwright {playwright or 'not installed'}", hint, needed=False
    )
