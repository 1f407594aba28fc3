"""The table of the league as texts, for the terminal and the page alike."""

from typing import Any, NamedTuple

import polars as pl
from rich.table import Table

from coverdrive.numbers import interval
from coverdrive.reporting.fitting import columns_table

COLUMNS = (
    "planner", "drives", "at fault", "not at fault", "mean speed [m/s]", "unsafe [%]", "jerk along [m/s³]", "gap [m]",
    "least", "step [ms]",
)  # fmt: skip

NOTE = (
    "Collisions at the ego's fault and all others, with 95 % Clopper–Pearson intervals; means over drives, and in "
    "brackets 95 % intervals of the paired difference to the first. Unsafe: plans for which nothing clear was found. "
    "Gap: the smallest one of a drive, on average and of all. Step: median time of prediction and plan."
)


class World(NamedTuple):
    """What is said of a world."""

    name: str
    rows: list[tuple[str, ...]]
    """cells of the `COLUMNS`"""
    left_out: list[str]
    """who did not drive, and why"""


def worlds_of(table: pl.DataFrame) -> list[World]:
    """Every world of a table of `coverdrive.league.table`, in its order."""
    found: list[World] = []
    for part in table.partition_by("world", maintain_order=True):
        rows = list(part.iter_rows(named=True))
        left_out = [f"{row['planner']} does not drive: {row['left_out']}" for row in rows if row["left_out"]]
        found.append(World(rows[0]["world"], [_cells(row) for row in rows if not row["left_out"]], left_out))
    return found


def league_of(table: pl.DataFrame) -> dict[str, Any]:
    """What a page shows of a table."""
    return {"columns": COLUMNS, "worlds": worlds_of(table), "note": NOTE}


def league_tables(table: pl.DataFrame) -> list[Table | str]:
    """A table for every world, and who did not drive there."""
    shown: list[Table | str] = []
    for world in worlds_of(table):
        if world.rows:
            shown.append(columns_table(world.name, COLUMNS, world.rows, first={}))
        shown += [f"• {each}" for each in world.left_out]
    return [*shown, NOTE]


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    return (
        row["planner"],
        str(row["drives"]),
        *(
            f"{row[name]} ({interval(row[f'{name}_low'], row[f'{name}_high'])})"
            for name in ("at_fault", "not_at_fault")
        ),
        _compared(row, "mean_speed", 1, ".2f"),
        _compared(row, "share_unsafe", 100, ".1f"),
        _compared(row, "jerk_longitudinal", 1, ".1f"),
        _compared(row, "minimum_gap", 1, ".1f"),
        "–" if row["least_gap"] is None else f"{row['least_gap']:.1f}",
        "–" if row["planning_median"] is None else f"{1e3 * row['planning_median']:.1f}",
    )


def _compared(row: dict[str, Any], name: str, factor: float, form: str) -> str:
    """A mean, with the interval of its difference to the first entrant if it is another one."""
    if row[name] is None:
        return "–"
    shown, ends = f"{factor * row[name]:{form}}", (row[f"{name}_minus_low"], row[f"{name}_minus_high"])
    return shown if None in ends else f"{shown} ({factor * ends[0]:+{form}} … {factor * ends[1]:+{form}})"
