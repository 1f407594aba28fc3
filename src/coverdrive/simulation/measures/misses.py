"""Prediction misses: vehicles that left their predicted sets, told from where they really went.

A *window* is one vehicle at one planning moment. It is missed if, at some later moment of the drive within the horizon,
every path that was predicted for the vehicle has had a part of its body outside the box; between two points of a path,
boxes are on a line, as in plans. The certificate's ε is a bound on the same event. In the paper's tubes, the centre has
to stay in the ellipse in the box besides, at the points of a path alone, and the bound is on one path in place of all,
that which is nearest to what the vehicle did. Plans keep clear of the whole box; a collision is therefore put down to a
miss only if the vehicle left the boxes. n steps, A vehicles.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from coverdrive.plan import Status
from coverdrive.prediction.data.manoeuvres import gets_in_the_way, manoeuvres
from coverdrive.prediction.inside import every, inside
from coverdrive.simulation.drives.outcome import Cause, Kind
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.roads.initial import EGO

NEAR = 50.0
"""[m] along the road from the ego, as far as affordances look"""

_ROUNDING = 1e-6
"""[s] of a time"""


@dataclass(frozen=True)
class Windows:
    """All windows of a trace; those of the ego and of vehicles that are not there are neither seen nor left."""

    seen: Bool[np.ndarray, "n A"]
    """whether the vehicle was observed to the end of the horizon"""
    left: Float[np.ndarray, "n A"]
    """[s] from the planning moment until the vehicle had left every predicted path; infinite if it was not seen to"""

    @property
    def missed(self) -> Bool[np.ndarray, "n A"]:
        """Windows that were seen to the end, and missed."""
        return self.seen & np.isfinite(self.left)

    def of(self, asked: Bool[np.ndarray, "n A"]) -> "Windows":
        """Those asked for."""
        return Windows(self.seen & asked, np.where(asked, self.left, np.inf))

    @property
    def shares(self) -> Float[np.ndarray, " V"]:
        """Share of the windows of each vehicle that has any, which it missed."""
        total = self.seen.sum(0)
        return self.missed.sum(0)[total > 0] / total[total > 0]


def find_windows(trace: Trace, boxes: bool = False) -> Windows:
    """Follow every vehicle over the horizon of every prediction, as far as the trace goes; or of their boxes alone."""
    step = float(trace.time[1] - trace.time[0])
    at, paths = trace.all_paths
    paths = paths if paths.ellipses is not None else every(step, paths)
    times = paths.dt * np.arange(1, paths.points.shape[1])
    actual, observed = _poses(trace, np.arange(len(trace))[:, None] + times / step)
    present = np.asarray(trace.scene.valid[:-1]) & (np.arange(trace.scene.vehicles) != EGO)
    half_sizes = trace.scene.half_sizes[at, paths.vehicle]
    within = inside(paths, 1, actual[at, :, paths.vehicle].swapaxes(0, 1), half_sizes, boxes).T
    within |= ~observed[at, :, paths.vehicle]
    anywhere, observed = np.zeros((*present.shape, len(times)), dtype=bool), observed.swapaxes(1, 2)
    np.logical_or.at(anywhere, (at, paths.vehicle), np.logical_and.accumulate(within, axis=1))
    gone = ~anywhere & observed & present[..., None]
    left = np.where(gone.any(2), times[gone.argmax(2)], np.inf)
    return Windows(observed.all(2) & present, left)


def manoeuvres_in(trace: Trace) -> dict[str, Bool[np.ndarray, "n A"]]:
    """Which windows are which manoeuvre, of those seen to the end; cut-ins are in front of the ego."""
    step = float(trace.time[1] - trace.time[0])
    steps, states = len(trace), trace.scene.states
    ends = np.minimum(np.arange(steps) + round(trace.horizon / step), steps)
    own = np.stack([states[:-1, :, :2], states[ends, :, :2]])
    speed, heading = states[:-1, :, 2], states[:-1, :, 3]
    expected = np.stack([speed * np.cos(heading) * trace.horizon, np.zeros_like(speed)], -1)
    half_width = trace.scene.half_sizes[:-1, :, 1]
    other = np.broadcast_to(own[:, :, [EGO]], own.shape)
    return manoeuvres(own[1] - own[0] - expected, gets_in_the_way(own, other, half_width + half_width[:, [EGO]]))


def left_recently(trace: Trace, windows: Windows) -> Bool[np.ndarray, "m A"]:
    """Whether a vehicle has left, by each moment, a set that was predicted for it within one horizon before."""
    since = trace.time[:, None] - trace.time[:-1]
    recent = (since >= 0) & (since <= trace.horizon + _ROUNDING)
    gone = windows.left <= since[..., None] + _ROUNDING
    return (gone & recent[..., None]).any(1) & np.asarray(trace.scene.valid)


def cause_of(trace: Trace) -> Cause:
    """Whether a collision had to do with a vehicle that left its predicted set, if any plan before was clear.

    It had if the vehicle in contact left all boxes, before the contact, that were predicted for it at one moment within
    one horizon of the contact. Else the planner knew of everything that the vehicle did, and did not keep clear of it.
    """
    outcome = trace.outcome
    if outcome.kind is Kind.FINISHED or outcome.partner is None:
        return Cause.NONE
    if all(plan.status is Status.UNSAFE for plan in trace.plans):
        return Cause.START
    left = left_recently(trace, find_windows(trace, boxes=True))
    return Cause.PREDICTION if left[-1, outcome.partner] else Cause.PLANNING


def _poses(
    trace: Trace, moments: Float[np.ndarray, "n K"]
) -> tuple[Float[np.ndarray, "n K A 3"], Bool[np.ndarray, "n K A"]]:
    """Position [m] and heading [rad] of all vehicles at fractional moments, and whether they are known."""
    last = len(trace.time) - 1
    before = np.minimum(np.floor(moments + 1e-6).astype(int), last)
    share = np.maximum(moments - before, 0.0)[..., None, None]
    after = np.where(share[..., 0, 0] > 1e-6, np.minimum(before + 1, last), before)
    poses, valid = trace.scene.states[..., [0, 1, 3]], np.asarray(trace.scene.valid)
    known = valid[before] & valid[after] & (moments <= last + 1e-6)[..., None]
    return (1 - share) * poses[before] + share * poses[after], known
