"""The measures of one trial of a study in one flat row."""

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import polars as pl

from coverdrive.distances import FREE
from coverdrive.plan import Status
from coverdrive.prediction.data.manoeuvres import MANOEUVRES
from coverdrive.simulation.drives.outcome import Kind
from coverdrive.simulation.drives.trace import Trace
from coverdrive.simulation.measures import metrics
from coverdrive.simulation.measures.misses import NEAR, cause_of, find_windows, manoeuvres_in
from coverdrive.simulation.roads.initial import EGO

Row = dict[str, Any]
"""the values of one trial by the names of `COLUMNS`"""

_SLACK = 1e-3
"""a smaller slack is the solver's tolerance"""


class _Drive:
    """A trace, and what several measures of it begin with."""

    def __init__(self, trace: Trace, seed: int, trial: int):
        self.trace, self.seed, self.trial = trace, seed, trial
        self.outcome, self.lon, self.windows = trace.outcome, trace.scene.lon[:, EGO], find_windows(trace)
        self.near = self.windows.of(np.abs(trace.scene.lon[:-1] - self.lon[:-1, None]) <= NEAR)
        self.manoeuvres = {name: self.windows.of(own) for name, own in manoeuvres_in(trace).items()}
        self.distances = metrics.distances(trace)
        self.jerk_along, self.jerk_across = metrics.jerk(trace)
        self.slacks = np.array([plan.slack.max(initial=0.0) for plan in trace.plans])
        self.median, self.p99, self.slowest = np.quantile(trace.planning_seconds, (0.5, 0.99, 1.0))
        self._statuses = Counter(plan.status for plan in trace.plans)

    def headway(self, share: float) -> float:
        behind = self.distances.headway[np.isfinite(self.distances.headway)]
        return float(np.quantile(behind, share)) if len(behind) else np.inf

    def share(self, status: Status) -> float:
        return self._statuses[status] / len(self.trace)


