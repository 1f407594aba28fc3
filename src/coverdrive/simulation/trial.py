"""One trial of a study: an episode from a numbered seed, and its measures in one flat row."""

import typing
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from coverdrive.errors import StartError
from coverdrive.planning.plan import Planner, Status
from coverdrive.progress import heard_by
from coverdrive.simulation import metrics
from coverdrive.simulation.episode import EpisodeSettings, run_episode
from coverdrive.simulation.initial import EGO
from coverdrive.simulation.misses import cause_of, find_windows
from coverdrive.simulation.outcome import Kind
from coverdrive.simulation.predictor import Predictor
from coverdrive.simulation.trace import Trace
from coverdrive.simulation.traffic import Traffic


class Participants(NamedTuple):
    """Who takes part in an episode; built once per process, because solvers cannot move between processes."""

    predictor: Predictor
    """of the ego"""
    planner: Planner
    """of the ego"""
    traffic: Traffic
    """all uncontrolled vehicles"""


Build = Callable[[], Participants]
"""builds the participants of a study; sent to other processes, so its parts must be picklable"""


class TrialSettings(NamedTuple):
    """One trial of a study."""

    episode: EpisodeSettings
    """start, length and time steps"""
    vehicles: int
    """number of uncontrolled vehicles"""
    seed: int
    """of the study"""
    number: int
    """of the trial in its study, from 0; with the seed it gives the trial's random choices"""


Row = dict[str, Any]
"""the fields of a `TrialResult` by name"""


@dataclass(frozen=True)
class TrialResult:
    """The measures of one trial."""

    trial: int
    """number of the trial in its study, from 0"""
    seed: int
    """of the study; with the trial's number it gives the trial's random choices"""
    vehicles: int
    """number of uncontrolled vehicles"""
    kind: str
    """how the trial ended: a value of `coverdrive.simulation.outcome.Kind`"""
    time: float
    """[s] of the end"""
    partner: int | None
    """slot of the vehicle in contact with the ego"""
    at_fault: str
    """whose driving led to the contact: a value of `coverdrive.simulation.outcome.Fault`"""
    cause: str
    """what the contact has to do with the predictions: a value of `coverdrive.simulation.outcome.Cause`"""
    mean_speed: float
    """[m/s] of the ego"""
    distance: float
    """[m] that the ego came along the road"""
    lane_changes: int
    """of the ego"""
    overtakes: int
    """vehicles that were ahead of the ego at the start and behind it at the end"""
    road_departure: float
    """[m] that the ego's body got beyond the edges of the road"""
    minimum_gap: float
    """[m] least distance of the ego to another vehicle"""
    minimum_time_to_collision: float
    """[s] least time to contact of the ego, had all kept their velocity"""
    jerk_longitudinal: float
    """[m/s³] root mean square of the ego's jerk along its way"""
    jerk_lateral: float
    """[m/s³] root mean square of the ego's jerk across its way"""
    hardest_braking: float
    """[m/s²] largest deceleration of the ego"""
    maximum_slack: float
    """largest slack of an obstacle constraint in any plan"""
    share_slack: float
    """of the plans that violate an obstacle constraint"""
    planning_median: float
    """[s] wall time of a step's prediction and planning"""
    planning_p99: float
    """[s] wall time of a step's prediction and planning that 99 % of the steps stay below"""
    planning_maximum: float
    """[s] wall time of the slowest step's prediction and planning"""
    share_solved: float
    """of the plans that are optimised and clear of every predicted path"""
    share_unsafe: float
    """of the plans for which nothing clear was found"""
    share_rear: float
    """of the plans that are clear of all but the vehicle directly behind"""
    share_fallback: float
    """of the plans that are clear, but a simple manoeuvre or the rest of the last plan"""
    share_blind: float
    """of the plans made without knowing the own state or a path"""
    clear_contacts: int
    """steps in which a plan that was called clear touched a predicted box, which between samples it may"""
    traffic_stuck: int
    """how often an uncontrolled vehicle found no choice that passes its check"""
    traffic_collisions: int
    """pairs of uncontrolled vehicles that overlapped"""
    impossible_choices: int
    """how often an uncontrolled vehicle chose a base trajectory that the predictor calls impossible"""
    windows: int
    """predictions of one vehicle at one moment whose whole horizon was seen"""
    prediction_misses: int
    """those of them whose vehicle left every predicted path (`coverdrive.simulation.misses`)"""
    vehicles_seen: int
    """uncontrolled vehicles with at least one such window"""
    vehicles_missed: int
    """those of them that left every predicted path in at least one of them"""
    reason: str = ""
    """why the trial could not start; then all measures are null"""


