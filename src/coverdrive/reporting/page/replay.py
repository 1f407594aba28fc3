"""One drive as compact data for the replay in the page.

All numbers are rounded to integers of a unit, replaced by their differences along one axis, laid out byte by byte
(all lowest bytes first), deflated, and written as base64; `replay-data.js` undoes it. Paths lie beside each other, so
that what is alike in them is too: their arrays are (points, 2, paths).
"""

import base64
import zlib
from types import MappingProxyType
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from coverdrive.planning.plan import Status
from coverdrive.reporting.active_constraints import ActiveConstraints
from coverdrive.simulation.initial import EGO
from coverdrive.simulation.misses import cause_of, find_windows, left_recently
from coverdrive.simulation.outcome import Kind
from coverdrive.simulation.trace import Trace

_COARSE, _CENTIMETRE, _FINE = 0.02, 0.01, 0.001

STATUSES = MappingProxyType(
    {
        Status.SOLVED.value: "an optimised plan that is clear of every predicted path",
        Status.FALLBACK.value: "the rest of the last plan or a simple manoeuvre, clear of every predicted path",
        Status.REAR.value: "clear as long as the vehicle behind keeps its distance",
        Status.UNSAFE.value: "nothing clear was found",
        Status.BLIND.value: "what was seen cannot be true, so that nothing can be promised",
    }
)
"""how plans were found, each in one line"""

SLACK = "how far a plan reaches into a predicted box, tube included: 0 at its edge, 1 at its centre"
"""in one line"""


def replay_data(trial: int, trace: Trace, constraints: ActiveConstraints | None) -> dict[str, Any]:
    """A drive as JSON values.

    Args:
        trial: its number.
        trace: the drive.
        constraints: tells which are active; none are marked without.
    """
    scene, plans, paths = trace.scene, trace.plans, trace.paths
    left = left_recently(trace, find_windows(trace))
    packer = _Packer()
    packer.add("lon", scene.lon, _CENTIMETRE, axis=0)
    packer.add("lat", scene.lat, _CENTIMETRE, axis=0)
    packer.add("speed", scene.speed, _CENTIMETRE, axis=0)
    packer.add("heading", scene.heading, _FINE, axis=0)
    packer.add("valid", scene.valid, 1, axis=0)
    packer.add("left", left, 1, axis=0)
    packer.add("paths", _side_by_side([each.points for each in paths]), _COARSE, axis=0)
    packer.add("boxes", _side_by_side([each.half_sizes for each in paths]), _COARSE, axis=0)
    packer.add("vehicle", np.concatenate([each.vehicle for each in paths]), 1, axis=0)
    packer.add("active", _active(trace, constraints), 1)
    packer.add("plan", np.stack([plan.states[:, [0, 1, 3]] for plan in plans]), _FINE, axis=1)
    packer.add("slack", np.stack([plan.slack for plan in plans]), _FINE)
    packer.add("input", np.stack([plan.inputs[0] for plan in plans]), _FINE)
    return {
        "trial": trial,
        "kind": trace.outcome.kind.value,
        "partner": trace.outcome.partner,
        "fault": trace.outcome.at_fault.value,
        "cause": cause_of(trace).value,
        "dt": float(trace.time[1] - trace.time[0]),
        "planDt": plans[0].dt,
        "edges": np.asarray(trace.road.edges).round(3).tolist(),
        "sizes": np.stack([scene.length[0], scene.width[0]], axis=-1).round(2).tolist(),
        "own": EGO,
        "counts": [len(each) for each in paths],
        "status": [list(Status).index(plan.status) for plan in plans],
        "statuses": [status.value for status in Status],
        "milliseconds": (1e3 * trace.planning_seconds).round(1).tolist(),
        "events": _events(trace, left),
        "arrays": packer.arrays,
        "data": packer.text,
    }


def _side_by_side(arrays: list[Float[np.ndarray, "_ P 2"]]) -> Float[np.ndarray, "P 2 S"]:
    """The paths of all steps, with the path as the last axis."""
    return np.moveaxis(np.concatenate(arrays), 0, -1)


def _active(trace: Trace, constraints: ActiveConstraints | None) -> Int[np.ndarray, " S"]:
    """One integer for each path: bit k says whether it constrains the plan at point k."""
    if constraints is None:
        return np.zeros(sum(len(each) for each in trace.paths), dtype=np.int64)
    everything = np.concatenate([constraints.of(trace, step) for step in range(len(trace))])
    return everything.astype(np.int64) @ (1 << np.arange(everything.shape[1], dtype=np.int64))


def _events(trace: Trace, left: Bool[np.ndarray, "m A"]) -> list[tuple[int, str, str]]:
    """Moments that the ruler of the replay marks: when, which colour of the page, and what happened."""
    lane = np.asarray(trace.road.lane_of(np.asarray(trace.scene.lat[:, EGO])))
    changed = [(int(step) + 1, "own", "the ego changes lane") for step in np.flatnonzero(lane[1:] != lane[:-1])]
    gone = [(step, "ink", "a vehicle has left its predicted set") for step in _begins(left.sum(1))]
    statuses = [plan.status for plan in trace.plans]
    plans = [
        (step, slug(status.value), f"plan {status.value}: {STATUSES[status.value]}")
        for step, (status, before) in enumerate(zip(statuses, [Status.SOLVED, *statuses], strict=False))
        if status is not before and status not in (Status.SOLVED, Status.FALLBACK)
    ]
    hit = [(len(trace), "bad", f"{trace.outcome.kind.value} collision")] * (trace.outcome.kind is not Kind.FINISHED)
    return sorted([*changed, *gone, *plans, *hit])


def _begins(counts: Int[np.ndarray, " m"]) -> list[int]:
    """Moments at which a count rises."""
    return [int(step) for step in np.flatnonzero(np.diff(counts, prepend=0) > 0)]


def slug(name: str) -> str:
    """A name as part of a name of the style sheet."""
    return name.replace(" ", "-")


class _Packer:
    """Collects arrays, and writes them as one text."""

    def __init__(self) -> None:
        self.arrays: dict[str, dict[str, Any]] = {}
        self._integers: list[np.ndarray] = []

    def add(self, name: str, values: Any, unit: float, axis: int | None = None) -> None:
        """Add an array that is to be restored up to half a unit; along ``axis`` only differences are stored."""
        whole = np.rint(np.asarray(values, dtype=float) / unit).astype(np.int32)
        if axis is not None:
            whole = np.diff(whole, axis=axis, prepend=0)
        self.arrays[name] = {"shape": list(whole.shape), "unit": unit, "axis": axis}
        self._integers.append(whole.ravel())

    @property
    def text(self) -> str:
        """All arrays one after the other."""
        everything = np.concatenate(self._integers).astype("<i4")
        planes = everything.view(np.uint8).reshape(-1, 4).T
        return base64.b64encode(zlib.compress(np.ascontiguousarray(planes).tobytes(), 9)).decode()