COLUMNS: dict[str, tuple[type, Callable[[_Drive], Any], str]] = {
    "trial": (int, lambda of: of.trial, "number of the trial in its study, from 0"),
    "seed": (int, lambda of: of.seed, "of the study; with the trial's number it gives the trial's random choices"),
    "vehicles": (int, lambda of: of.trace.scene.valid[0].sum() - 1, "number of uncontrolled vehicles"),
    "kind": (str, lambda of: of.outcome.kind, "how the trial ended: a value of "
                                              "`coverdrive.simulation.drives.outcome.Kind`"),
    "time": (float, lambda of: of.outcome.time, "[s] of the end"),
    "partner": (int, lambda of: of.outcome.partner,
                "slot of the vehicle in contact with the ego, null if there is none"),
    "at_fault": (str, lambda of: of.outcome.at_fault, "whose driving led to the contact: a value of `….outcome.Fault`"),
    "cause": (str, lambda of: cause_of(of.trace), "what it has to do with predictions: a value of `….outcome.Cause`"),
    "mean_speed": (float, lambda of: of.trace.scene.speed[:, EGO].mean(), "[m/s] of the ego"),
    "distance": (float, lambda of: of.lon[-1] - of.lon[0], "[m] that the ego came along the road"),
    "lane_changes": (int, lambda of: metrics.lane_changes(of.trace), "of the ego"),
    "overtakes": (int, lambda of: metrics.overtakes(of.trace),
                  "vehicles ahead of the ego at the start, behind at the end"),
    "road_departure": (float, lambda of: metrics.road_departure(of.trace), "[m] that the ego's body got off the road"),
    "minimum_gap": (float, lambda of: metrics.gaps(of.trace).min(),
                    "[m] least distance of the ego to another vehicle"),
    "minimum_time_to_collision": (float, lambda of: of.distances.time_to_collision.min(),
                                  "[s] least time to contact of the ego, had all kept their velocity"),
    "minimum_headway": (float, lambda of: of.distances.headway.min(), "[s] least time headway to the vehicle ahead"),
    "usual_headway": (float, lambda of: of.headway(0.1), "[s] time headway kept in nine of ten moments behind one"),
    "median_headway": (float, lambda of: of.headway(0.5), "[s] time headway kept in half of them"),
    "minimum_left": (float, lambda of: of.distances.left.min(),
                     "[s] least time headway that the ego left to the vehicle behind"),
    "minimum_beside": (float, lambda of: of.distances.beside.min(), "[m] least distance across to one alongside"),
    "jerk_longitudinal": (float, lambda of: of.jerk_along, "[m/s³] root mean square of the ego's jerk along its way"),
    "jerk_lateral": (float, lambda of: of.jerk_across, "[m/s³] root mean square of the ego's jerk across its way"),
    "hardest_braking": (float, lambda of: metrics.hardest_braking(of.trace), "[m/s²] largest deceleration of the ego"),
    "hardest_braking_behind": (float, lambda of: metrics.hardest_braking_behind(of.trace, of.distances),
                               "[m/s²] largest deceleration of the vehicle behind the ego in its lane, less than "
                               f"{FREE:g} s behind"),
    "maximum_slack": (float, lambda of: of.slacks.max(), "largest slack of an obstacle constraint in any plan"),
    "share_slack": (float, lambda of: (of.slacks > _SLACK).mean(), "of the plans that violate an obstacle constraint"),
    "planning_median": (float, lambda of: of.median, "[s] processor time of a step's prediction and planning"),
    "planning_p99": (float, lambda of: of.p99, "[s] processor time of it that 99 % of the steps stay below"),
    "planning_maximum": (float, lambda of: of.slowest, "[s] processor time of the slowest step's"),
    "planning_wall_p99": (float, lambda of: np.quantile(of.trace.wall_seconds, 0.99),
                          "[s] wall time that 99 % of the steps stay below: more on a machine that is busy"),
    "share_solved": (float, lambda of: of.share(Status.SOLVED),
                     "of the plans that are optimised and clear of all paths"),
    "share_unsafe": (float, lambda of: of.share(Status.UNSAFE), "of the plans for which nothing clear was found"),
    "share_fallback": (float, lambda of: of.share(Status.FALLBACK),
                       "of the plans that are clear, but a simple manoeuvre or the rest of the last plan"),
    "share_invalid_input": (float, lambda of: of.share(Status.INVALID_INPUT),
                            "of the plans made without knowing the ego's state or a path"),
    "lost_clear": (int, lambda of: metrics.lost_clear(of.trace),
                   "steps after a clear plan for which none was found, as the sets had grown beyond the last ones"),
    "clear_contacts": (int, lambda of: metrics.clear_contacts(of.trace),
                       "steps in which a plan called clear touched a predicted box at any time; must be 0"),
    "traffic_stuck": (int, lambda of: of.trace.stuck.sum(),
                      "how often an uncontrolled vehicle found no choice that passes its check"),
    "traffic_collisions": (int, lambda of: metrics.traffic_collisions(of.trace),
                           "pairs of uncontrolled vehicles in contact"),
    "impossible_choices": (int, lambda of: of.trace.missed.sum(),
                           "how often one of them chose a base trajectory that the predictor calls impossible"),
    "windows": (int, lambda of: of.windows.seen.sum(),
                "predictions of one vehicle at one moment whose whole horizon was seen"),
    "prediction_misses": (int, lambda of: of.windows.missed.sum(),
                          "those of them whose vehicle left every predicted path "
                          "(`coverdrive.simulation.measures.misses`)"),
    "vehicles_seen": (int, lambda of: of.windows.seen.any(0).sum(),
                      "uncontrolled vehicles with at least one such window"),
    "vehicles_missed": (int, lambda of: of.windows.missed.any(0).sum(),
                        "those of them that left every predicted path in at least one of them"),
    "shares_missed": (float, lambda of: of.windows.shares.sum(),
                      "sum over the vehicles seen of the share of a vehicle's windows that were missed"),
    "near_seen": (int, lambda of: len(of.near.shares),
                  f"uncontrolled vehicles with at least one such window that begins within {NEAR:g} m of the ego"),
    "near_shares_missed": (float, lambda of: of.near.shares.sum(),
                           "the same sum over them and these windows"),
    "reason": (str, lambda of: "", "why the trial could not start; then all measures are null"),
}  # fmt: skip
"""of a table of trials, by name: type, value, and what it is; those of planning times depend on the machine, too"""

for _name, _words in MANOEUVRES.items():
    COLUMNS[f"windows_{_name}"] = (
        int, lambda of, name=_name: of.manoeuvres[name].seen.sum(), f"such predictions that begin this: {_words}"
    )  # fmt: skip
    COLUMNS[f"misses_{_name}"] = (
        int, lambda of, name=_name: of.manoeuvres[name].missed.sum(), "those of them whose vehicle left every path"
    )  # fmt: skip

SCHEMA = {name: {int: pl.Int64(), float: pl.Float64(), str: pl.String()}[kind] for name, (kind, *_) in COLUMNS.items()}

STARTED = pl.col("kind") != Kind.NOT_STARTED.value
"""whether a trial could start, as an expression on a table of trials"""


def measure(trace: Trace, seed: int, trial: int) -> Row:
    """All measures of one trial's trace."""
    drive = _Drive(trace, seed, trial)
    values = {name: (kind, value(drive)) for name, (kind, value, _) in COLUMNS.items()}
    return {name: None if value is None else kind(value) for name, (kind, value) in values.items()}


def unstarted(seed: int, trial: int, vehicles: int, reason: str) -> Row:
    """The row of a trial that could not start."""
    known = {"trial": trial, "seed": seed, "vehicles": vehicles, "kind": Kind.NOT_STARTED.value, "reason": reason}
    return dict.fromkeys(COLUMNS) | known
