"""Traces as files: one compressed ``.npz`` of plain arrays, no pickle.

The predicted paths of all steps lie behind one another; ``paths.count`` says how many belong to each step.
"""

import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from coverdrive.errors import DataError
from coverdrive.files import write_atomically
from coverdrive.paths import PredictedPaths
from coverdrive.planning.plan import Plan, Status
from coverdrive.road import Road
from coverdrive.scene import Scene
from coverdrive.simulation.outcome import Fault, Kind, Outcome
from coverdrive.simulation.trace import Trace

_SCENE = ("lon", "lat", "speed", "heading", "length", "width", "valid")
_STEPS = ("base", "stuck", "missed", "prediction_seconds", "planning_seconds")
_PLAN = ("states", "inputs", "slack", "cost", "seconds", "dt", "severity")
_PATHS = ("points", "vehicle", "half_sizes")
_NOBODY = -1


def save_trace(trace: Trace, path: Path) -> None:
    """Write a trace, atomically; the file name should end in ``.npz``."""
    arrays = _flat(trace)

    def write(temporary: Path) -> None:
        with temporary.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)

    write_atomically(path, write)


def load_trace(path: Path) -> Trace:
    """Read a trace.

    Raises:
        DataError: the file is missing or is not a trace.
    """
    if not path.is_file():
        raise DataError(f"there is no trace at {path}; check the path")
    if not zipfile.is_zipfile(path):
        raise DataError(f"{path} is not a trace, but some other file or half of one; check the path")
    try:
        with np.load(path, allow_pickle=False) as file:
            return _trace({name: file[name] for name in file.files})
    except (KeyError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise DataError(f"{path} is not a trace written by this version ({error}); simulate it again") from error


def _flat(trace: Trace) -> dict[str, np.ndarray]:
    """All arrays of a trace by name."""
    outcome = trace.outcome
    return {
        "time": trace.time,
        "road.edges": np.asarray(trace.road.edges),
        "road.length": np.asarray(trace.road.length),
        **{f"scene.{name}": np.asarray(getattr(trace.scene, name)) for name in _SCENE},
        **{name: getattr(trace, name) for name in _STEPS},
        **{f"plan.{name}": np.stack([getattr(plan, name) for plan in trace.plans]) for name in _PLAN},
        "plan.status": np.array([plan.status.value for plan in trace.plans]),
        **{f"paths.{name}": np.concatenate([getattr(paths, name) for paths in trace.paths]) for name in _PATHS},
        **_ellipses(trace),
        "paths.count": np.array([len(paths) for paths in trace.paths]),
        "paths.dt": np.array([paths.dt for paths in trace.paths]),
        "outcome.kind": np.array(outcome.kind.value),
        "outcome.time": np.asarray(outcome.time),
        "outcome.partner": np.asarray(_NOBODY if outcome.partner is None else outcome.partner),
        "outcome.at_fault": np.array(outcome.at_fault.value),
    }


def _ellipses(trace: Trace) -> dict[str, np.ndarray]:
    """Ellipses of all paths, if there are any."""
    known = [paths.ellipses for paths in trace.paths if paths.ellipses is not None]
    return {"paths.ellipses": np.concatenate(known)} if len(known) == len(trace.paths) else {}


def _trace(arrays: Mapping[str, np.ndarray]) -> Trace:
    """The inverse of `_flat`."""
    return Trace(
        time=arrays["time"],
        scene=Scene(**{name: arrays[f"scene.{name}"] for name in _SCENE}),
        road=Road(arrays["road.edges"], float(arrays["road.length"])),
        paths=_paths(arrays),
        plans=tuple(_plan(arrays, k) for k in range(len(arrays["plan.status"]))),
        **{name: arrays[name] for name in _STEPS},
        outcome=_outcome(arrays),
    )


def _paths(arrays: Mapping[str, np.ndarray]) -> tuple[PredictedPaths, ...]:
    ends = np.cumsum(arrays["paths.count"])[:-1]
    points, vehicle, half_sizes = (np.split(arrays[f"paths.{name}"], ends) for name in _PATHS)
    steps = arrays["paths.dt"].tolist()
    known = "paths.ellipses" in arrays
    ellipses = np.split(arrays["paths.ellipses"], ends) if known else [None] * len(steps)
    return tuple(PredictedPaths(*fields) for fields in zip(points, vehicle, half_sizes, steps, ellipses, strict=True))


def _plan(arrays: Mapping[str, np.ndarray], k: int) -> Plan:
    def at(name: str) -> Any:
        return arrays[f"plan.{name}"][k]

    return Plan(
        states=at("states"),
        inputs=at("inputs"),
        slack=at("slack"),
        status=Status(str(at("status"))),
        cost=float(at("cost")),
        seconds=float(at("seconds")),
        dt=float(at("dt")),
        severity=float(at("severity")),
    )


def _outcome(arrays: Mapping[str, np.ndarray]) -> Outcome:
    partner = int(arrays["outcome.partner"])
    return Outcome(
        kind=Kind(str(arrays["outcome.kind"])),
        time=float(arrays["outcome.time"]),
        partner=None if partner == _NOBODY else partner,
        at_fault=Fault(str(arrays["outcome.at_fault"])),
    )
