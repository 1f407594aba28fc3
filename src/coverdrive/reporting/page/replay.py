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

from coverdrive.plan import Status
from coverdrive.planning.problem.settings import ProblemSettings
from coverdrive.reporting.drives.active_constraints import active_constraints
from coverdrive.reporting.drives.reasons import reason_of, where_is
from coverdrive.reporting.drives.worst_moment import nearest, worst_moment
from coverdrive.road_markings import across, bends, markings
from coverdrive.simulation.drives.outcome import Kind
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures.metrics import distances, gaps
from coverdrive.simulation.measures.misses import cause_of, find_windows, left_recently
from coverdrive.simulation.measures.notable import NEAR_GAP, NEAR_TIME
from coverdrive.simulation.roads.initial import EGO

_COARSE, _CENTIMETRE, _FINE = 0.02, 0.01, 0.001
_SEEN = 200.0
"""[m] beyond the way of the ego that a page shows at the most"""
_FAR = 100.0
"""[m], [s] that a gap, or a time to collision, is at the most"""

STATUSES = MappingProxyType(
    {
        Status.SOLVED.value: "an optimised plan that is clear of every predicted path",
        Status.FALLBACK.value: "the rest of the last plan or a simple manoeuvre, clear of every predicted path",
        Status.UNSAFE.value: "nothing clear was found",
        Status.INVALID_INPUT.value: "what was seen cannot be true, so that nothing can be promised",
    }
)
"""how plans were found, each in one line"""

MARKS = MappingProxyType(
    {
        "contact": "contact",
        "gap": "least gap",
        "time": "least time to collision",
        "lost": "clear plan lost",
        "unsafe": "no clear plan",
        "left": "left its set",
        "lane": "lane change",
    }
)
"""kinds of moments that are marked, in a few words"""

SLACK = "how far a plan reaches into a predicted box, tube included: 0 at its edge, 1 at its centre"
"""in one line"""

SEVERITY = "where nothing is clear: relative speed at the worst first contact with a predicted box"
"""in one line"""


def replay_data(trial: int, trace: Trace, problem: ProblemSettings | None) -> dict[str, Any]:
    """A drive, the trial of this number, as JSON values, with what is active in a problem, if it is known."""
    scene, plans, paths = trace.scene, trace.plans, trace.paths
    windows = find_windows(trace)
    left = left_recently(trace, windows)
    reasons = [reason_of(trace, step) for step in range(len(trace))]
    arrays, data = _packed({
        "lon": (scene.lon, _CENTIMETRE, 0),
        "lat": (scene.lat, _CENTIMETRE, 0),
        "speed": (scene.speed, _CENTIMETRE, 0),
        "heading": (scene.heading, _FINE, 0),
        "valid": (scene.valid, 1, 0),
        "gap": (np.minimum(gaps(trace), _FAR), _CENTIMETRE, 0),
        "ttc": (np.minimum(distances(trace).time_to_collision, _FAR), _CENTIMETRE, 0),
        "severity": ([plan.severity for plan in plans], _CENTIMETRE, 0),
        "met": ([reason.path for reason in reasons], 1, None),
        "metAt": ([reason.time for reason in reasons], _CENTIMETRE, None),
        "left": (left, 1, 0),
        "paths": (_side_by_side([each.points for each in paths]), _COARSE, 0),
        "boxes": (_side_by_side([each.half_sizes for each in paths]), _COARSE, 0),
        "vehicle": (np.concatenate([each.vehicle for each in paths]), 1, 0),
        "active": (_active(trace, problem), 1, None),
        "plan": (np.stack([plan.states[:, [0, 1, 3]] for plan in plans]), _FINE, 1),
        "held": (np.stack([plan.held[:, [0, 1, 3]] for plan in plans]), _FINE, 1),
        "slack": (np.stack([plan.slack for plan in plans]), _FINE, None),
        "input": (np.stack([plan.inputs[0] for plan in plans]), _FINE, None),
    })  # fmt: skip
    return {
        "trial": trial,
        "kind": trace.outcome.kind.value,
        "partner": trace.outcome.partner,
        "fault": trace.outcome.at_fault.value,
        "cause": cause_of(trace).value,
        "dt": float(trace.time[1] - trace.time[0]),
        "planDt": plans[0].dt,
        "road": _road(trace),
        "sizes": np.stack([scene.length[0], scene.width[0]], axis=-1).round(2).tolist(),
        "own": EGO,
        "nearly": [NEAR_GAP, NEAR_TIME],
        "counts": [len(each) for each in paths],
        "status": [list(Status).index(plan.status) for plan in plans],
        "statuses": [status.value for status in Status],
        "reasons": [reason.text for reason in reasons],
        "milliseconds": (1e3 * trace.planning_seconds).round(1).tolist(),
        "marks": _marks(trace, left, [reason.text for reason in reasons]),
        "worst": worst_moment(trace, windows)._asdict(),
        "arrays": arrays,
        "data": data,
    }


