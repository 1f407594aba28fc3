"""The table of the league as texts, for the terminal and the page alike."""

from typing import Any, NamedTuple

import polars as pl
from rich.table import Table

from coverdrive.percentages import interval
from coverdrive.reporting.tables.fitting import columns_table, or_none

COLUMNS = (
    "planner", "drives", "at fault", "not at fault", "mean speed [m/s]", "unsafe [%]", "jerk along [m/s³]",
    "headway [s]", "gap [m]", "least", "step [ms]", "sets",
)  # fmt: skip

ON_PROBLEMS = (
    "planner", "problems", "solved", "at fault", "not at fault", "off road", "progress [%]", "unsafe [%]", "least",
    "step [ms]", "sets",
)  # fmt: skip
"""columns where planning problems are solved"""

NOTE = (
    "Collisions at the ego's fault and all others, with 95 % Clopper–Pearson intervals; means over drives, and "
    "after Δ the 95 % interval of the paired difference to the first. Unsafe: plans for which nothing clear was found. "
    "Headway: kept in nine of ten moments behind somebody. Gap: the smallest one of a drive, on average and of all. "
    "Step: median time of prediction and plan. Solved: goals reached, as the judge of CommonRoad accepts, with the "
    "interval, as if problems were independent. Progress: share of the way to the place of the goal. Replays of "
    "recorded scenes depend on each other, and have no interval. Sets: what is proved of how often they are left, by "
    "the unit of the claim and with its confidence, and their scale λ; nothing where there are none, or none is known."
)


class World(NamedTuple):
    """What is said of a world."""

    name: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]
    """cells of these columns"""
    left_out: list[str]
    """who did not drive, and why"""


def worlds_of(table: pl.DataFrame) -> list[World]:
    """Every world of a table of `coverdrive.league.table`, in its order."""
    found: list[World] = []
    for part in table.partition_by("world", maintain_order=True):
        rows = list(part.iter_rows(named=True))
        left_out = [f"{row['planner']} does not drive: {row['left_out']}" for row in rows if row["left_out"]]
        posed = any(row["solved"] is not None for row in rows)
        cells = [(_solved if posed else _cells)(row) for row in rows if not row["left_out"]]
        found.append(World(rows[0]["world"], ON_PROBLEMS if posed else COLUMNS, cells, left_out))
    return found


def league_of(table: pl.DataFrame) -> dict[str, Any]:
    """What a page shows of a table."""
    return {"worlds": worlds_of(table), "note": NOTE}


def league_tables(table: pl.DataFrame) -> list[Table | str]:
    """A table for every world, and who did not drive there."""
    shown: list[Table | str] = []
    for world in worlds_of(table):
        if world.rows:
            shown.append(columns_table(world.name, world.columns, world.rows, first={}))
        shown += [f"• {each}" for each in world.left_out]
    return [*shown, NOTE]


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    return (
        row["planner"],
        str(row["drives"]),
        *(_counted(row, name) for name in ("at_fault", "not_at_fault")),
        _compared(row, "mean_speed", 1, ".2f"),
        _compared(row, "share_unsafe", 100, ".1f"),
        _compared(row, "jerk_longitudinal", 1, ".1f"),
        _compared(row, "usual_headway", 1, ".2f"),
        _compared(row, "minimum_gap", 1, ".1f"),
        *_last(row),
    )


def _solved(row: dict[str, Any]) -> tuple[str, ...]:
    ends = [row[f"solved_minus_{end}"] for end in ("low", "high")]
    compared = "" if None in ends else " (Δ " + " … ".join(f"{100 * end:+.0f}" for end in ends) + ")"
    return (
        row["planner"],
        str(row["drives"]),
        _counted(row, "solved") + compared,
        *(_counted(row, name) for name in ("at_fault", "not_at_fault", "off_road")),
        _compared(row, "progress", 100, ".0f"),
        _compared(row, "share_unsafe", 100, ".1f"),
        *_last(row),
    )


def _last(row: dict[str, Any]) -> tuple[str, str, str]:
    return (
        "–" if row["least_gap"] is None else or_none(row["least_gap"], "{:.1f}"),
        "–" if row["planning_median"] is None else f"{1e3 * row['planning_median']:.1f}",
        row["sets"] or "",
    )


def _counted(row: dict[str, Any], name: str) -> str:
    low, high = row[f"{name}_low"], row[f"{name}_high"]
    return str(row[name]) if low is None else f"{row[name]} ({interval(low, high)})"


def _compared(row: dict[str, Any], name: str, factor: float, form: str) -> str:
    """A mean, with the interval of its difference to the first entrant if it is another one."""
    if row[name] is None:
        return "–"
    shown, ends = f"{factor * row[name]:{form}}", (row[f"{name}_minus_low"], row[f"{name}_minus_high"])
    return shown if None in ends else f"{shown} (Δ {factor * ends[0]:+{form}} … {factor * ends[1]:+{form}})"
