"""One drive as compact data for the replay in the page.

All numbers are rounded to integers of a unit, replaced by their differences along one axis, laid out byte by byte
(all lowest bytes first), deflated, and written as base64; `replay.js` undoes it.
"""

import base64
import zlib
from types import MappingProxyType
from typing import Any

import numpy as np
from jaxtyping import Bool

from coverdrive.planning.plan import Status
from coverdrive.report.binding import Binding
from coverdrive.simulation.initial import OWN
from coverdrive.simulation.misses import cause_of, find_windows, left_recently
from coverdrive.simulation.trace import Trace

_CENTIMETRE, _FINE = 0.01, 0.001

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


def replay_data(trial: int, trace: Trace, binding: Binding) -> dict[str, Any]:
    """A drive as JSON values.

    Args:
        trial: its number.
        trace: the drive.
        binding: which obstacles bind.
    """
    scene, plans, paths, windows = trace.scene, trace.plans, trace.paths, find_windows(trace)
    points = np.concatenate([each.points for each in paths])
    packer = _Packer()
    packer.add("lon", scene.lon, _CENTIMETRE, axis=0)
    packer.add("lat", scene.lat, _CENTIMETRE, axis=0)
    packer.add("speed", scene.speed, _CENTIMETRE, axis=0)
    packer.add("heading", scene.heading, _FINE, axis=0)
    packer.add("valid", scene.valid, 1, axis=0)
    packer.add("left", left_recently(trace, windows), 1, axis=0)
    packer.add("paths", points, _CENTIMETRE, axis=1)
    packer.add("boxes", np.concatenate([each.half_sizes for each in paths]), _CENTIMETRE, axis=1)
    packer.add("vehicle", np.concatenate([each.vehicle for each in paths]), 1, axis=0)
    packer.add("binding", _packed_bits([binding.of(trace, step) for step in range(len(trace))]), 1)
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
        "own": OWN,
        "counts": [len(each) for each in paths],
        "status": [list(Status).index(plan.status) for plan in plans],
        "statuses": [status.value for status in Status],
        "milliseconds": (1e3 * trace.planning_seconds).round(1).tolist(),
        "arrays": packer.arrays,
        "data": packer.text,
    }


def _packed_bits(flags: list[Bool[np.ndarray, "_ P"]]) -> np.ndarray:
    """One integer for each path: bit k says whether it binds at point k."""
    everything = np.concatenate(flags)
    return everything.astype(np.int64) @ (1 << np.arange(everything.shape[1], dtype=np.int64))


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