def _road(trace: Trace) -> dict[str, Any]:
    """Where the road lies and its lines are [m], as far as anybody sees it, and what is to be said of it."""
    first, last = (float(limit) for limit in (trace.scene.lon[:, EGO].min(), trace.scene.lon[:, EGO].max()))
    lines = markings(trace.road, first - _SEEN, last + _SEEN)
    return {
        "across": np.round(across(trace.road), 3).tolist(),
        "lines": [{"outer": line.outer, "points": line.points.round(2).tolist()} for line in lines],
        "bends": bends(trace.road),
    }


def _side_by_side(arrays: list[Float[np.ndarray, "_ P 2"]]) -> Float[np.ndarray, "P 2 S"]:
    """The paths of all steps, with the path as the last axis."""
    return np.moveaxis(np.concatenate(arrays), 0, -1)


def _active(trace: Trace, problem: ProblemSettings | None) -> Int[np.ndarray, " S"]:
    """One integer for each path: bit k says whether it constrains the plan at point k."""
    if problem is None:
        return np.zeros(sum(len(each) for each in trace.paths), dtype=np.int64)
    everything = np.concatenate([active_constraints(trace, step, problem) for step in range(len(trace))])
    return everything.astype(np.int64) @ (1 << np.arange(everything.shape[1], dtype=np.int64))


def _marks(trace: Trace, left: Bool[np.ndarray, "m A"], reasons: list[str]) -> list[tuple[int, str, str]]:
    """Moments of note: when, which kind of `MARKS`, and what happened."""
    lane = trace.road.lane_at(trace.scene.lon[:, EGO], trace.scene.lat[:, EGO])
    changed = [(int(step) + 1, "lane", "the ego changes lane") for step in np.flatnonzero(lane[1:] != lane[:-1])]
    newly = left & ~np.concatenate([np.zeros_like(left[:1]), left[:-1]])
    gone = [
        (moment, "left", f"the vehicle {where_is(trace, moment, slot)} has left its set")
        for moment, slot in np.argwhere(newly).tolist()
    ]
    near = [(measure, nearest(trace, measure)) for measure in ("gap", "time")]
    least = [(each.moment, measure, each.text) for measure, each in near if each]
    clear, statuses = (Status.SOLVED, Status.FALLBACK), [plan.status for plan in trace.plans]
    plans = [
        (step, "lost" if before in clear and step else "unsafe", f"plan {status.value}: {reasons[step]}")
        for step, (status, before) in enumerate(zip(statuses, [Status.SOLVED, *statuses], strict=False))
        if status is not before and status not in clear
    ]
    hit = [(len(trace), "contact", f"{trace.outcome.kind.value} collision")] * (trace.outcome.kind is not Kind.FINISHED)
    return sorted([*changed, *gone, *least, *plans, *hit])


def _packed(values: dict[str, tuple[Any, float, int | None]]) -> tuple[dict[str, dict[str, Any]], str]:
    """What each array is, and all of them as one text.

    An array comes with the unit to half of which it is to be restored, and the axis along which differences are stored.
    """
    arrays: dict[str, dict[str, Any]] = {}
    integers: list[np.ndarray] = []
    for name, (array, unit, axis) in values.items():
        whole = np.rint(np.asarray(array, dtype=float) / unit).astype(np.int32)
        whole = whole if axis is None else np.diff(whole, axis=axis, prepend=0)
        arrays[name] = {"shape": list(whole.shape), "unit": unit, "axis": axis}
        integers.append(whole.ravel())
    planes = np.concatenate(integers).astype("<i4").view(np.uint8).reshape(-1, 4).T
    return arrays, base64.b64encode(zlib.compress(np.ascontiguousarray(planes).tobytes(), 9)).decode()
