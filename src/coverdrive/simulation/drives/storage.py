"""Traces as files: one compressed ``.npz`` of plain arrays, no pickle.

The predicted paths of all steps lie behind one another; ``paths.count`` says how many belong to each step.
"""

import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from coverdrive.errors import DataError
from coverdrive.files import write_arrays
from coverdrive.paths import PredictedPaths, together
from coverdrive.plan import Plan, Status
from coverdrive.reference_line import ReferenceLine
from coverdrive.road import LaneEdges, Road
from coverdrive.scene import Scene
from coverdrive.simulation.drives.outcome import Fault, Kind, Outcome
from coverdrive.simulation.drives.trace import Trace

_STEPS = ("base", "stuck", "missed", "prediction_seconds", "planning_seconds", "wall_seconds")
_NOBODY = -1


def save_trace(trace: Trace, path: Path) -> None:
    """Write a trace, atomically; the file name should end in ``.npz``."""
    write_arrays(path, _flat(trace))


def load_trace(path: Path) -> Trace:
    """Read a trace; a DataError if the file is missing or is none."""
    if not path.is_file():
        raise DataError(f"there is no trace at {path}; check the path")
    if not zipfile.is_zipfile(path):
        raise DataError(f"{path} is not a trace, but some other file or half of one; check the path")
    try:
        with np.load(path, allow_pickle=False) as file:
            return _trace({name: file[name] for name in file.files})
    except (KeyError, TypeError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise DataError(f"{path} is not a trace written by this version ({error}); simulate it again") from error


def _flat(trace: Trace) -> dict[str, np.ndarray]:
    """All arrays of a trace by name."""
    paths, plans, outcome = trace.paths, trace.plans, trace.outcome
    values = {
        "time": trace.time,
        **_flat_road(trace.road),
        **{f"scene.{name}": value for name, value in vars(trace.scene).items()},
        **{name: getattr(trace, name) for name in _STEPS},
        **{f"plan.{name}": [getattr(plan, name) for plan in plans] for name in vars(plans[0])},
        "plan.status": [plan.status.value for plan in plans],
        "plan.fail_safe": [
            np.full_like(plan.states, np.nan) if plan.fail_safe is None else plan.fail_safe for plan in plans
        ],
        **{f"paths.{name}": value for name, value in vars(together(paths)).items() if value is not None},
        "paths.count": [len(each) for each in paths],
        "paths.dt": [each.dt for each in paths],
        **{f"outcome.{name}": value for name, value in vars(outcome).items()},
        "outcome.partner": _NOBODY if outcome.partner is None else outcome.partner,
    }
    return {name: np.asarray(value) for name, value in values.items()}


def _flat_road(road: Road) -> dict[str, Any]:
    """The fields of a road by name, but for those that are None."""
    parts = {"road": road, "line": road.line, "changing": road.changing}
    return {
        f"{name}.{field.name}": value
        for name, part in parts.items()
        if part is not None
        for field in fields(part)
        if field.name not in parts and (value := getattr(part, field.name)) is not None
    }


def _trace(arrays: Mapping[str, np.ndarray]) -> Trace:
    """The inverse of `_flat`."""

    def part(name: str) -> dict[str, Any]:
        """The arrays of a part, of which single numbers and words are not kept as arrays."""
        found = {key.removeprefix(f"{name}."): value for key, value in arrays.items() if key.startswith(f"{name}.")}
        return {key: value if value.ndim else value.item() for key, value in found.items()}

    paths, outcome = part("paths"), part("outcome")
    plans = {key: value.tolist() if value.ndim == 1 else value for key, value in part("plan").items()}
    plans["status"] = [Status(each) for each in plans["status"]]
    plans["fail_safe"] = [None if np.isnan(each).any() else each for each in plans["fail_safe"]]
    counts, dts = paths.pop("count"), paths.pop("dt").tolist()
    all_paths = PredictedPaths(**paths, dt=0.0)
    of_steps = np.split(np.arange(len(all_paths)), np.cumsum(counts)[:-1])
    partner = None if outcome["partner"] == _NOBODY else outcome["partner"]
    return Trace(
        time=arrays["time"],
        scene=Scene(**part("scene")),
        road=Road(
            **part("road"),
            line=ReferenceLine(**part("line")) if "line.start" in arrays else None,
            changing=LaneEdges(**part("changing")) if "changing.lon" in arrays else None,
        ),
        paths=tuple(replace(all_paths.of(own), dt=dt) for own, dt in zip(of_steps, dts, strict=True)),
        plans=tuple(Plan(**dict(zip(plans, row, strict=True))) for row in zip(*plans.values(), strict=True)),
        **{name: arrays[name] for name in _STEPS},
        outcome=Outcome(Kind(outcome["kind"]), outcome["time"], partner, Fault(outcome["at_fault"])),
    )