_COLUMN_TYPES = {int: pl.Int64(), float: pl.Float64(), str: pl.String(), int | None: pl.Int64()}

_SLACK = 1e-3
"""a smaller slack is the solver's tolerance"""

SCHEMA = {field.name: _COLUMN_TYPES[typing.get_type_hints(TrialResult)[field.name]] for field in fields(TrialResult)}
"""columns of a table of trial results"""

STARTED = pl.col("kind") != Kind.NOT_STARTED.value
"""whether a trial could start, as an expression on a table of trials"""

WALL_TIMES = ("planning_median", "planning_p99", "planning_maximum")
"""columns that depend on the machine, not only on the seed"""


def run_trial(participants: Participants, trial: TrialSettings) -> Trace:
    """The episode of one trial, the same alone as within a study; a StartError if the vehicles cannot be placed."""
    seed = np.random.SeedSequence(trial.seed, spawn_key=(trial.number,))
    return run_episode(*participants, trial.episode, trial.vehicles, seed)


def run_and_measure(participants: Participants, trial: TrialSettings) -> Row:
    """The row of a trial; of one that cannot start, only who it is and why."""
    try:
        with heard_by(None):
            return asdict(measure(run_trial(participants, trial), trial.seed, trial.number))
    except StartError as error:
        known = {"trial": trial.number, "seed": trial.seed, "vehicles": trial.vehicles}
        return dict.fromkeys(SCHEMA) | known | {"kind": Kind.NOT_STARTED.value, "reason": str(error)}


def measure(trace: Trace, seed: int, trial: int) -> TrialResult:
    """All measures of one trial's trace."""
    windows = find_windows(trace)
    along, across = metrics.jerk(trace)
    slacks = np.array([plan.slack.max(initial=0.0) for plan in trace.plans])
    median, p99, maximum = np.quantile(trace.planning_seconds, (0.5, 0.99, 1.0)).tolist()
    statuses = Counter(plan.status for plan in trace.plans)
    return TrialResult(
        trial=trial,
        seed=seed,
        vehicles=int(trace.scene.valid[0].sum()) - 1,
        kind=trace.outcome.kind.value,
        time=trace.outcome.time,
        partner=trace.outcome.partner,
        at_fault=trace.outcome.at_fault.value,
        cause=cause_of(trace).value,
        mean_speed=float(trace.scene.speed[:, EGO].mean()),
        distance=float(trace.scene.lon[-1, EGO] - trace.scene.lon[0, EGO]),
        lane_changes=metrics.lane_changes(trace),
        overtakes=metrics.overtakes(trace),
        road_departure=metrics.road_departure(trace),
        minimum_gap=metrics.minimum_gap(trace),
        minimum_time_to_collision=metrics.minimum_time_to_collision(trace),
        jerk_longitudinal=along,
        jerk_lateral=across,
        hardest_braking=metrics.hardest_braking(trace),
        maximum_slack=float(slacks.max()),
        share_slack=float((slacks > _SLACK).mean()),
        planning_median=median,
        planning_p99=p99,
        planning_maximum=maximum,
        share_solved=statuses[Status.SOLVED] / len(trace),
        share_unsafe=statuses[Status.UNSAFE] / len(trace),
        share_rear=statuses[Status.REAR] / len(trace),
        share_fallback=statuses[Status.FALLBACK] / len(trace),
        share_blind=statuses[Status.BLIND] / len(trace),
        clear_contacts=metrics.clear_contacts(trace),
        traffic_stuck=int(trace.stuck.sum()),
        traffic_collisions=metrics.traffic_collisions(trace),
        impossible_choices=int(trace.missed.sum()),
        windows=int(windows.seen.sum()),
        prediction_misses=int(windows.missed.sum()),
        vehicles_seen=int(windows.seen.any(0).sum()),
        vehicles_missed=int(windows.missed.any(0).sum()),
    )


def table_of(rows: Sequence[Row]) -> pl.DataFrame:
    """Rows as a table."""
    return pl.DataFrame(rows, schema=SCHEMA)
