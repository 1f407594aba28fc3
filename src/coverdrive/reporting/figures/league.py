"""Risk against progress: every entrant of the league in every world."""

from typing import Any

import polars as pl

from coverdrive.reporting.plotting import style
from coverdrive.reporting.plotting.figure import Axis, Figure, Line, Mark, Panel, crossed

_ACROSS = 3
"""panels in a row"""
_LETTERS = 16
"""of the name of a world that find room above a panel"""
_CAPTION = (
    "Collisions at the ego's fault against its mean speed, or against the planning problems solved: up and left is "
    "better. Horizontal: 95 % Clopper–Pearson intervals; vertical: 95 % intervals of the mean, or Clopper–Pearson's of "
    "the problems solved; replays depend on each other, and have none. All drive on equal seeds: differences, in the "
    "table, are told more exactly. Dashed: whom nobody beats in both."
)


def league_figure(table: pl.DataFrame) -> Figure | None:
    """One panel for every world of a table of `coverdrive.league.table`; None if nobody drove."""
    driven = table.filter(pl.col("drives") > 0)
    if driven.is_empty():
        return None
    planners = driven["planner"].unique(maintain_order=True).to_list()
    panels = [_panel(part, planners) for part in driven.partition_by("world", maintain_order=True)]
    rows = [panels[start : start + _ACROSS] for start in range(0, len(panels), _ACROSS)]
    return Figure(rows, height=0.5 + 2.4 * len(rows), caption=_CAPTION, legend_columns=4)


def _panel(world: pl.DataFrame, planners: list[str]) -> Panel:
    rows = world.to_dicts()
    marks: list[Mark] = [_frontier(rows)]
    for row in rows:
        marks += _marks(row, planners.index(row["planner"]))
    x = Axis("collisions at fault [%]")
    y = Axis("solved [%]" if rows[0]["solved"] is not None else "mean speed [m/s]")
    name = rows[0]["world"]
    short = name if len(name) <= _LETTERS else f"…{name[1 - _LETTERS :]}"  # the table has all of it
    return Panel(marks, x, y, title=f"{short} ({rows[0]['drives']} drives)")


def _risk(row: dict[str, Any]) -> float:
    """[%] of the drives."""
    return 100 * row["at_fault"] / row["drives"]


def _progress(row: dict[str, Any]) -> tuple[float, str, float]:
    """[%] of the problems or [m/s], the name of it, and by what its interval is multiplied."""
    if row["solved"] is not None:
        return 100 * row["solved"] / row["drives"], "solved", 100
    return row["mean_speed"], "mean_speed", 1


def _frontier(rows: list[dict[str, Any]]) -> Line:
    """Those than whom nobody is both safer and faster."""
    best, x, y = float("-inf"), list[float](), list[float]()
    for row in sorted(rows, key=lambda row: (_risk(row), -_progress(row)[0])):
        if (progress := _progress(row)[0]) > best:
            best = progress
            x.append(_risk(row))
            y.append(best)
    return Line(x=x, y=y, colour=style.GREY, width=0.8, dashed=True)


def _marks(row: dict[str, Any], number: int) -> list[Mark]:
    progress, name, factor = _progress(row)
    low, high = (None if row[end] is None else 100 * row[end] for end in ("at_fault_low", "at_fault_high"))
    count = f"{row['at_fault']} of {row['drives']} collided at fault"
    count += "" if low is None else f" ({low:.2g}–{high:.2g} %)"
    gained = f"{progress:.2f} m/s" if factor == 1 else f"{row['solved']} solved"
    ends = (row[f"{name}_{end}"] for end in ("low", "high"))
    least, most = (None if end is None else factor * end for end in ends)
    return crossed(
        _risk(row), progress, (low, high), (least, most), f"{row['planner']}\n{count}\n{gained}",
        colour=style.CYCLE[number % len(style.CYCLE)], marker=style.MARKERS[number % len(style.MARKERS)],
        name=row["planner"],
    )  # fmt: skip
