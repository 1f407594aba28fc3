"""Risk against progress: every entrant of the league in every world."""

from typing import Any

import polars as pl

from coverdrive.percentages import counted, interval
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
    posed, drives = world["solved"][0] is not None, pl.col("drives")
    measure, factor = ("solved", 100) if posed else ("mean_speed", 1)
    world = world.with_columns(
        risk=100 * pl.col("at_fault") / drives,
        low=100 * pl.col("at_fault_low"),
        high=100 * pl.col("at_fault_high"),
        progress=100 * pl.col("solved") / drives if posed else pl.col("mean_speed"),
        least=factor * pl.col(f"{measure}_low"),
        most=factor * pl.col(f"{measure}_high"),
    )
    marks: list[Mark] = [_frontier(world)]
    for row in world.iter_rows(named=True):
        marks += _marks(row, planners.index(row["planner"]))
    name = str(world["world"][0])
    short = name if len(name) <= _LETTERS else f"…{name[1 - _LETTERS :]}"  # the table has all of it
    x, y = Axis("collisions at fault [%]"), Axis("solved [%]" if posed else "mean speed [m/s]")
    return Panel(marks, x, y, title=f"{short} ({counted(world['drives'][0], 'drive')})")


def _frontier(world: pl.DataFrame) -> Line:
    """Those than whom nobody is both safer and faster."""
    faster = pl.col("progress") > pl.col("progress").cum_max().shift(fill_value=float("-inf"))
    best = world.sort("risk", "progress", descending=[False, True]).filter(faster)
    return Line(x=best["risk"].to_list(), y=best["progress"].to_list(), colour=style.GREY, width=0.8, dashed=True)


def _marks(row: dict[str, Any], number: int) -> list[Mark]:
    count = f"{row['at_fault']} of {row['drives']} collided at fault"
    count += "" if row["low"] is None else f" ({interval(row['at_fault_low'], row['at_fault_high'])})"
    gained = f"{row['progress']:.2f} m/s" if row["solved"] is None else f"{row['solved']} solved"
    return crossed(
        row["risk"], row["progress"], (row["low"], row["high"]), (row["least"], row["most"]),
        f"{row['planner']}\n{count}\n{gained}", colour=style.CYCLE[number % len(style.CYCLE)],
        marker=style.MARKERS[number % len(style.MARKERS)], name=row["planner"],
    )  # fmt: skip
