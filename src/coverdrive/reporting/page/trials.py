"""The table of trials: one row each, with what makes it worth a look."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import polars as pl

from coverdrive.percentages import percent
from coverdrive.reporting.contents import Contents
from coverdrive.simulation.measures.notable import COLLIDED, NEARLY


class Row(NamedTuple):
    """One trial."""

    trial: int
    mark: str
    """"collision", "near" or nothing"""
    kind: str
    remark: str
    """of a collision who was at fault and what came before; of a trial that could not start the reason"""
    replay: bool
    """whether it can be replayed"""
    differs: bool
    """whether its replay ended otherwise: another version or machine, or a search that the time budget cut short"""
    numbers: tuple[tuple[float, str], ...]
    """value to sort by, and text"""


COLUMNS = (
    ("vehicles", "vehicles", "{:d}"),
    ("time", "time [s]", "{:.1f}"),
    ("mean_speed", "mean speed [m/s]", "{:.1f}"),
    ("lane_changes", "lane changes", "{:d}"),
    ("overtakes", "overtakes", "{:d}"),
    ("minimum_gap", "least gap [m]", "{:.2f}"),
    ("minimum_time_to_collision", "least time to collision [s]", "{:.2f}"),
    ("usual_headway", "headway, 9 of 10 moments [s]", "{:.2f}"),
    ("jerk_longitudinal", "jerk along [m/s³]", "{:.1f}"),
    ("hardest_braking_behind", "hardest braking behind [m/s²]", "{:.1f}"),
    ("maximum_slack", "largest slack", "{:.2f}"),
    ("share_unsafe", "unsafe plans", "{percent}"),
    ("prediction_misses", "windows missed", "{:d} of {windows}"),
    ("vehicles_missed", "vehicles missed", "{:d} of {vehicles_seen}"),
    ("planning_p99", "planning, 99 % [ms]", "{:.0f}"),
)
"""name in the table of trials, name on the page with its unit, and format, which may name other columns too, or the
value as a ``percent``
"""

LEAST_FIRST = {"mean_speed", "minimum_gap", "minimum_time_to_collision", "usual_headway"}
"""columns of which the least values are worth a look; of the others the largest are"""


def trial_rows(contents: Contents) -> list[Row]:
    """One row for each trial; none without a study."""
    if contents.trials is None:
        return []
    trials = contents.trials.with_columns(collided=COLLIDED, nearly=NEARLY, planning_p99=1e3 * pl.col("planning_p99"))
    rows: list[Row] = []
    for row in trials.iter_rows(named=True):
        trace = contents.traces.get(row["trial"])
        rows.append(
            Row(
                trial=row["trial"],
                mark="collision" if row["collided"] else "near" if row["nearly"] else "",
                kind=row["kind"],
                remark=f"at fault: {row['at_fault']}; {row['cause']}" if row["collided"] else row["reason"],
                replay=trace is not None,
                differs=trace is not None and trace.outcome.kind.value != row["kind"],
                numbers=tuple(_number(row, name, form) for name, _, form in COLUMNS),
            )
        )
    return rows


def _number(row: Mapping[str, Any], name: str, form: str) -> tuple[float, str]:
    """What a cell is sorted by, and its text; what is unknown, not a number, goes to the end."""
    value = row[name]
    if value is None or not math.isfinite(value):
        return (math.nan if value is None else float(value)), "–"
    return float(value), form.format(value, percent=percent(value), **row)
